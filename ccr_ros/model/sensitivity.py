# SPDX-License-Identifier: Apache-2.0
"""Derivatives of a pose with respect to cable pulls, by the implicit function theorem.

With the active constraints A y' = b' of the KKT system,

    [H  A'] [dy]   [ 0]
    [A  0 ] [dm] = [db],      db = -dpull / L for a taut cable, 0 for a contact.
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
        tensions: (m, m) of the tensions [N/m, or per EI].
    """

    tip: np.ndarray
    disks: np.ndarray
    tensions: np.ndarray


def sensitivity(problem: EquilibriumProblem, point: KktPoint) -> Sensitivity:
    """Return the derivatives at a converged point."""
    finger = problem.finger
    count = len(finger.cables)
    zero = problem.length_bounds(np.zeros(count))
    # The bounds are linear in the pulls: their derivative, per metre.
    bound = np.column_stack([problem.length_bounds(unit) - zero for unit in np.eye(count)])
    active = np.flatnonzero(point.active)
    groups = len(point.tensions)
    rows, n, k = point.rows[active], problem.size, len(active)
    system = np.zeros((n + k, n + k))
    system[:n, :n], system[:n, n:], system[n:, :n] = point.hessian, rows.T, rows
    right = np.zeros((n + k, count))
    taut = active < groups
    right[n:][taut] = bound[active[taut]]
    try:
        solved = np.linalg.solve(system, right)
    except np.linalg.LinAlgError:  # twin constraints: the least-norm multipliers
        solved = np.linalg.lstsq(system, right, rcond=None)[0]
    dy = solved[:n]
    disks = (point.first.points[problem.points.backbone] @ dy) * finger.length
    turn = point.first.twists[:, :3].T @ dy
    tensions = np.zeros((groups, count))
    tensions[active[taut]] = solved[n:][taut]
    return Sensitivity(
        tip=np.concatenate([disks[-1], turn]),
        disks=disks,
        tensions=tensions[problem.base_group] * finger.bending_stiffness / finger.length**2,
    )
