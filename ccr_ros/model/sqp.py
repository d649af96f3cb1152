# SPDX-License-Identifier: Apache-2.0
"""A warm-started SQP for the equilibrium problem with fixed constraint bounds.

Each step solves the QP with the exact Hessian of the Lagrangian. Where that is not positive
definite along the active constraints, negative directions are turned positive, so that steps go
downhill in energy; where a symmetric pose holds the iterates at a saddle they stay there and the
reduced Hessian tells (paper_notes: a head-on finger).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .equilibrium import EquilibriumProblem, Evaluation, Linearization
from .qp import solve_multipliers

_BAND = 0.1  # points nearer to an obstacle than this (units of L) enter the QP
_AUGMENT = 10.0  # weight of the active constraints' augmentation, in units of the rod's stiffness


@dataclass(frozen=True, eq=False)
class Bounds:
    """Bounds of the constraints: lengths (C,) and penetrations (O, P) allowed, units of L."""

    lengths: np.ndarray
    penetrations: np.ndarray


@dataclass(frozen=True, eq=False)
class KktPoint:
    """An iterate with its derivatives and multipliers.

    Attributes:
        at, first: Values and first derivatives.
        tensions: (C,) multipliers of the lengths.
        forces: (O, P) multipliers of the contacts.
        pairs: (c, 2) contact candidates (obstacle, point).
        rows: (C + c, N) constraint gradients, lengths first; multipliers: (C + c,) theirs.
        hessian: (N, N) Hessian of the Lagrangian, exact.
        residual: KKT residual relative to the elastic force.
        violation: Largest constraint violation, or complementarity gap of a taut one (units of L).
        iterations: QP steps taken.
        converged: Both within tolerance.
    """

    at: Evaluation
    first: Linearization
    tensions: np.ndarray
    forces: np.ndarray
    pairs: np.ndarray
    normals: np.ndarray
    rows: np.ndarray
    multipliers: np.ndarray
    hessian: np.ndarray
    residual: float
    violation: float
    iterations: int
    converged: bool

    @property
    def active(self) -> np.ndarray:
        """(C + c,) constraints that carry force."""
        return self.multipliers > 1e-9


def solve_sqp(
    problem: EquilibriumProblem,
    y: np.ndarray,
    tensions: np.ndarray,
    forces: np.ndarray,
    bounds: Bounds,
) -> KktPoint:
    """Minimise the energy from ``y`` with multiplier guesses; see the module's text.

    Returns:
        The last iterate; `KktPoint.converged` tells whether it is an equilibrium.
    """
    tolerance = problem.settings.tolerance
    at = problem.evaluate(y)
    price = 10.0
    best = np.inf
    point: KktPoint | None = None
    for iteration in range(problem.settings.max_iterations + 1):
        point, values, slacks = _assemble(problem, at, tensions, forces, bounds, iteration)
        if point.residual <= tolerance and point.violation <= tolerance:
            return _marked(point)
        if iteration == problem.settings.max_iterations or not np.isfinite(point.residual):
            break
        step, multipliers = _qp_step(point, slacks)
        if step is None:
            break
        tensions, forces = _scatter(problem, point, multipliers)
        price = max(price, 2.0 * float(multipliers.max(initial=0.0)))
        error = point.residual + point.violation
        # A full step that is small is Newton's own: the merit function only resists it by curvature.
        full = error < best * 0.5 or float(np.abs(step).max()) < 1e-4
        best = min(best, error)
        at = _line_search(problem, point, step, bounds, price, full)
    assert point is not None
    return point


def _marked(point: KktPoint) -> KktPoint:
    object.__setattr__(point, "converged", True)
    return point


def _assemble(
    problem: EquilibriumProblem,
    at: Evaluation,
    tensions: np.ndarray,
    forces: np.ndarray,
    bounds: Bounds,
    iteration: int,
) -> tuple[KktPoint, np.ndarray, np.ndarray]:
    first = problem.linearize(at)
    near = (at.distances < _BAND) | (forces > 0)
    near[:, problem.points.disk == 0] = False  # the base does not move
    pairs = np.argwhere(near)
    values = at.lengths
    limits = bounds.lengths
    multipliers = tensions
    rows = first.lengths
    if len(pairs):
        contact, normals, curvatures = problem.contact_rows(at, first, pairs)
        rows = np.concatenate([rows, contact])
        index = pairs[:, 0], pairs[:, 1]
        values = np.concatenate([values, -at.distances[index]])
        limits = np.concatenate([limits, bounds.penetrations[index]])
        multipliers = np.concatenate([tensions, forces[index]])
    else:
        normals, curvatures = np.empty((0, 3)), np.empty((0, 3, 3))
    slacks = limits - values  # >= 0 where satisfied
    hessian = problem.hessian(
        at, first, tensions, pairs, normals, curvatures, multipliers[len(tensions) :]
    )
    unbalanced = at.y + multipliers @ rows
    residual = float(np.abs(unbalanced).max() / max(1.0, np.abs(at.y).max()))
    gap = np.where(multipliers > 1e-9, np.abs(slacks), np.maximum(-slacks, 0.0))
    violation = float(gap.max(initial=0.0))
    point = KktPoint(
        at, first, tensions, forces, pairs, normals, rows, multipliers, hessian, residual, violation,
        iteration, False,
    )  # fmt: skip
    return point, values, slacks


def _scatter(
    problem: EquilibriumProblem, point: KktPoint, multipliers: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    count = len(point.tensions)
    forces = np.zeros_like(point.forces)
    if len(point.pairs):
        forces[point.pairs[:, 0], point.pairs[:, 1]] = multipliers[count:]
    return multipliers[:count], forces


def _qp_step(point: KktPoint, slacks: np.ndarray) -> tuple[np.ndarray | None, np.ndarray]:
    """The step (N,) and new multipliers, or None where the numbers have run away."""
    active = point.active
    gradient = point.at.y
    hessian, slope = point.hessian, gradient
    if active.any():
        # On the active constraints A d = r the added term |A d - r|^2 vanishes with its gradient:
        # it moves neither the QP's solution nor its multipliers, but makes the matrix definite
        # wherever the reduced Hessian is.
        held = point.rows[active]
        weight = _AUGMENT / np.maximum(np.einsum("ij,ij->i", held, held), 1e-12)
        hessian = hessian + (held.T * weight) @ held
        slope = gradient - held.T @ (weight * slacks[active])
    hessian = definite(hessian)
    if hessian is None:
        return None, point.multipliers
    solved = np.linalg.solve(hessian, np.column_stack([slope, point.rows.T]))
    s = point.rows @ solved[:, 1:]
    r = slacks + point.rows @ solved[:, 0]
    multipliers = solve_multipliers(0.5 * (s + s.T), r, active)
    if multipliers is None:
        return None, point.multipliers
    step = -(solved[:, 0] + solved[:, 1:] @ multipliers)
    if not np.all(np.isfinite(step)):
        return None, point.multipliers
    return step, multipliers


def definite(matrix: np.ndarray) -> np.ndarray | None:
    """Return the matrix, its negative eigenvalues turned positive; None if it is not finite."""
    try:
        np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        if not np.all(np.isfinite(matrix)):
            return None
        values, vectors = np.linalg.eigh(matrix)
        values = np.maximum(np.abs(values), 1e-3)
        return (vectors * values) @ vectors.T
    return matrix


def _merit(at: Evaluation, bounds: Bounds, price: float, moving: np.ndarray) -> float:
    over = np.maximum(at.lengths - bounds.lengths, 0.0).sum()
    inside = np.maximum(-at.distances - bounds.penetrations, 0.0)[:, moving].sum()
    return 0.5 * float(at.y @ at.y) + price * float(over + inside)


def _line_search(
    problem: EquilibriumProblem,
    point: KktPoint,
    step: np.ndarray,
    bounds: Bounds,
    price: float,
    full: bool,
) -> Evaluation:
    moving = problem.points.disk > 0
    length = float(np.abs(step * np.tile(problem.coordinate_scale, problem.arcs)).max())
    size = min(1.0, 0.5 / length) if length > 0 else 1.0  # at most 0.5 rad in one arc
    trial = problem.evaluate(point.at.y + size * step)
    if full and size == 1.0:
        return trial
    start = _merit(point.at, bounds, price, moving)
    for _ in range(12):
        if _merit(trial, bounds, price, moving) <= start - 1e-6 * size * abs(start):
            return trial
        size *= 0.5
        trial = problem.evaluate(point.at.y + size * step)
    return trial
