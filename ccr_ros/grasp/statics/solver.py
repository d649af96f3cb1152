# SPDX-License-Identifier: Apache-2.0
"""The warm solver of fingers and object together."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ccr_ros.model import checks
from ccr_ros.model.errors import InvalidValue, UnknownName
from ccr_ros.model.files import MountedFinger
from ccr_ros.model.rotation import Pose
from ccr_ros.model.settings import SolverSettings
from ccr_ros.model.solver import FingerSolver, Standing

from .assembly import GraspPoint, Hand, derive, gather
from .body import GRAVITY, Body
from .disks import DiskRoom, DiskShape
from .meeting import Guess
from .path import Path, Way
from .result import GraspSolution, make_grasp_solution

_SNAPS = 4  # in one solve

Pulls = Mapping[str, Sequence[float] | np.ndarray]


@dataclass(frozen=True, eq=False)
class GraspStanding:
    """Where a `GraspSolver` stands (see `GraspSolver.standing`); nothing in it ever changes."""

    hand: Hand
    body: Body
    supported: bool
    outer: np.ndarray
    pulls: tuple[np.ndarray, ...]
    point: GraspPoint | None
    pressed: tuple[Standing, ...]
    disks: DiskShape | None


class GraspSolver:
    """Finds the pose of fingers and object together for a stream of cable pulls.

    The object starts supported: it stands still at its pose, whatever presses on it. `let_go`
    takes the support away; from then on the fingers alone hold it against its weight and other
    loads. Where the body has friction, contacts stick until their force leaves the Coulomb cone and
    then slip; the result depends on the path, which is walked in small steps. Not for use by
    several threads at once.

    Args:
        fingers: The fingers and their bases.
        body: The object at its first pose.
        settings: Of the fingers' discretisation, and tolerances.
        gravity: (3,) [m/s^2] in the gripper's frame; default: the gripper points up.
        friction_step: Largest change of a pull in one step while something touches, as a share of
            the finger's length, where there is friction.
        disks: What of the disks presses on those of other fingers, and on far ones of the same
            finger; None: fingers pass through each other.

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
        friction_step: float = 0.00125,
        disks: DiskShape | None = None,
    ) -> None:
        if not fingers:
            raise InvalidValue("fingers", fingers, "at least one finger")
        _check_units(fingers, body)
        self.hand = Hand(fingers, settings)
        self.settings = self.hand.problems[0].settings
        self.body = body
        self.gravity = checks.vector("gravity", gravity, 3, unit="m/s^2", largest=1e3)
        self.friction_step = checks.real("friction_step", friction_step, above=0, high=1)
        self.room = None if disks is None else DiskRoom(self.hand, disks)
        self.supported = True
        self._outer = np.zeros(6)
        self._pulls = [np.zeros(len(m.finger.cables)) for m in fingers]
        self._point: GraspPoint | None = None
        self._started = [FingerSolver(m.finger, settings) for m in fingers]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the fingers."""
        return tuple(m.finger.name for m in self.hand.mounted)

    @property
    def pulls(self) -> dict[str, np.ndarray]:
        """Pulls [m] of each finger's cables, of the last pose."""
        return {n: p.copy() for n, p in zip(self.names, self._pulls, strict=True)}

    @property
    def disks(self) -> DiskShape | None:
        """What of the disks presses on other disks; None: nothing."""
        return None if self.room is None else self.room.shape

    @property
    def point(self) -> GraspPoint | None:
        """The last pose that converged, with all derivatives; None before the first."""
        return self._point

    def solve(
        self,
        pulls: Pulls,
        mass: float | None = None,
        force: np.ndarray | None = None,
        moment: np.ndarray | None = None,
        snap: bool = True,
    ) -> GraspSolution:
        """Return the pose for pulls [m] of each finger's cables, and loads on the object.

        A solve that does not converge says so, shows the last pose on the way that did, and
        leaves the solver where it was. Where the equilibrium of a free object ends on the way, the
        object may snap to another one; the solution says so.

        Args:
            pulls: By finger, one per cable in its order; a finger that is absent keeps its pulls.
            mass: New mass of the object [kg]; None: as it was.
            force: (3,) further force on the object [N], in the gripper's frame; None: as it was.
            moment: (3,) further moment about its centre [N m]; None: as it was.
            snap: Whether the object may snap; else it is lost where its equilibrium ends.

        Raises:
            InvalidValue, UnknownName: Bad values; nothing has moved.
        """
        begin = time.perf_counter()
        target = self._checked_pulls(pulls)
        body = self.body if mass is None else replace(self.body, mass=mass)
        _check_units(self.hand.mounted, body)
        outer = self._outer.copy()
        if force is not None:
            outer[:3] = checks.vector("force", force, 3, unit="N", largest=1e6)
        if moment is not None:
            outer[3:] = checks.vector("moment", moment, 3, unit="N m", largest=1e6)
        load = self._load(body, outer)
        if self.supported and self.body.friction <= 0 and self.room is None:
            way = self._press(target, load)
        else:
            way = self._from_rest(load) if self._point is None else self._way()
            if way.reached is None:
                snaps = _SNAPS if snap and not self.supported else 0
                self._path().walk(way, target, load, snaps=snaps)
        if way.reached is None:
            self._accept(way.point, target)
            self.body, self._outer = replace(body, pose=way.point.pose), outer
        return make_grasp_solution(
            self.hand,
            self.body,
            way,
            target,
            self.supported,
            time.perf_counter() - begin,
            self.room,
        )

    def let_go(self) -> GraspSolution:
        """Take the object's support away, in steps: what it carried fades out.

        Where that leaves no equilibrium near, the object sinks slowly to the next one. Where the
        fingers cannot hold the object the solution has not converged and the support stays.

        Raises:
            InvalidValue: Nothing was solved before.
        """
        begin = time.perf_counter()
        if self._point is None:
            raise InvalidValue("let_go", None, "called after a solve that converged")
        way = self._way()
        if self.supported:
            load = self._point.load
            carried = self._point.unbalanced + load
            way.point = gather(
                self.hand, self.body.pose, self._point.blocks, carried,
                near_disks=self._point.near_disks,
            )  # fmt: skip
            path = self._path(free=True)
            path.walk(way, self._pulls, load, stood=self.body.pose)
            if way.reached is not None and not way.late:
                path.sink(way, self._pulls, load)
        if way.reached is None:
            self.supported = False
            self._accept(way.point, self._pulls)
            self.body = replace(self.body, pose=way.point.pose)
        return make_grasp_solution(
            self.hand,
            self.body,
            way,
            self._pulls,
            self.supported,
            time.perf_counter() - begin,
            self.room,
        )

    def support(self, pose: Pose | None = None) -> None:
        """Hold the object from now on where it is, or at another pose.

        Put at another pose the object has no friction with what touches it there until that moves.

        Raises:
            InvalidValue: It is no pose.
        """
        if pose is not None:
            if not isinstance(pose, Pose):
                raise InvalidValue("pose", pose, "a Pose in the gripper's frame")
            self.body = replace(self.body, pose=pose)
            self._point = None
        walks = self.body.friction > 0 or self.room is not None
        if walks and self._point is not None:
            load, blocks = self._point.load, self._point.blocks
            near_disks = self._point.near_disks
            self._point = gather(self.hand, self.body.pose, blocks, load, False, near_disks)
        else:
            self._put()
        self.supported = True

    @property
    def standing(self) -> GraspStanding:
        """Where the solver stands; a solver of the same fingers can `resume` from it."""
        return GraspStanding(
            self.hand,
            self.body,
            self.supported,
            self._outer,
            tuple(self._pulls),
            self._point,
            tuple(solver.standing for solver in self._started),
            self.disks,
        )

    def resume(self, standing: GraspStanding) -> None:
        """Go back, or over, to where a solver of the same fingers and settings stood.

        Raises:
            InvalidValue: It is of other fingers or disks, or discretised otherwise.
        """
        same = len(standing.hand.mounted) == len(self.hand.mounted) and all(
            a.finger is b.finger and a.base is b.base
            for a, b in zip(standing.hand.mounted, self.hand.mounted, strict=True)
        )
        if not same:
            names = ", ".join(m.finger.name for m in standing.hand.mounted)
            raise InvalidValue("standing", names, f"of a solver of {', '.join(self.names)}")
        if standing.disks != self.disks:
            raise InvalidValue("standing", standing.disks, f"with disks={self.disks}")
        for solver, stood in zip(self._started, standing.pressed, strict=True):
            solver.resume(stood)
        self.body, self.supported = standing.body, standing.supported
        self._outer, self._point = standing.outer, standing.point
        self._pulls = list(standing.pulls)

    # -- inside ----------------------------------------------------------------------------

    def _checked_pulls(self, pulls: Pulls) -> list[np.ndarray]:
        for name in pulls:
            if name not in self.names:
                raise UnknownName("finger", name, self.names)
        target = []
        for index, mounted in enumerate(self.hand.mounted):
            finger, problem = mounted.finger, self.hand.problems[index]
            try:
                wanted = finger.pulls_array(pulls.get(finger.name, self._pulls[index]))
            except InvalidValue as error:
                place = error.place.removeprefix("pulls").lstrip(".")
                where = ".".join(x for x in ("pulls", finger.name, place) if x)
                raise InvalidValue(where, error.value, error.allowed) from None
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

    def _path(self, free: bool | None = None) -> Path:
        free = not self.supported if free is None else free
        return Path(self.hand, self.body, self.settings, self.friction_step, free, self.room)

    def _way(self) -> Way:
        assert self._point is not None
        return Way(self._point, self._pulls)

    def _put(self) -> None:
        """Put the object among the obstacles of each finger by itself."""
        for index, solver in enumerate(self._started):
            local = self.hand.in_base(index, self.body.pose)
            solver.obstacles = (*self.hand.mounted[index].finger.obstacles,
                                self.body.shape.moved(local))  # fmt: skip

    def _press(self, target: list[np.ndarray], load: np.ndarray) -> Way:
        """Solve each finger by itself against the object, which its support holds."""
        if self._point is None:
            self._put()
        guesses, reached, iterations = [], None, 0
        for index, solver in enumerate(self._started):
            found = solver.solve(target[index])
            iterations += found.certificate.iterations
            if not found.certificate.converged:
                reached = 0.0
            point = solver.point
            guesses.append(Guess(point.at.y, point.tensions, point.forces))
        parts = derive(self.hand, self.body, self.body.pose, guesses)
        near_disks = None
        if self.room is not None:
            near_disks = self.room.near_disks([part.point for part in parts])
        start = gather(self.hand, self.body.pose, parts, load, free=False, near_disks=near_disks)
        way = Way(self._path().settled(start), target)
        way.reached, way.iterations = reached, iterations
        return way

    def _from_rest(self, load: np.ndarray) -> Way:
        """Where fingers stand by themselves; at rest where their disks would cut each other."""
        way = self._press(self._pulls, load)
        near_disks = way.point.near_disks
        if near_disks is not None and near_disks.violation() > 0 and way.reached is None:
            way = self._press([np.zeros_like(pulls) for pulls in self._pulls], load)
        return way

    def _accept(self, point: GraspPoint, pulls: list[np.ndarray]) -> None:
        self._point, self._pulls = point, [p.copy() for p in pulls]


def _check_units(fingers: Sequence[MountedFinger], body: Body) -> None:
    units = {m.finger.forces_are for m in fingers}
    if len(units) > 1 or (units != {"newton"} and body.mass > 0):
        allowed = "given for every finger, so that forces are in newtons"
        raise InvalidValue("youngs_modulus", None, allowed)
