# SPDX-License-Identifier: Apache-2.0
"""What a solve of fingers and object gives: poses, contacts, balance and stability of the whole."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ccr_ros.model.errors import NotConverged
from ccr_ros.model.result import make_solution
from ccr_ros.model.solution import Solution
from ccr_ros.model.sqp import ACTIVE, KktPoint

from .assembly import FingerBlock, Hand
from .body import Body
from .disks import DiskRoom, NearDisks, pair_in_words
from .path import Way
from .stability import STABLE, Stability


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
        friction_force: (3,) [N] along the surface, on the finger.
        status: ``"stick"``, ``"slip"`` or ``"frictionless"``: without friction, or only just
            touching.
        margin: 1 - |friction_force| / (friction * force): 0 where it slips, nan without friction.
        slid: (3,) [m] way of the finger on the object in this solve.
    """

    finger: str
    disk: int
    point: str
    cable: str
    position: np.ndarray
    normal: np.ndarray
    force: float
    friction_force: np.ndarray
    status: str
    margin: float
    slid: np.ndarray


@dataclass(frozen=True, eq=False)
class DiskContact:
    """Two disks that press on each other, without friction, in the gripper's frame.

    Attributes:
        fingers: Names of the fingers they belong to; the same twice for a finger and itself.
        disks: Their numbers, 0 at the base.
        position: (3,) [m].
        normal: (3,) from the first disk to the second.
        force: [N] on the second disk along ``normal``; the first feels the opposite.
    """

    fingers: tuple[str, str]
    disks: tuple[int, int]
    position: np.ndarray
    normal: np.ndarray
    force: float

    def in_words(self) -> str:
        """Say it for people."""
        return f"{pair_in_words(self.fingers, self.disks)} press on each other"


@dataclass(frozen=True, eq=False)
class GraspSolution:
    """Fingers and object in equilibrium; what takes long is put together when it is asked for.

    Attributes:
        hand: The fingers as they are solved.
        way: Where they stand.
        target: Per finger, the pulls that were wanted [m].
        body: The object, at its pose in the gripper's frame.
        supported: Whether something beside the fingers carries the object.
        net_force: (3,) [N] of weight, loads and contacts on the object; zero unless supported.
        net_moment: (3,) [N m] of these about its centre.
        converged: All residuals are within tolerance, and the wanted pulls and loads are reached.
        stable: The energy has a strict minimum here, but for motions that leave the object's
            surface as it is (a ball may turn).
        stability: How much so; found out when it is asked for.
        residual: Largest unbalanced generalised force, relative to the largest elastic one.
        iterations, substeps: Newton and continuation steps.
        solve_time: Wall-clock [s].
        dissipated: Energy that friction gave off in this solve [J]; without what a snap gives off.
        snapped: (3,) [m] ways that the object went by itself in this solve, to another equilibrium
            where its own had ended; zero: it followed pulls and loads.
        message: What is wrong, and what to do; empty if nothing is.
        disk_contacts: Where disks press on each other; empty if that is not looked after (see
            `GraspSolver`).
    """

    hand: Hand
    way: Way
    target: list[np.ndarray]
    body: Body
    supported: bool
    net_force: np.ndarray
    net_moment: np.ndarray
    converged: bool
    stable: bool
    stability: Stability
    residual: float
    iterations: int
    substeps: int
    solve_time: float
    dissipated: float = 0.0
    snapped: np.ndarray = field(default_factory=lambda: np.zeros(3))
    message: str = field(default="")
    disk_contacts: tuple[DiskContact, ...] = ()

    @cached_property
    def fingers(self) -> tuple[Solution, ...]:
        """One per finger, each in its base frame, the object among its obstacles.

        That a certificate is stable says so of the whole; its eigenvalue is nan.
        """
        way = self.way
        return tuple(
            make_solution(
                problem,
                wanted,
                _FingerWay(_own_point(part), pulls, way.reached, way.iterations, way.substeps),
                elapsed=lambda: self.solve_time,
                verdict=(self.stable, math.nan),
                names=[*(obstacle.name for obstacle in problem.finger.obstacles), self.body.name],
            )
            for problem, part, pulls, wanted in zip(
                self.hand.problems, way.point.blocks, way.pulls, self.target, strict=True
            )
        )

    @cached_property
    def contacts(self) -> tuple[ObjectContact, ...]:
        """Where fingers press on the object."""
        return _contacts(self.hand, self.body, self.way)

    @property
    def smallest_eigenvalue(self) -> float:
        """Of the Hessian reduced to what the constraints leave free.

        Relative to a free finger's stiffness; lengths in units of the fingers' mean. Takes as long
        as a solve; whether it is above some value `Stability.exceeds` tells at once.
        """
        return self.stability.smallest_eigenvalue

    @property
    def softest(self) -> str:
        """What moves most easily, in words; takes as long as `smallest_eigenvalue`."""
        return self.stability.softest

    @property
    def margin(self) -> float:
        """Smallest margin of the contacts; nan where none has friction."""
        margins = [c.margin for c in self.contacts if not math.isnan(c.margin)]
        return min(margins, default=math.nan)

    @property
    def energy(self) -> float:
        """Elastic energy of all fingers [J]."""
        return sum(finger.energy for finger in self.fingers)

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
    room: DiskRoom | None = None,
) -> GraspSolution:
    """Assemble the solution that a solve has ended at."""
    at = way.point
    stability = Stability(hand, at, body, supported)
    stable = stability.exceeds(STABLE)
    unit = np.array([hand.energy / hand.length] * 3 + [hand.energy] * 3)
    net = -at.unbalanced * unit
    return GraspSolution(
        hand=hand,
        way=way,
        target=target,
        body=body,
        supported=supported,
        net_force=net[:3],
        net_moment=net[3:],
        converged=way.reached is None,
        stable=stable,
        stability=stability,
        residual=at.residual,
        iterations=way.iterations,
        substeps=way.substeps,
        solve_time=elapsed,
        dissipated=way.heat,
        snapped=way.snapped,
        message=_message(way, "" if stable else stability.softest, room),
        disk_contacts=_disk_contacts(hand, at.near_disks, room),
    )


