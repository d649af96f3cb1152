# SPDX-License-Identifier: Apache-2.0
"""The warm solver of fingers and object: continuation in pulls and loads around Newton's method."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ccr_ros.model import checks
from ccr_ros.model.errors import InvalidValue, UnknownName
from ccr_ros.model.files import MountedFinger
from ccr_ros.model.result import meeting_disks
from ccr_ros.model.rotation import Pose, quaternion_from_matrix, skew
from ccr_ros.model.settings import SolverSettings
from ccr_ros.model.solver import FingerSolver
from ccr_ros.model.sqp import Bounds, violation

from .assembly import GraspPoint, Hand, block, gather
from .body import GRAVITY, Body
from .newton import Step, newton_step
from .result import GraspSolution, Way, make_grasp_solution

_SMALLEST_STEP = 1.0 / 256
_LARGEST_TURN = 0.5  # rad in one arc, or of the object, in one Newton step
_LARGEST_SHIFT = 0.05  # of the length, of the object in one Newton step

Pulls = Mapping[str, Sequence[float] | np.ndarray]


class GraspSolver:
    """Finds the pose of fingers and object together for a stream of cable pulls.

    The object starts supported: it stands still at its pose, whatever presses on it. `let_go`
    takes the support away; from then on the fingers alone hold it against its weight and other
    loads. Fingers and contacts have no friction. Not for use by several threads at once.

    Args:
        fingers: The fingers and their bases.
        body: The object at its first pose.
        settings: Of the fingers' discretisation, and tolerances.
        gravity: (3,) [m/s^2] in the gripper's frame; default: the gripper points up.

    Raises:
        InvalidValue: No finger, fingers whose stiffness is not known beside others, or a body
            with a mass while forces are per EI.
    """

    def __init__(
        self,
        fingers: Sequence[MountedFinger],
        body: Body,
        settings: SolverSettings | None = None,
        gravity: np.ndarray = GRAVITY,
    ) -> None:
        if not fingers:
            raise InvalidValue("fingers", fingers, "at least one finger")
        units = {m.finger.forces_are for m in fingers}
        if len(units) > 1 or (units != {"newton"} and body.mass > 0):
            raise InvalidValue(
                "youngs_modulus", None, "given for every finger, so that forces are in newtons"
            )
        self.hand = Hand(fingers, settings)
        self.settings = self.hand.problems[0].settings
        self.body = body
        self.gravity = checks.vector("gravity", gravity, 3, unit="m/s^2", largest=1e3)
        self.supported = True
        self._outer = np.zeros(6)
        self._pulls = [np.zeros(len(m.finger.cables)) for m in fingers]
        self._support = np.zeros(6)
        self._point: GraspPoint | None = None
        self._started = [FingerSolver(m.finger, settings) for m in fingers]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the fingers."""
        return tuple(m.finger.name for m in self.hand.mounted)

    def solve(
        self,
        pulls: Pulls,
        mass: float | None = None,
        force: np.ndarray | None = None,
        moment: np.ndarray | None = None,
    ) -> GraspSolution:
        """Return the pose for pulls [m] of each finger's cables, and loads on the object.

        A solve that does not converge says so, shows the last pose on the way that did, and
        leaves the solver where it was.

        Args:
            pulls: By finger, one per cable in its order; a finger that is absent keeps its pulls.
            mass: New mass of the object [kg]; None: as it was.
            force: (3,) further force on the object [N], in the gripper's frame; None: as it was.
            moment: (3,) further moment about its centre [N m]; None: as it was.

        Raises:
            InvalidValue, UnknownName: Bad values; nothing has moved.
        """
        begin = time.perf_counter()
        target = self._checked_pulls(pulls)
        body = self.body if mass is None else replace(self.body, mass=mass)
        outer = self._outer.copy()
        if force is not None:
            outer[:3] = checks.vector("force", force, 3, unit="N", largest=1e6)
        if moment is not None:
            outer[3:] = checks.vector("moment", moment, 3, unit="N m", largest=1e6)
        if self.supported or self._point is None:
            way = self._press(target)
        else:
            way = Way(self._point, self._pulls)
            self._walk(way, target, self._load(self.body, self._outer), self._load(body, outer))
        if way.reached is None:
            self._accept(way.point, target)
            self.body, self._outer = replace(body, pose=way.point.pose), outer
        return make_grasp_solution(
            self.hand, self.body, way, target, self.supported, time.perf_counter() - begin
        )

    def let_go(self) -> GraspSolution:
        """Take the object's support away, in steps: what it carried fades out.

        Where the fingers cannot hold the object the solution has not converged and the support
        stays.

        Raises:
            InvalidValue: Nothing was solved before.
        """
        begin = time.perf_counter()
        if self._point is None:
            raise InvalidValue("let_go", None, "called after a solve")
        way = Way(self._point, self._pulls)
        load = self._load(self.body, self._outer)
        if self.supported:
            carried = self._point.unbalanced + self._point.load
            self._walk(way, self._pulls, carried, load)
        if way.reached is None:
            self.supported = False
            self._accept(way.point, self._pulls)
            self.body = replace(self.body, pose=way.point.pose)
        return make_grasp_solution(
            self.hand, self.body, way, self._pulls, self.supported, time.perf_counter() - begin
        )

    def support(self, pose: Pose | None = None) -> None:
        """Hold the object from now on where it is, or at another pose."""
        self.supported = True
        if pose is not None:
            self.body = replace(self.body, pose=pose)
        for index, solver in enumerate(self._started):
            local = self.hand.in_base(index, self.body.pose)
            solver.obstacles = (*self.hand.mounted[index].finger.obstacles,
                                self.body.shape.moved(local))  # fmt: skip

    # -- inside ----------------------------------------------------------------------------

    def _checked_pulls(self, pulls: Pulls) -> list[np.ndarray]:
        for name in pulls:
            if name not in self.names:
                raise UnknownName("finger", name, self.names)
        target = []
        for index, mounted in enumerate(self.hand.mounted):
            finger, problem = mounted.finger, self.hand.problems[index]
            wanted = finger.pulls_array(pulls.get(finger.name, self._pulls[index]))
            limits = problem.rest_lengths * finger.length
            for cable, pull, limit in zip(finger.cable_names, wanted, limits, strict=True):
                if pull >= limit:
                    raise InvalidValue(
                        f"pulls.{finger.name}.{cable}",
                        float(pull),
                        f"less than the cable's length inside the finger, {limit:.6g} m",
                    )
            target.append(wanted)
        return target

    def _load(self, body: Body, outer: np.ndarray) -> np.ndarray:
        """Force and moment on the object in units of the problem."""
        wrench = outer.copy()
        wrench[:3] += body.mass * self.gravity
        return wrench * np.array([self.hand.length] * 3 + [1.0] * 3) / self.hand.energy

    def _press(self, target: list[np.ndarray]) -> Way:
        """Solve each finger by itself against the object, which its support holds."""
        if self._point is None:
            self.support()
        parts, reached, iterations = [], None, 0
        for index, solver in enumerate(self._started):
            found = solver.solve(target[index])
            iterations += found.certificate.iterations
            if not found.certificate.converged:
                reached = 0.0
            point = solver.point
            parts.append(
                block(self.hand, index, self.body, self.body.pose, point.at.y, point.tensions,
                      point.forces)
            )  # fmt: skip
        load = self._load(self.body, self._outer)
        way = Way(gather(self.hand, self.body.pose, parts, load), target)
        way.reached, way.iterations = reached, iterations
        return way

    def _accept(self, point: GraspPoint, pulls: list[np.ndarray]) -> None:
        self._point, self._pulls = point, [p.copy() for p in pulls]

    def _walk(
        self, way: Way, target: list[np.ndarray], load: np.ndarray, last_load: np.ndarray
    ) -> None:
        """Walk from a point under pulls and load to others, in steps that Newton can follow."""
        start = [p.copy() for p in way.pulls]
        change = max(
            float(np.abs(a - b).max()) / m.finger.length
            for a, b, m in zip(target, start, self.hand.mounted, strict=True)
        )
        done, size = 0.0, min(1.0, self.settings.max_pull_step / change if change > 0 else 1.0)
        deadline = time.thread_time() + self.settings.time_limit
        while done < 1.0:
            share = 1.0 if done + size > 1.0 - 1e-9 else done + size
            pulls = [a + share * (b - a) for a, b in zip(start, target, strict=True)]
            found = self._newton(way, pulls, load + share * (last_load - load), deadline)
            if found is None:
                size *= 0.5
                if size < _SMALLEST_STEP or time.thread_time() > deadline:
                    way.reached = done
                    return
                continue
            way.point, way.pulls, done = found, pulls, share
            way.substeps += 1
            size *= 2.0

    def _newton(
        self, way: Way, pulls: list[np.ndarray], load: np.ndarray, deadline: float
    ) -> GraspPoint | None:
        """Solve for the equilibrium near a point; None if it is not found."""
        hand, tolerance = self.hand, self.settings.tolerance
        at = replace(way.point, load=load)
        at = gather(hand, at.pose, at.blocks, load)
        bounds = [
            Bounds(p.length_bounds(u), np.zeros((len(p.obstacles), len(p.points.labels))))
            for p, u in zip(hand.problems, pulls, strict=True)
        ]
        for _ in range(self.settings.max_iterations):
            over = max(
                violation(part.point, part.point.slacks(bound))
                for part, bound in zip(at.blocks, bounds, strict=True)
            )
            if at.residual <= tolerance and over <= tolerance:
                pairs = zip(hand.problems, at.blocks, strict=True)
                return None if any(meeting_disks(p, part.point) for p, part in pairs) else at
            if time.thread_time() > deadline:
                return None
            step = newton_step(hand, at, bounds)
            if step is None:
                return None
            way.iterations += 1
            at = self._moved(at, step)
        return None

    def _moved(self, at: GraspPoint, step: Step) -> GraspPoint:
        hand = self.hand
        turn = max(
            float(np.abs(part).max()) * problem.largest_scale
            for part, problem in zip(step.fingers, hand.problems, strict=True)
        )
        turn = max(turn, float(np.linalg.norm(step.body[3:])))
        shift = float(np.linalg.norm(step.body[:3]))
        size = min(1.0, _LARGEST_TURN / max(turn, 1e-12), _LARGEST_SHIFT / max(shift, 1e-12))
        pose = _displaced(at.pose, size * step.body, hand.length)
        parts = []
        for index, part in enumerate(at.blocks):
            point = part.point
            multipliers = step.multipliers[index]
            count = len(point.tensions)
            forces = np.zeros_like(point.forces)
            if len(point.pairs):
                forces[point.pairs[:, 0], point.pairs[:, 1]] = multipliers[count:]
            y = point.at.y + size * step.fingers[index]
            parts.append(block(hand, index, self.body, pose, y, multipliers[:count], forces))
        return gather(hand, pose, parts, at.load)


def _displaced(pose: Pose, motion: np.ndarray, length: float) -> Pose:
    """The pose after a motion (translation in lengths, rotation vector) about its centre."""
    angle = float(np.linalg.norm(motion[3:]))
    axis = motion[3:] / angle if angle > 0 else np.array([0.0, 0.0, 1.0])
    k = skew(axis)
    turn = np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * (k @ k)
    return Pose(pose.position + length * motion[:3], quaternion_from_matrix(turn @ pose.rotation))
