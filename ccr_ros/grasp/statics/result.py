# SPDX-License-Identifier: Apache-2.0
"""What a solve of fingers and object gives: poses, contacts, balance and stability of the whole."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ccr_ros.model.errors import NotConverged
from ccr_ros.model.result import make_solution, row_space
from ccr_ros.model.solution import Solution
from ccr_ros.model.sqp import KktPoint

from .assembly import GraspPoint, Hand
from .body import Body

_STABLE = 1e-6
_AXES = "xyz"


@dataclass
class Way:
    """How far a solve came.

    Attributes:
        point: Where it stands; pulls: per finger [m], there.
        reached: None once the target is reached; else the share of the way that was, in [0, 1).
        iterations: Newton steps; substeps: continuation steps accepted.
    """

    point: GraspPoint
    pulls: list[np.ndarray]
    reached: float | None = None
    iterations: int = 0
    substeps: int = 0


@dataclass
class _FingerWay:
    """The same of one finger, as `make_solution` wants it."""

    point: KktPoint
    pulls: np.ndarray
    reached: float | None
    iterations: int
    substeps: int
    jumped: bool = False
    met: tuple[int, int] | None = None
    late: bool = False


@dataclass(frozen=True, eq=False)
class ObjectContact:
    """One place where a finger presses on the object, in the gripper's frame.

    Attributes:
        finger: Its name.
        disk, point, cable: Which point of it; see `ccr_ros.model.Contact`.
        position: (3,) [m].
        normal: (3,) out of the object.
        force: [N] normal, on the finger along ``normal``; the object feels the opposite.
    """

    finger: str
    disk: int
    point: str
    cable: str
    position: np.ndarray
    normal: np.ndarray
    force: float


@dataclass(frozen=True, eq=False)
class GraspSolution:
    """Fingers and object in equilibrium.

    Attributes:
        fingers: One per finger, each in its base frame, the object among its obstacles.
        body: The object, at its pose in the gripper's frame.
        supported: Whether something beside the fingers carries the object.
        contacts: Where fingers press on the object.
        net_force: (3,) [N] of weight, loads and contacts on the object; zero unless supported.
        net_moment: (3,) [N m] of these about its centre.
        converged: All residuals are within tolerance, and the wanted pulls and loads are reached.
        stable: The energy has a strict minimum here, but for motions that leave the object's
            surface as it is (a ball may turn).
        smallest_eigenvalue: Of the Hessian reduced to what the constraints leave free, relative
            to a free finger's stiffness; lengths in units of the first finger's.
        softest: What moves most easily, in words.
        residual: Largest unbalanced generalised force, relative to the largest elastic one.
        iterations, substeps: Newton and continuation steps.
        solve_time: Wall-clock [s].
        message: What is wrong, and what to do; empty if nothing is.
    """

    fingers: tuple[Solution, ...]
    body: Body
    supported: bool
    contacts: tuple[ObjectContact, ...]
    net_force: np.ndarray
    net_moment: np.ndarray
    converged: bool
    stable: bool
    smallest_eigenvalue: float
    softest: str
    residual: float
    iterations: int
    substeps: int
    solve_time: float
    message: str = field(default="")

    def require_converged(self) -> GraspSolution:
        """Return self.

        Raises:
            NotConverged: It has not.
        """
        if not self.converged:
            raise NotConverged("grasp", self.message)
        return self


def make_grasp_solution(
    hand: Hand,
    body: Body,
    way: Way,
    target: list[np.ndarray],
    supported: bool,
    elapsed: float,
) -> GraspSolution:
    """Assemble the solution that a solve has ended at."""
    at = way.point
    fingers = tuple(
        make_solution(
            problem,
            wanted,
            _FingerWay(part.point, pulls, way.reached, way.iterations, way.substeps),
            elapsed=lambda: elapsed,
        )
        for problem, part, pulls, wanted in zip(
            hand.problems, at.blocks, way.pulls, target, strict=True
        )
    )
    eigenvalue, direction = softest_direction(hand, at, body, supported)
    unit = np.array([hand.energy / hand.length] * 3 + [hand.energy] * 3)
    net = -at.unbalanced * unit
    stable = eigenvalue > _STABLE
    softest = "" if not len(direction) else _in_words(hand, at, direction, supported)
    return GraspSolution(
        fingers=fingers,
        body=body,
        supported=supported,
        contacts=_contacts(hand, body, fingers),
        net_force=net[:3],
        net_moment=net[3:],
        converged=way.reached is None,
        stable=stable,
        smallest_eigenvalue=eigenvalue,
        softest=softest,
        residual=at.residual,
        iterations=way.iterations,
        substeps=way.substeps,
        solve_time=elapsed,
        message=_message(way, stable, softest),
    )


def softest_direction(
    hand: Hand, at: GraspPoint, body: Body, supported: bool
) -> tuple[float, np.ndarray]:
    """Return the smallest eigenvalue of the reduced Hessian and its vector (fingers, then q)."""
    sizes = [problem.size for problem in hand.problems]
    total = sum(sizes) + 6
    matrix, rows = np.zeros((total, total)), []
    first = 0
    for weight, part, size in zip(hand.weights, at.blocks, sizes, strict=True):
        own = slice(first, first + size)
        matrix[own, own] = weight * part.point.hessian
        matrix[own, -6:] = weight * part.border
        matrix[-6:, own] = matrix[own, -6:].T
        matrix[-6:, -6:] += weight * part.corner
        active = part.point.active
        full = np.zeros((int(active.sum()), total))
        full[:, own], full[:, -6:] = part.point.rows[active], part.columns[active]
        rows.append(full)
        first += size
    # Neither what the support holds nor what changes nothing is a direction to fall in.
    if supported:
        held = np.eye(6)
    else:
        turn = at.pose.rotation
        both = np.zeros((6, 6))
        both[:3, :3], both[3:, 3:] = turn, turn
        held = (both @ body.free_directions()).T
    idle = np.zeros((len(held), total))
    idle[:, -6:] = held
    basis = row_space(np.concatenate([*rows, idle])) if len(held) or any(map(len, rows)) else None
    if basis is None or basis.shape[1] == 0:
        values, vectors = np.linalg.eigh(matrix)
        return float(values[0]), vectors[:, 0]
    null = np.linalg.qr(basis, mode="complete")[0][:, basis.shape[1] :]
    values, vectors = np.linalg.eigh(null.T @ matrix @ null)
    return float(values[0]), null @ vectors[:, 0]


def _in_words(hand: Hand, at: GraspPoint, direction: np.ndarray, supported: bool) -> str:
    """Say who moves most along a direction, and how."""
    first, shares = 0, []
    for problem, part, mounted in zip(hand.problems, at.blocks, hand.mounted, strict=True):
        own = direction[first : first + problem.size]
        tip = part.point.first.points[problem.points.backbone[-1]] @ own
        shares.append((float(np.linalg.norm(tip)), f"the tip of {mounted.finger.name} moves"))
        first += problem.size
    if not supported:
        shift, turn = direction[-6:-3], direction[-3:]
        for way, word in ((shift, "moves along"), (turn, "turns about")):
            axis = int(np.argmax(np.abs(way)))
            shares.append((float(np.linalg.norm(way)), f"the object {word} {_AXES[axis]}"))
    return max(shares)[1]


def _contacts(hand: Hand, body: Body, fingers: tuple[Solution, ...]) -> tuple[ObjectContact, ...]:
    return tuple(
        ObjectContact(
            finger=mounted.finger.name,
            disk=contact.disk,
            point=contact.point,
            cable=contact.cable,
            position=mounted.base.points(contact.position),
            normal=mounted.base.vectors(contact.normal),
            force=contact.force,
        )
        for mounted, solution in zip(hand.mounted, fingers, strict=True)
        for contact in solution.contacts
        if contact.obstacle == body.name
    )


def _message(way: Way, stable: bool, softest: str) -> str:
    if way.reached is not None:
        return (
            f"no equilibrium of fingers and object was found beyond {way.reached:.1%} of the way"
            " to the wanted pulls and loads: the fingers cannot hold the object there"
        )
    if not stable:
        return f"the grasp is not stable: {softest} at the slightest disturbance"
    return ""
