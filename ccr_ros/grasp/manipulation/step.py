# SPDX-License-Identifier: Apache-2.0
"""One small step of a held object: the change of pulls that moves it best, all contacts kept.

With J the object's motion per pull, N_k, f_k the contacts' forces and their derivatives
(`ccr_ros.grasp.statics.sensitivity`), the step dp solves

    min   |w (J dp - wanted)|^2 + share |N_k' dp|^2 + little |dp|^2
    s.t.  d_i . (f_k + f_k' dp) <= (1 - margin) mu (N_k + N_k' dp) cos(pi / sides)     (cones)
          least <= N_k + N_k' dp <= largest,   tensions + their change >= least
          pulls within limits,   |dp| <= step

where d_i are the sides' directions of a pyramid within the cone. What is beyond a limit already may
stay, and not get worse.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from ccr_ros.grasp.statics import GraspSolution
from ccr_ros.grasp.statics.friction import tangents_of
from ccr_ros.grasp.statics.sensitivity import GraspSensitivity

_SIDES = 16
_LITTLE = 1e-3  # weight of dp / step
_TOUCHED = 1e-6  # of a limit's worth; a constraint as near to its bound as that limits the step


@dataclass(frozen=True)
class Rows:
    """Linear constraints rows dp <= room, each with its name and the worth of its unit."""

    rows: np.ndarray
    room: np.ndarray
    names: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class StepLimits:
    """What a step must keep; see `MoveLimits`, in the solver's order of cables."""

    margin: float
    least_force: float
    largest_force: float
    least_tension: float
    low: np.ndarray
    high: np.ndarray
    step: float


def constraint_rows(
    solution: GraspSolution,
    sensitivity: GraspSensitivity,
    pulls: np.ndarray,
    limits: StepLimits,
) -> Rows:
    """Return all constraints on a step from a solution.

    Args:
        solution: Where the step begins.
        sensitivity: There.
        pulls: (M,) [m] there, in the order of ``sensitivity.cables``.
        limits: To be kept.
    """
    rows: list[np.ndarray] = []
    room: list[float] = []
    names: list[str] = []

    def add(row: np.ndarray, spare: float, name: str) -> None:
        rows.append(row)
        room.append(max(spare, 0.0))
        names.append(name)

    friction = solution.body.friction
    angles = 2 * np.pi * np.arange(_SIDES) / _SIDES
    for k, contact in enumerate(solution.contacts):
        of = f"disk {contact.disk} of {contact.finger}"
        slope = sensitivity.normal[k]
        if contact.status != "frictionless" and friction > 0:
            cone = (1.0 - limits.margin) * friction * np.cos(np.pi / _SIDES)
            first, second = tangents_of(contact.normal[None])[0]
            for angle in angles:
                side = np.cos(angle) * first + np.sin(angle) * second
                spare = cone * contact.force - float(side @ contact.friction_force)
                add(side @ sensitivity.along[k] - cone * slope, spare,
                    f"friction at {of}: it would slip")  # fmt: skip
        add(-slope, contact.force - limits.least_force, f"grip force at {of}: it would let go")
        add(slope, limits.largest_force - contact.force, f"grip force at {of}: at its largest")
    tensions = np.concatenate([finger.tensions for finger in solution.fingers])
    for j, cable in enumerate(sensitivity.cables):
        add(-sensitivity.tensions[j], tensions[j] - limits.least_tension,
            f"tension of {cable}: it would go slack")  # fmt: skip
        unit = np.eye(len(pulls))[j]
        add(unit, limits.high[j] - pulls[j], f"pull of {cable}: at its upper limit")
        add(-unit, pulls[j] - limits.low[j], f"pull of {cable}: at its lower limit")
    return Rows(np.array(rows), np.array(room), tuple(names))


@dataclass(frozen=True, eq=False)
class MoveStep:
    """A step.

    Attributes:
        change: (M,) of the pulls [m].
        motion: (6,) of the object that it gives, to first order.
        limiting: Names of the constraints that it ends at, the most costly first.
    """

    change: np.ndarray
    motion: np.ndarray
    limiting: tuple[str, ...]


def best_step(
    wanted: np.ndarray,
    weights: np.ndarray,
    force_weight: float,
    sensitivity: GraspSensitivity,
    constraints: Rows,
    step: float,
) -> MoveStep:
    """Return the step that comes nearest to a wanted motion.

    Args:
        wanted: (6,) translation [m] and rotation vector [rad] of the object.
        weights: (r, 6) rows whose products with the error are squared and added.
        force_weight: Weight of a change of contact forces [1/N].
        sensitivity: Derivatives where the step begins.
        constraints: See `constraint_rows`.
        step: Largest change of a pull [m].
    """
    count = len(sensitivity.cables)
    aims = weights @ sensitivity.motion * step  # per share of the largest step
    forces = force_weight * sensitivity.normal * step
    hessian = aims.T @ aims + forces.T @ forces + _LITTLE**2 * np.eye(count)
    slope = -aims.T @ (weights @ wanted)
    rows = constraints.rows * step
    worth = np.maximum(np.linalg.norm(rows, axis=1), 1e-12)
    rows, room = rows / worth[:, None], constraints.room / worth
    kept = room < np.sqrt(count)  # what no step of this size can reach need not be looked at
    rows, room = rows[kept], room[kept]
    names = [n for n, k in zip(constraints.names, kept, strict=True) if k]
    scale = max(float(np.abs(hessian).max()), 1e-12)
    found, costs = _quadratic(hessian / scale, slope / scale, rows, room)
    order = np.argsort(-costs)
    limiting: list[str] = []
    for i in order:
        if costs[i] > _TOUCHED and names[i] not in limiting:
            limiting.append(names[i])
    change = found * step
    return MoveStep(change, sensitivity.motion @ change, tuple(limiting))


@lru_cache(maxsize=32)
def _solver(count: int, rows: int) -> ca.Function:
    shape = {"h": ca.Sparsity.dense(count, count), "a": ca.Sparsity.dense(rows, count)}
    return ca.conic(f"move_{count}_{rows}", "daqp", shape, {"error_on_fail": False})


def _quadratic(
    hessian: np.ndarray, slope: np.ndarray, rows: np.ndarray, room: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Minimise within -1 <= x <= 1 and rows x <= room; also the rows' multipliers."""
    count, size = len(slope), max(4, 1 << (max(len(rows), 1) - 1).bit_length())
    padded, upper = np.zeros((size, count)), np.full(size, np.inf)
    padded[: len(rows)], upper[: len(rows)] = rows, room
    solver = _solver(count, size)
    result = solver(h=hessian, g=slope, a=padded, lba=-np.inf, uba=upper, lbx=-1.0, ubx=1.0)
    if not solver.stats()["success"]:
        return np.zeros(count), np.zeros(len(rows))
    return np.asarray(result["x"]).ravel(), np.asarray(result["lam_a"]).ravel()[: len(rows)]


def stacked(pulls: Sequence[np.ndarray]) -> np.ndarray:
    """Return pulls per finger as one array (M,)."""
    return np.concatenate(list(pulls))
