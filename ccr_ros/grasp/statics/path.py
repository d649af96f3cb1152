# SPDX-License-Identifier: Apache-2.0
"""Continuation of fingers and object in pulls and loads, around Newton's method."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ccr_ros.model.result import meeting_disks
from ccr_ros.model.rotation import Pose, quaternion_product
from ccr_ros.model.settings import SolverSettings
from ccr_ros.model.sqp import ACTIVE, Bounds, violation

from .assembly import FingerBlock, GraspPoint, Hand, derive, gather, held_anew
from .body import Body
from .disks import DiskRoom, press
from .friction import settle
from .meeting import Guess
from .newton import Step, newton_step

_SMALLEST_STEP = 1.0 / 256
_LARGEST_TURN = 0.5  # rad in one arc, or of the object, in one Newton step
_LARGEST_SHIFT = 0.05  # of the length, of the object in one Newton step
# Of a support that fades out, against shifts and turns, in units of EI / L^3 and EI / L: well above
# what holds an object between fingers. A dead load in its place would tip over what it stands on.
_SUPPORT = 100.0
_SINKING = 60  # steps that an object may sink
_FAR = 0.2  # of the length, that it may
_LOOSE = 0.1  # stiffness from which on an equilibrium without support is tried
_PATIENCE = 5  # Newton steps that do not halve the smallest error, until that is given up
_WASTE = 25  # Newton steps in attempts that fail, until there is taken to be no equilibrium
_TORN = 2e-3  # share of a Newton step; one that would go as far twice has nothing to hold on to
# A step in which the object goes farther than this (of the length; rad), and than this per change
# of a pull (of L / disk radius), has left the equilibrium that it should follow.
_LEAP, _LEAP_TURN, _LEAP_GAIN = 0.02, 0.5, 3.0
_LOAD_STEP = 0.1  # of the forces that press on the object, where there is friction


@dataclass
class Way:
    """How far a solve came.

    Attributes:
        point: Where it stands; pulls: per finger [m], there.
        reached: None once the target is reached; else the share of the way that was, in [0, 1).
        iterations: Newton steps; substeps: continuation steps accepted.
        slid: Per finger (P, 3), way of its points on the object, in the object's frame [m].
        heat: Energy that friction has given off [J].
        late: The time limit ended it.
        snapped: (3,) ways that the object went by itself, where its equilibrium ended [m].
        through: The pair of disks (of `DiskRoom`) that would have gone through each other, if that
            ended it.
    """

    point: GraspPoint
    pulls: list[np.ndarray]
    reached: float | None = None
    iterations: int = 0
    substeps: int = 0
    slid: list[np.ndarray] = field(default_factory=list)
    heat: float = 0.0
    late: bool = False
    snapped: np.ndarray = field(default_factory=lambda: np.zeros(3))
    through: int | None = None


class Path:
    """Walks from equilibrium to equilibrium.

    Args:
        hand: The fingers.
        body: The object, for its shape and friction.
        settings: Tolerances and limits.
        friction_step: Largest change of a pull in one step while contacts have friction, as a
            share of the finger's length.
        free: Whether the object is; else its support holds it where it is.
        room: The disks that press on each other; None: they pass through each other.
    """

    def __init__(
        self,
        hand: Hand,
        body: Body,
        settings: SolverSettings,
        friction_step: float,
        free: bool,
        room: DiskRoom | None = None,
    ) -> None:
        self.hand = hand
        self.room = room
        self.body = body
        self.settings = settings
        self.friction_step = friction_step
        self.free = free
        self._deadline = np.inf
        self._stood: Pose | None = None
        self._stiffness = 0.0

    def walk(
        self,
        way: Way,
        target: list[np.ndarray],
        load: np.ndarray,
        stood: Pose | None = None,
        snaps: int = 0,
    ) -> None:
        """Walk from where ``way`` stands to other pulls [m] and another load (6,), in units.

        ``stood``: the pose of a support that goes soft on the way, and is gone at its end.
        ``snaps``: how many times an equilibrium may end on the way and the object go to the next.
        """
        self._stood = stood
        rough = self.body.friction > 0
        start, begin_load = [p.copy() for p in way.pulls], way.point.load
        way.slid = way.slid or [np.zeros((len(p.points.labels), 3)) for p in self.hand.problems]
        change = max(
            float(np.abs(a - b).max()) / m.finger.length
            for a, b, m in zip(target, start, self.hand.mounted, strict=True)
        )
        fine = min(1.0, self.friction_step / change) if change > 0 else 1.0
        size = min(1.0, self.settings.max_pull_step / change) if change > 0 else 1.0
        if rough:
            grip = sum(float(w * p.point.forces[-1].sum()) for w, p in self._blocks(way.point))
            heavier = float(np.linalg.norm(load - begin_load))
            fine = min(fine, _LOAD_STEP * max(grip, 1e-6) / max(heavier, 1e-12))
            fine = max(fine, _SMALLEST_STEP)
        done, smallest = 0.0, min(_SMALLEST_STEP, fine / 64 if rough else 1.0)
        self._deadline = time.thread_time() + self.settings.time_limit
        wasted, asked = 0.0, 1.0
        while done < 1.0:
            tried = way.iterations
            if rough and self._touches(way.point):
                size = min(size, fine)
            share = 1.0 if done + size > 1.0 - 1e-9 else done + size
            pulls = [a + share * (b - a) for a, b in zip(start, target, strict=True)]
            next_load = begin_load + share * (load - begin_load)
            self._stiffness = 0.0 if stood is None else _SUPPORT * (1.0 - share)
            found = self._newton(way, way.point, pulls, next_load)
            if found is None and any(p.hold.slipping.any() for p in way.point.blocks):
                # That what slips slips on was a guess, which may leave nothing to hold the object.
                found = self._newton(way, self._sticking(way.point), pulls, next_load)
            # What comes to touch has no friction in the step in which it does.
            skipped = found is not None and rough and size > 2 * fine and self._touches(found)
            leapt = (
                found is not None and stood is None and self._leaps(way.point, found, size * change)
            )
            through = None if found is None else self._through(way.point, found)
            if found is None or skipped or leapt or through is not None:
                way.through = through
                if not skipped and through is None:
                    asked = share - done if wasted == 0.0 else asked
                    wasted += way.iterations - tried
                size = 0.5 * (share - done)
                way.late = time.thread_time() > self._deadline
                if size >= smallest and wasted <= _WASTE and not way.late:
                    continue
                if way.late or snaps == 0 or not self._snap(way, pulls, next_load):
                    way.reached = done
                    return
                snaps -= 1
                done, size, wasted = share, fine, 0.0
                continue
            # Forgotten as far as this step comes of what failed first: an equilibrium that ends
            # is neared by ever smaller ones.
            wasted *= max(0.0, 1.0 - (share - done) / asked)
            way.point, way.pulls, done = self._settled(way, found), pulls, share
            way.substeps += 1
            size *= 2.0

    def sink(self, way: Way, target: list[np.ndarray], load: np.ndarray) -> None:
        """Go on from where a support that went soft was not enough: the object sinks, damped.

        Each step is one of implicit Euler on overdamped motion, a spring to where the object is:
        it leaves an equilibrium that has ended for the next one downhill, if there is one near.
        """
        if self._sinks(way, target, load):
            way.reached = None

    def _snap(self, way: Way, pulls: list[np.ndarray], load: np.ndarray) -> bool:
        """Let a free object sink from an equilibrium that has ended to the next; whether it can.

        It slides as if without friction; where it rests friction holds it again, from nothing.
        """
        slick = Path(
            self.hand, replace(self.body, friction=0.0), self.settings, 1.0, True, self.room
        )
        slick._deadline = self._deadline
        points = [part.point for part in way.point.blocks]
        guesses = [Guess(p.at.y, p.tensions, p.forces) for p in points]
        parts = derive(self.hand, slick.body, way.point.pose, guesses)
        near = way.point.near_disks
        if near is not None:
            parts = press(self.hand, parts, near)
        start = gather(self.hand, way.point.pose, parts, load, near_disks=near)
        falling = Way(start, pulls)
        found = slick._sinks(falling, pulls, load)
        way.iterations += falling.iterations
        way.substeps += falling.substeps
        if found:
            way.snapped = way.snapped + falling.point.pose.position - way.point.pose.position
            way.point, way.pulls = self.settled(falling.point), pulls
        return found

    def _sinks(self, way: Way, target: list[np.ndarray], load: np.ndarray) -> bool:
        stiffness, first = 0.1 * _SUPPORT, way.point.pose
        for _ in range(_SINKING):
            far = float(np.linalg.norm(way.point.pose.position - first.position))
            way.late = time.thread_time() > self._deadline
            if way.late or far > _FAR * self.hand.length:
                return False
            self._stood, self._stiffness = way.point.pose, stiffness
            found = self._newton(way, self._sticking(way.point), target, load)
            if found is None or self._through(way.point, found) is not None:
                stiffness *= 4.0
                if stiffness > _SUPPORT:
                    return False
                continue
            way.point, way.pulls = self._settled(way, found), target
            way.substeps += 1
            stiffness *= 0.5
            if stiffness < _LOOSE:
                self._stood, self._stiffness = None, 0.0
                found = self._newton(way, way.point, target, load)
                if found is not None and self._through(way.point, found) is None:
                    way.point = self._settled(way, found)
                    return True
                stiffness *= 8.0
        return False

    def settled(self, point: GraspPoint) -> GraspPoint:
        """Return a point whose contacts are anchored where they are, without friction yet."""
        nowhere = Way(point, [], slid=[np.zeros((len(p.points.labels), 3))
                                       for p in self.hand.problems])  # fmt: skip
        return self._settled(nowhere, point)

    def _blocks(self, at: GraspPoint) -> Sequence[tuple[float, FingerBlock]]:
        return list(zip(self.hand.weights, at.blocks, strict=True))

    def _leaps(self, start: GraspPoint, end: GraspPoint, change: float) -> bool:
        """Whether the object goes out of proportion to a change of pulls, as a share of L."""
        gain = max(m.finger.length / m.finger.disk_radius for m in self.hand.mounted)
        shift = float(np.linalg.norm(end.pose.position - start.pose.position)) / self.hand.length
        turn = float(np.linalg.norm(turn_between(start.pose, end.pose)))
        return shift > _LEAP + _LEAP_GAIN * gain * change or turn > _LEAP_TURN

    def _through(self, start: GraspPoint, end: GraspPoint) -> int | None:
        """The pair of disks that goes through each other between two poses, if any does."""
        if self.room is None or start.near_disks is None or end.near_disks is None:
            return None
        return self.room.passed(start.near_disks, end.near_disks)

    def _touches(self, at: GraspPoint) -> bool:
        return any(bool((part.point.forces[-1] > ACTIVE).any()) for part in at.blocks)

    def _settled(self, way: Way, found: GraspPoint) -> GraspPoint:
        """The point with friction's memory brought up to date, and what slipped told to ``way``."""
        if self.body.friction <= 0:
            return found
        holds = []
        for index, part in enumerate(found.blocks):
            length = self.hand.problems[index].finger.length
            hold, slip = settle(
                part.point,
                part.touch,
                part.friction,
                way.point.blocks[index].hold,
                part.centre,
                part.turn,
            )
            way.slid[index] = way.slid[index] + slip.ways * length
            way.heat += slip.heat * float(self.hand.weights[index]) * self.hand.energy
            holds.append(hold)
        return replace(found, blocks=tuple(held_anew(self.body, found.blocks, holds)))

    def _sticking(self, at: GraspPoint) -> GraspPoint:
        holds = [replace(p.hold, slipping=np.zeros_like(p.hold.slipping)) for p in at.blocks]
        return replace(at, blocks=tuple(held_anew(self.body, at.blocks, holds)))

    def _newton(
        self, way: Way, start: GraspPoint, pulls: list[np.ndarray], load: np.ndarray
    ) -> GraspPoint | None:
        """Solve for the equilibrium near a point; None if it is not found."""
        hand, tolerance = self.hand, self.settings.tolerance
        at = gather(hand, start.pose, start.blocks, self._yielding(load, start.pose), self.free,
                    start.near_disks)  # fmt: skip
        bounds = [
            Bounds(p.length_bounds(u), np.zeros_like(part.point.forces))
            for p, u, part in zip(hand.problems, pulls, start.blocks, strict=True)
        ]
        best, idle, torn = np.inf, 0, False
        for _ in range(self.settings.max_iterations):
            over = max(
                violation(part.point, part.point.slacks(bound))
                for part, bound in zip(at.blocks, bounds, strict=True)
            )
            if at.near_disks is not None:
                over = max(over, at.near_disks.violation())
            if at.residual <= tolerance and over <= tolerance:
                pairs = zip(hand.problems, at.blocks, strict=True)
                return None if any(meeting_disks(p, part.point) for p, part in pairs) else at
            error = max(at.residual, over)
            idle = 0 if error < 0.5 * best else idle + 1
            best = min(best, error)
            if idle > _PATIENCE or time.thread_time() > self._deadline:
                return None
            step = newton_step(hand, at, bounds, self.free, self._stiffness)
            if step is None:
                return None
            way.iterations += 1
            share = self._share(step)
            if torn and share < _TORN:
                return None
            torn = share < _TORN
            at = self._moved(at, step, share, load)
        return None

    def _share(self, step: Step) -> float:
        """How much of a step is taken, in (0, 1]: none that turns or shifts anything too far."""
        turn = max(
            float(np.abs(part).max()) * problem.largest_scale
            for part, problem in zip(step.fingers, self.hand.problems, strict=True)
        )
        turn = max(turn, float(np.linalg.norm(step.body[3:])))
        shift = float(np.linalg.norm(step.body[:3]))
        return min(1.0, _LARGEST_TURN / max(turn, 1e-12), _LARGEST_SHIFT / max(shift, 1e-12))

    def _yielding(self, load: np.ndarray, pose: Pose) -> np.ndarray:
        """The load less what a support that is going soft carries of it."""
        if self._stood is None or self._stiffness == 0.0:
            return load
        shift = (pose.position - self._stood.position) / self.hand.length
        turn = turn_between(self._stood, pose)
        return load - self._stiffness * np.concatenate([shift, turn])

    def _moved(self, at: GraspPoint, step: Step, size: float, load: np.ndarray) -> GraspPoint:
        hand = self.hand
        pose = displaced(at.pose, size * step.body, hand.length) if self.free else at.pose
        guesses = []
        for index, part in enumerate(at.blocks):
            point, friction, hold = part.point, part.friction, part.hold
            multipliers = step.multipliers[index]
            count = len(point.tensions)
            forces = np.zeros_like(point.forces)
            if len(point.pairs):
                forces[point.pairs[:, 0], point.pairs[:, 1]] = multipliers[count:]
            if self.body.friction > 0:
                # One that lets go keeps its force: if it comes back at once, it slips that way.
                pushes = hold.pushes.copy()
                along = np.einsum("gi,gij->gj", step.friction[index], friction.tangents)
                pushes[friction.where] = along @ part.turn
                hold = replace(hold, pushes=pushes)
            y = point.at.y + size * step.fingers[index]
            guesses.append(Guess(y, multipliers[:count], forces, hold))
        parts = derive(hand, self.body, pose, guesses)
        near_disks = None
        if self.room is not None:
            near_disks = self.room.near_disks(
                [part.point for part in parts], at.near_disks, step.disks
            )
            parts = press(hand, parts, near_disks)
        return gather(hand, pose, parts, self._yielding(load, pose), self.free, near_disks)


def displaced(pose: Pose, motion: np.ndarray, length: float) -> Pose:
    """Return the pose after a motion (translation in lengths, rotation vector) about its centre."""
    angle = float(np.linalg.norm(motion[3:]))
    half = 0.5 * np.sinc(0.5 * angle / np.pi) * motion[3:]
    turn = np.append(half, np.cos(0.5 * angle))
    turned = quaternion_product(turn, pose.orientation)
    return Pose(pose.position + length * motion[:3], turned)


def turn_between(start: Pose, end: Pose) -> np.ndarray:
    """Return the rotation vector (3,) from one orientation to another, in their common frame.

    The shorter way; of half a turn, either.
    """
    back = start.orientation * np.array([-1.0, -1.0, -1.0, 1.0])
    turn = quaternion_product(end.orientation, back)
    turn = turn if turn[3] >= 0 else -turn
    half = float(np.linalg.norm(turn[:3]))
    angle = 2.0 * float(np.arctan2(half, turn[3]))
    return turn[:3] * (angle / half if half > 0.0 else 2.0)
