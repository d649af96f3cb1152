# SPDX-License-Identifier: Apache-2.0
"""A warm-started SQP for the equilibrium problem with given constraint bounds.

Each step solves the QP with the exact Hessian of the Lagrangian. Where that is not positive
definite along the active constraints, negative directions are turned positive, so that steps go
downhill in energy. Where symmetry holds the iterates at a saddle (a finger pressed head-on onto a
sphere) they stay there, and the reduced Hessian tells.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from .equilibrium import EquilibriumProblem, Evaluation
from .kinematics import Linearization
from .qp import solve_multipliers

BAND = 0.1  # points nearer to an obstacle than this (units of L) enter the QP
_AUGMENT = 10.0  # weight of the active constraints' augmentation, in units of the rod's stiffness
ACTIVE = 1e-9  # multipliers (T L^2 / EI) above this carry force


_NO_PAIRS = np.empty((0, 2), dtype=int)
_NO_NORMALS, _NO_CURVATURES, _NO_FORCES = np.empty((0, 3)), np.empty((0, 3, 3)), np.empty(0)


@dataclass(frozen=True, eq=False)
class Bounds:
    """Bounds of the constraints: lengths (C,) and penetrations allowed (O, P), units of L."""

    lengths: np.ndarray
    penetrations: np.ndarray


@dataclass(frozen=True, eq=False)
class KktPoint:
    """A pose with multipliers and all derivatives; it knows no bounds.

    Attributes:
        at, first: Values and first derivatives.
        tensions: (C,) multipliers of the lengths.
        forces: (O, P) multipliers of the contacts.
        pairs: (c, 2) contact candidates (obstacle, point).
        normals: (c, 3) of the obstacle there; curvatures: (c, 3, 3) its distance's Hessian, in 1/L.
        rows: (C + c, N) constraint gradients, lengths first.
        values: (C + c,) constraint values: lengths, and negative distances.
        multipliers: (C + c,) tensions and the candidates' forces.
        hessian: (N, N) Hessian of the Lagrangian, exact.
        unbalanced: (N,) generalised forces left over, but for friction.
        residual: Largest unbalanced generalised force, relative to the largest elastic one or 1.
    """

    at: Evaluation
    first: Linearization
    tensions: np.ndarray
    forces: np.ndarray
    pairs: np.ndarray
    normals: np.ndarray
    curvatures: np.ndarray
    rows: np.ndarray
    values: np.ndarray
    multipliers: np.ndarray
    hessian: np.ndarray
    unbalanced: np.ndarray
    residual: float

    @property
    def active(self) -> np.ndarray:
        """(C + c,) constraints that carry force."""
        return self.multipliers > ACTIVE

    def slacks(self, bounds: Bounds) -> np.ndarray:
        """(C + c,) bound less value: negative where a constraint is violated."""
        if len(self.pairs):
            inside = bounds.penetrations[self.pairs[:, 0], self.pairs[:, 1]]
            return np.concatenate([bounds.lengths, inside]) - self.values
        return bounds.lengths - self.values


@dataclass(frozen=True, eq=False)
class SqpResult:
    """Where the SQP ended, after how many QP steps, and whether at an equilibrium."""

    point: KktPoint
    iterations: int
    converged: bool


def solve_sqp(
    problem: EquilibriumProblem,
    point: KktPoint,
    bounds: Bounds,
    max_iterations: int,
    deadline: float,
) -> SqpResult:
    """Minimise the energy within bounds from ``point``, until the thread's time is ``deadline``."""
    settings = problem.settings
    price, best = 10.0, np.inf
    for iteration in range(max_iterations):
        slacks = point.slacks(bounds)
        over = violation(point, slacks)
        error = point.residual + over
        if point.residual <= settings.tolerance and over <= settings.tolerance:
            return SqpResult(point, iteration, True)
        found = _qp_step(point, slacks) if time.thread_time() < deadline else None
        if found is None:
            return SqpResult(point, iteration, False)
        step, multipliers = found
        price = max(price, 2.0 * float(multipliers.max(initial=0.0)))
        # Near the solution, or while the error falls, Newton's full step is best: the merit
        # function would resist it for its curvature alone (the Maratos effect).
        newton = error < 0.5 * best or float(np.abs(step).max()) < 1e-4
        best = min(best, error)
        at = _line_search(problem, point, step, bounds, price, newton)
        point = derive(problem, at, *_scatter(point, multipliers))
    return SqpResult(point, max_iterations, False)


