# SPDX-License-Identifier: Apache-2.0
"""From a KKT point to a Solution: units, names, contacts and the certificate."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from .equilibrium import EquilibriumProblem
from .solution import Certificate, Contact, Solution
from .sqp import ACTIVE, KktPoint

_STABLE = 1e-6  # a reduced Hessian with an eigenvalue below this is at a branch point, or past it


class Walk(Protocol):
    """What the solution needs to know of the continuation; see `solver`."""

    point: KktPoint
    pulls: np.ndarray
    reached: float | None
    iterations: int
    substeps: int
    jumped: bool
    met: tuple[int, int] | None
    late: bool


def softest_direction(point: KktPoint) -> tuple[float, np.ndarray]:
    """Return the smallest eigenvalue, and its vector (N,), of the reduced Hessian.

    Reduced to the null space of the active constraints, in the scaled coordinates in which the
    elastic energy is 1/2 y.y: relative to the free rod's own stiffness.
    """
    null = _null_space(point)
    values, vectors = np.linalg.eigh(null.T @ point.hessian @ null)
    return float(values[0]), null @ vectors[:, 0]


def smallest_eigenvalue(point: KktPoint) -> float:
    """Smallest eigenvalue of the reduced Hessian, without the null space's basis.

    Projected with P = 1 - Q Q', Q an orthonormal basis of the active gradients, and with Q's own
    space raised out of the way, the Hessian has the reduced one's eigenvalues as its smallest.
    """
    rows, hessian = point.rows[point.active], point.hessian
    if len(rows):
        q = row_space(rows)
        half = hessian @ q
        raised = q.T @ half + np.eye(q.shape[1]) * (1.0 + float(np.abs(hessian).sum(axis=1).max()))
        hessian = hessian - half @ q.T - q @ half.T + q @ raised @ q.T
    return float(np.linalg.eigvalsh(hessian)[0])


def row_space(rows: np.ndarray) -> np.ndarray:
    """Orthonormal basis (N, rank) of the span of rows; twin constraints are not counted twice."""
    if len(rows) == 1:  # as mostly; a decomposition costs more than all the rest
        return rows.T / np.linalg.norm(rows)
    _, size, basis = np.linalg.svd(rows, full_matrices=False)
    return basis[size > 1e-9 * size[0]].T


def _null_space(point: KktPoint) -> np.ndarray:
    rows = point.rows[point.active]
    if not len(rows):
        return np.eye(len(point.hessian))
    basis = row_space(rows)
    return np.linalg.qr(basis, mode="complete")[0][:, basis.shape[1] :]


def make_solution(
    problem: EquilibriumProblem,
    pulls: np.ndarray,
    walk: Walk,
    elapsed: Callable[[], float],
    verdict: tuple[bool, float] | None = None,
    names: Sequence[str] | None = None,
) -> Solution:
    """Assemble the solution that a walk towards ``pulls`` (m,) has ended at.

    ``verdict``: whether it is stable, and the smallest eigenvalue, where that is not the finger's
    own affair; ``names``: of the obstacles, where they are not the problem's.
    """
    point = walk.point
    finger, at, length = problem.finger, point.at, problem.finger.length
    force_unit = finger.bending_stiffness / length**2
    disks = np.arange(finger.segments + 1) * problem.arcs_per_segment
    if verdict is None:
        eigenvalue = smallest_eigenvalue(point)
        verdict = eigenvalue > _STABLE, eigenvalue
    stable, eigenvalue = verdict
    z = at.z / problem.rod_step
    arcs = (finger.segments, problem.arcs_per_segment, problem.rod.order + 1, 3)
    metres = at.points * length
    cables = finger.cable_names
    cable_error, penetration = _errors(problem, point, walk.pulls)
    converged = walk.reached is None
    certificate = Certificate(
        converged=converged,
        stable=stable,
        kkt=point.residual,
        cable_error=cable_error,
        penetration=penetration,
        smallest_eigenvalue=eigenvalue,
        iterations=walk.iterations,
        solve_time=elapsed(),
        branch_jump=walk.jumped,
        substeps=walk.substeps,
        message=_message(problem, walk, stable),
    )
    return Solution(
        finger=finger,
        pulls=pulls,
        backbone=metres[problem.points.backbone],
        frames=at.rod.rotations[disks],
        cables={n: metres[i] for n, i in zip(cables, problem.points.cable, strict=True)},
        antagonists={n: metres[i] for n, i in zip(cables, problem.points.antagonist, strict=True)},
        tensions=_carried(point.tensions)[problem.base_group] * force_unit,
        contacts=_contacts(
            problem, point, force_unit, names or [o.name for o in problem.obstacles]
        ),
        energy=0.5 * float(at.y @ at.y) * finger.bending_stiffness / length,
        curvature=z.reshape(arcs) / length,
        certificate=certificate,
    )


def _carried(tensions: np.ndarray) -> np.ndarray:
    return np.where(tensions > ACTIVE, tensions, 0.0)


def _errors(problem: EquilibriumProblem, point: KktPoint, pulls: np.ndarray) -> tuple[float, float]:
    over = point.at.lengths - problem.length_bounds(pulls)
    error = np.where(point.tensions > 0, np.abs(over), np.maximum(over, 0.0))
    inside = -point.at.distances[:, ~problem.fixed]
    length = problem.finger.length
    return float(error.max()) * length, max(0.0, float(inside.max(initial=0.0))) * length


def _contacts(
    problem: EquilibriumProblem, point: KktPoint, unit: float, names: Sequence[str]
) -> tuple[Contact, ...]:
    count = len(point.tensions)
    contacts = []
    for k in np.flatnonzero(point.active[count:]):
        obstacle, index = point.pairs[k]
        label = problem.points.labels[index]
        contacts.append(
            Contact(
                disk=label.disk,
                point=label.point,
                cable=label.cable,
                obstacle=names[obstacle],
                position=point.at.points[index] * problem.finger.length,
                normal=point.normals[k],
                force=float(point.multipliers[count + k]) * unit,
            )
        )
    return tuple(sorted(contacts, key=lambda c: (c.disk, c.obstacle, c.point)))


def meeting_disks(problem: EquilibriumProblem, point: KktPoint) -> tuple[int, int] | None:
    """The first two neighbouring disks that cut each other, or None; disks are taken as thin."""
    centres = point.at.points[problem.points.backbone]
    step = problem.arcs_per_segment
    axes = point.at.rod.rotations[::step, :, 2]
    overlap = disk_overlap(centres, axes, problem.finger.disk_radius / problem.finger.length)
    cut = np.flatnonzero(overlap > 0)
    return (int(cut[0]), int(cut[0]) + 1) if len(cut) else None


def disk_overlap(centres: np.ndarray, axes: np.ndarray, radius: float) -> np.ndarray:
    """How far (n,) neighbouring disks reach into each other; negative: the gap between them.

    Disks are taken as thin; centres (n+1, 3) and radius in one unit, which is the result's.
    """
    between = centres[1:] - centres[:-1]
    cosine = np.einsum("ij,ij->i", axes[1:], axes[:-1])
    # How far the rim of either disk dips below the other's centre plane.
    dip = radius * np.sqrt(np.maximum(1 - cosine**2, 0))
    lift = np.minimum(
        np.einsum("ij,ij->i", between, axes[:-1]), np.einsum("ij,ij->i", between, axes[1:])
    )
    return dip - lift


def _message(problem: EquilibriumProblem, walk: Walk, stable: bool) -> str:
    if walk.reached is not None:
        names = problem.finger.cable_names
        where = ", ".join(f"{n}={p:.6g} m" for n, p in zip(names, walk.pulls, strict=True))
        if walk.met is not None:
            why = f"disks {walk.met[0]} and {walk.met[1]} meet beyond"
        elif walk.late:
            limit = f"{problem.settings.time_limit:g} s"
            why = f"the time limit of {limit} (of the CPU) ended the search at"
        else:
            why = "no equilibrium was found beyond"
        return (
            f"{why} {walk.reached:.1%} of the way to the wanted pulls; the last good pose on it is"
            f" at {where}. Pull less, or give the obstacles more room."
        )
    notes = []
    if walk.jumped:
        notes.append("the finger snapped to another branch of equilibria on the way")
    if not stable:
        notes.append(
            "the pose is not a strict minimum of the energy (a saddle or branch point):"
            " a disturbance moves it"
        )
    return "; ".join(notes)