def _own_point(part: FingerBlock) -> KktPoint:
    """A finger's point with the residual that it has under friction."""
    worst = float(np.abs(part.unbalanced).max())
    return replace(part.point, residual=worst / max(1.0, float(np.abs(part.point.at.y).max())))


def _contacts(hand: Hand, body: Body, way: Way) -> tuple[ObjectContact, ...]:
    found = []
    for index, (part, mounted) in enumerate(zip(way.point.blocks, hand.mounted, strict=True)):
        problem, point, friction = hand.problems[index], part.point, part.friction
        length = problem.finger.length
        unit = problem.finger.bending_stiffness / length**2
        turn = part.turn
        rubbing = {int(row): k for k, row in enumerate(friction.index)}
        for row in part.touch[point.multipliers[part.touch] > ACTIVE]:
            where = int(point.pairs[row - len(point.tensions), 1])
            label = problem.points.labels[where]
            along, status, margin = np.zeros(3), "frictionless", math.nan
            if body.friction > 0:
                status, margin = "stick", 1.0  # one that only just touches has no friction yet
            k = rubbing.get(int(row))
            if k is not None:
                along = friction.forces[k] @ friction.tangents[k]
                size = float(np.linalg.norm(along))
                margin = max(0.0, 1.0 - size / float(friction.limits[k]))
                status = "slip" if part.hold.slipping[where] else "stick"
            slid = way.slid[index][where] if way.slid else np.zeros(3)
            found.append(
                ObjectContact(
                    finger=mounted.finger.name,
                    disk=label.disk,
                    point=label.point,
                    cable=label.cable,
                    position=mounted.base.points(point.at.points[where] * length),
                    normal=mounted.base.vectors(point.normals[row - len(point.tensions)]),
                    force=float(point.multipliers[row]) * unit,
                    friction_force=mounted.base.vectors(along * unit),
                    status=status,
                    margin=margin,
                    slid=mounted.base.vectors(turn @ slid),
                )
            )
    return tuple(sorted(found, key=lambda c: (c.finger, c.disk, c.point, c.cable)))


def _disk_contacts(
    hand: Hand, near_disks: NearDisks | None, room: DiskRoom | None
) -> tuple[DiskContact, ...]:
    if near_disks is None or room is None:
        return ()
    found = []
    for k in np.flatnonzero(near_disks.active):
        fingers, disks = room.names(int(near_disks.pairs[k]))
        found.append(
            DiskContact(
                fingers,
                disks,
                position=near_disks.near.touch[k] * hand.length,
                normal=near_disks.near.normals[k],
                force=float(near_disks.forces[k]) * hand.energy / hand.length,
            )
        )
    return tuple(found)


def _message(way: Way, falls: str, room: DiskRoom | None) -> str:
    if way.reached is not None:
        # Rounded down: what ends just before its target has not come to 100 %.
        share = math.floor(1e3 * way.reached) / 10
        where = f"beyond {share:.1f}% of the way to the wanted pulls and loads"
        if room is not None and way.through is not None:
            disks = room.in_words(way.through)
            return f"{disks} would go through each other {where}"
        near_disks = way.point.near_disks
        if room is not None and near_disks is not None and near_disks.active.any():
            most = int(near_disks.pairs[near_disks.forces.argmax()])
            return (
                f"no equilibrium of fingers and object was found {where}: the fingers cannot hold"
                " the object there, or disks slip off each other"
                f" ({room.in_words(most)} press most)"
            )
        return (
            f"no equilibrium of fingers and object was found {where}: the fingers cannot hold the"
            " object there"
        )
    said = []
    if way.snapped.any():
        far = float(np.linalg.norm(way.snapped)) * 1e3
        said.append(f"the object snapped {far:.3g} mm to another equilibrium, as its own had ended")
    if falls:
        slips = any(part.hold.slipping.any() for part in way.point.blocks)
        free = ", what slips taken as free" if slips else ""
        said.append(f"the grasp is not stable: {falls} at the slightest disturbance{free}")
    return "; ".join(said)