def derive(
    problem: EquilibriumProblem,
    at: Evaluation,
    tensions: np.ndarray,
    forces: np.ndarray,
) -> KktPoint:
    """Return the KKT point of a pose with multipliers: all derivatives and the residual."""
    first = problem.linearize(at)
    pairs = _candidates(problem, at, forces)
    normals, curvatures, pressing = _NO_NORMALS, _NO_CURVATURES, _NO_FORCES
    rows, values, multipliers = first.lengths, at.lengths, tensions
    if len(pairs):
        index = pairs[:, 0], pairs[:, 1]
        contact, normals, curvatures = problem.contact_rows(at, first, pairs)
        pressing = forces[index]
        rows = np.concatenate([rows, contact])
        values = np.concatenate([values, -at.distances[index]])
        multipliers = np.concatenate([tensions, pressing])
    hessian = problem.hessian(at, first, tensions, pairs, normals, curvatures, pressing)
    unbalanced = at.y + multipliers @ rows
    residual = float(np.abs(unbalanced).max() / max(1.0, np.abs(at.y).max()))
    return KktPoint(
        at, first, tensions, forces, pairs, normals, curvatures, rows, values, multipliers,
        hessian, unbalanced, residual,
    )  # fmt: skip


def _candidates(problem: EquilibriumProblem, at: Evaluation, forces: np.ndarray) -> np.ndarray:
    """Pairs (c, 2) of obstacle and point that are near each other or press on each other."""
    if not problem.obstacles:
        return _NO_PAIRS
    near = (at.distances < BAND) | (forces > 0)
    near[:, problem.fixed] = False
    return np.argwhere(near)


def violation(point: KktPoint, slacks: np.ndarray) -> float:
    """Largest violation, or gap of a constraint that carries force (units of L)."""
    gap = np.where(point.active, np.abs(slacks), -slacks)
    return max(0.0, float(gap.max()))


def _scatter(point: KktPoint, multipliers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    count = len(point.tensions)
    forces = np.zeros_like(point.forces)
    if len(point.pairs):
        forces[point.pairs[:, 0], point.pairs[:, 1]] = multipliers[count:]
    return multipliers[:count], forces


def _qp_step(point: KktPoint, slacks: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """The step (N,) and the new multipliers; None where the QP is infeasible or not finite."""
    active = point.active
    hessian, slope = point.hessian, point.at.y
    if active.any():
        # On the active constraints A d = r the added term |A d - r|^2 vanishes with its gradient:
        # it moves neither the QP's solution nor its multipliers, but makes the matrix definite
        # wherever the reduced Hessian is.
        held = point.rows[active]
        weight = _AUGMENT / np.maximum(np.einsum("ij,ij->i", held, held), 1e-12)
        hessian = hessian + (held.T * weight) @ held
        slope = slope - held.T @ (weight * slacks[active])
    solid = definite(hessian)
    if solid is None:
        return None
    solved = np.linalg.solve(solid, np.concatenate([slope[None], point.rows]).T)
    gram = point.rows @ solved
    multipliers = solve_multipliers(
        0.5 * (gram[:, 1:] + gram[:, 1:].T), slacks + gram[:, 0], active
    )
    if multipliers is None:
        return None
    step = -(solved[:, 0] + solved[:, 1:] @ multipliers)
    return (step, multipliers) if np.all(np.isfinite(step)) else None


def definite(matrix: np.ndarray) -> np.ndarray | None:
    """Return the matrix, its negative eigenvalues turned positive; None if it is not finite."""
    try:
        np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        if not np.all(np.isfinite(matrix)):
            return None
        values, vectors = np.linalg.eigh(matrix)
        return (vectors * np.maximum(np.abs(values), 1e-3)) @ vectors.T
    return matrix


def _merit(at: Evaluation, bounds: Bounds, price: float, fixed: np.ndarray) -> float:
    """Energy plus the price of all violations: an exact (l1) penalty."""
    over = np.maximum(at.lengths - bounds.lengths, 0.0).sum()
    inside = np.maximum(-at.distances - bounds.penetrations, 0.0)[:, ~fixed].sum()
    return 0.5 * float(at.y @ at.y) + price * float(over + inside)


def _line_search(
    problem: EquilibriumProblem,
    point: KktPoint,
    step: np.ndarray,
    bounds: Bounds,
    price: float,
    newton: bool,
) -> Evaluation:
    turn = float(np.abs(step).max()) * problem.largest_scale
    size = min(1.0, 0.5 / turn) if turn > 0 else 1.0  # at most 0.5 rad in one arc
    trial = problem.evaluate(point.at.y + size * step)
    if newton and size == 1.0:
        return trial
    start = _merit(point.at, bounds, price, problem.fixed)
    for _ in range(12):
        if _merit(trial, bounds, price, problem.fixed) <= start - 1e-6 * size * abs(start):
            break
        size *= 0.5
        trial = problem.evaluate(point.at.y + size * step)
    return trial
