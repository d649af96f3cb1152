# SPDX-License-Identifier: Apache-2.0
"""Derivatives of a pose with respect to what drives the cables, by the implicit function theorem.

A cable is driven by its pull as long as it is taut; one that is slack answers to a tension only.
With the taut cables' lengths and the contacts as active constraints A y' = b' of the KKT system,

    [H  A'] [dy]   [-A_s' dT_s]
    [A  0 ] [dm] = [    db    ],    db = -dpull / L for a taut cable, 0 for a contact,

where A_s are the gradients of the slack cables' lengths and dT_s >= 0 their new tensions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .equilibrium import EquilibriumProblem
from .sqp import KktPoint


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Derivatives with respect to the pulls of the m cables, active constraints held active.

    Attributes:
        tip: (6, m) of the tip disk in the base frame: position [m/m], then rotation vector [rad/m].
        disks: (n+1, 3, m) of the disk centres [m/m].
        turns: (n+1, 3, m) of the disks' rotation vectors in the base frame [rad/m].
        tensions: (m, m) of the tensions [N/m, or per EI].
        contacts: (k, m) of the contacts' forces, in the order of `Solution.contacts` [N/m, or per
            EI].
    """

    tip: np.ndarray
    disks: np.ndarray
    turns: np.ndarray
    tensions: np.ndarray
    contacts: np.ndarray


@dataclass(frozen=True, eq=False)
class Response:
    """How a pose answers to its m cables, in the solver's units (L, and EI / L^2).

    Column c is per unit of pull of cable c where that is taut, else per unit of its tension.

    Attributes:
        y: (N, m) of the scaled coordinates.
        tensions: (C, m) of the tensions; one for each cable, or for each span.
        forces: (k, m) of the forces on the active pairs of obstacle and point.
        pairs: (k,) indices of these in ``KktPoint.pairs``.
    """

    y: np.ndarray
    tensions: np.ndarray
    forces: np.ndarray
    pairs: np.ndarray


def response(problem: EquilibriumProblem, point: KktPoint, taut: np.ndarray) -> Response:
    """Return the response at a converged point.

    Args:
        taut: (m,) bool, the cables that are driven by their pull; in the frictionless cable model
            the others by a tension, else not at all.
    """
    count, groups, n = len(problem.finger.cables), len(point.tensions), problem.size
    zero = problem.length_bounds(np.zeros(count))
    # The bounds are linear in the pulls: their derivative, per L.
    pulled = np.diag(taut * problem.finger.length)
    bound = np.column_stack([problem.length_bounds(unit) - zero for unit in pulled])
    active = np.flatnonzero(point.active)
    lengths = active < groups
    right = np.zeros((n + len(active), count))
    right[n:][lengths] = bound[active[lengths]]
    slack = np.flatnonzero(~taut) if groups == count else np.zeros(0, dtype=int)
    right[:n, slack] = -point.rows[slack].T
    solved = _solved(point, active, right)
    tensions = np.zeros((groups, count))
    tensions[active[lengths]] = solved[n:][lengths]
    tensions[slack, slack] += 1.0
    return Response(solved[:n], tensions, solved[n:][~lengths], active[~lengths] - groups)


def torsion_response(problem: EquilibriumProblem, point: KktPoint) -> tuple[np.ndarray, np.ndarray]:
    """Return how a converged pose answers to Poisson's ratio, pulls held, active set held.

    The twist coordinates' part of the energy 1/2 y.y goes with GJ = EI / (1 + nu), so that
    H dy + A' dm = y / (1 + nu) dnu in these coordinates.

    Returns:
        (n+1, 3) of the disk centres [m], and (m,) of the tensions [N, or per EI], per unit of nu.
    """
    finger, n = problem.finger, problem.size
    active = np.flatnonzero(point.active)
    right = np.zeros((n + len(active), 1))
    right[2:n:3, 0] = point.at.y[2::3] * finger.torsion_ratio
    solved = _solved(point, active, right)[:, 0]
    disks = (point.first.points[problem.points.backbone] @ solved[:n]) * finger.length
    tensions = np.zeros(len(point.tensions))
    lengths = active < len(tensions)
    tensions[active[lengths]] = solved[n:][lengths]
    unit = finger.bending_stiffness / finger.length**2
    return disks, tensions[problem.base_group] * unit


def _solved(point: KktPoint, active: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solve the KKT system of the active constraints for right-hand sides (N + k, .)."""
    rows, n, k = point.rows[active], len(point.hessian), len(active)
    system = np.zeros((n + k, n + k))
    system[:n, :n], system[:n, n:], system[n:, :n] = point.hessian, rows.T, rows
    try:
        return np.linalg.solve(system, right)
    except np.linalg.LinAlgError:  # twin constraints: the least-norm multipliers
        return np.linalg.lstsq(system, right, rcond=None)[0]


def turns(problem: EquilibriumProblem, point: KktPoint, dy: np.ndarray) -> np.ndarray:
    """Return the disks' rotation vectors (n+1, 3, m) for changes dy (N, m) of the coordinates."""
    per_arc = point.first.twists[:, :3, None] * dy[:, None, :]
    per_arc = per_arc.reshape(problem.finger.segments, -1, 3, dy.shape[1]).sum(axis=1)
    return np.concatenate([np.zeros((1, 3, dy.shape[1])), np.cumsum(per_arc, axis=0)])


def sensitivity(problem: EquilibriumProblem, point: KktPoint) -> Sensitivity:
    """Return the derivatives at a converged point."""
    finger = problem.finger
    count = len(finger.cables)
    taut = np.zeros(count, dtype=bool)
    taut[problem.group_cable[point.active[: len(point.tensions)]]] = True
    answer = response(problem, point, taut)
    dy = np.where(taut, answer.y, 0.0) / finger.length
    disks = (point.first.points[problem.points.backbone] @ dy) * finger.length
    turn = turns(problem, point, dy)
    unit = finger.bending_stiffness / finger.length**3
    order = contact_order(problem, point, answer.pairs)
    return Sensitivity(
        tip=np.concatenate([disks[-1], turn[-1]]),
        disks=disks,
        turns=turn,
        tensions=np.where(taut, answer.tensions, 0.0)[problem.base_group] * unit,
        contacts=np.where(taut, answer.forces, 0.0)[order] * unit,
    )


def contact_order(problem: EquilibriumProblem, point: KktPoint, pairs: np.ndarray) -> list[int]:
    """Return the places, among active ``pairs``, of the contacts in the order of a `Solution`."""

    def key(i: int) -> tuple[int, str, str]:
        obstacle, index = point.pairs[pairs[i]]
        label = problem.points.labels[index]
        return label.disk, problem.obstacles[obstacle].name, label.point

    return sorted(range(len(pairs)), key=key)
