# SPDX-License-Identifier: Apache-2.0
"""The object of a running gripper: put down, held, heavier, dropped, put back."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ccr_ros.grasp.statics import Body, DiskShape, GraspSolution, GraspSolver
from ccr_ros.grasp.statics.solver import Pulls
from ccr_ros.model.errors import InvalidValue
from ccr_ros.model.files import MountedFinger
from ccr_ros.model.rotation import Pose
from ccr_ros.model.settings import SolverSettings
from ccr_ros.model.solver import FingerSolver

_SAME = 1e-6  # m; pulls as near as that to some that failed are not tried


class LiveGrasp:
    """Keeps fingers and object in equilibrium, as somebody says from time to time what is wanted.

    `want` says where the object is, how heavy, and whether the fingers alone carry it; `solve`
    sees to it with the pulls of now. What cannot be is said in `failure` and `refusal`; then
    `solution` is the last good one. An object that was dropped, and that fingers would not carry
    where it was last, is `lost` until `want` says where it stands: nothing is solved with it.

    Args:
        fingers: The fingers, with all that is in their way but the object.
        body: The object, at the pose that is said of it.
        settings: Of the solver.
        gravity: (3,) [m/s^2] in the gripper's frame.
        at: Where the object is, if not at the pose that is said of it.
        disks: What of the disks presses on other disks; None: nothing.

    Raises:
        InvalidValue: As for `GraspSolver`.
    """

    def __init__(
        self,
        fingers: Sequence[MountedFinger],
        body: Body,
        settings: SolverSettings,
        gravity: np.ndarray,
        at: Pose | None = None,
        disks: DiskShape | None = None,
    ) -> None:
        start = body if at is None else replace(body, pose=at)
        self._solver = GraspSolver(fingers, start, settings, gravity, disks=disks)
        self._arguments = fingers, start, settings, gravity
        self._copy: GraspSolver | None = None
        self._said = body.pose
        self._mass = body.mass
        self._wanted = False  # whether it shall be held
        self._to_let_go = False
        self._failed: tuple[dict[str, np.ndarray], GraspSolution] | None = None
        self._alone = [FingerSolver(mounted.finger, settings) for mounted in fingers]
        self.lost = False
        """Whether it was dropped and is out of the fingers' reach; they move by themselves."""
        self.solution: GraspSolution | None = None  # the last good one
        self.failure = ""
        """Why the newest wishes or pulls have no solution; a held object is dropped then."""
        self.refusal = ""
        """Why an object that shall be held stands."""

    @property
    def body(self) -> Body:
        """The object where it is, or was last known to be."""
        return self._solver.body

    @property
    def supported(self) -> bool:
        """Whether it stands, and is not left to the fingers."""
        return self._solver.supported

    @property
    def held(self) -> bool:
        """Whether the fingers carry it."""
        return not self._solver.supported and not self.failure

    def copy(self, time_limit: float) -> GraspSolver:
        """Return a solver that stands where this grasp does, to plan on while this one goes on.

        It is the same one every time, so that only one may plan at a time.

        Args:
            time_limit: Longest CPU time of one of its solves [s].
        """
        if self._copy is None:
            fingers, body, settings, gravity = self._arguments
            settings = replace(settings, time_limit=min(settings.time_limit, time_limit))
            self._copy = GraspSolver(fingers, body, settings, gravity, disks=self._solver.disks)
        self._copy.resume(self._solver.standing)
        return self._copy

    def place(self, pose: Pose, held: bool) -> Pose:
        """Return where the object is once this is said of it.

        An object that is held, or of which the same is said as before, is where it is; one that
        was dropped is at the pose that is said, because nobody knows where it went.
        """
        stays = held or (_same(pose, self._said) and not self.failure)
        if self._solver.supported:
            stays = _same(pose, self._said)
        return self._solver.body.pose if stays else pose

    def want(self, pose: Pose, mass: float, held: bool) -> bool:
        """Say what is wanted; return whether there is something to `solve`.

        Where the object shall be held, and is not, saying so again has it tried again; but one that
        is `lost` has to stand somewhere first.

        Args:
            pose: Of the object in the gripper's frame; see `place`.
            mass: [kg].
            held: Whether the fingers alone carry it.
        """
        if self.lost and held:
            self._said, self._mass, self._wanted = pose, mass, held
            return False
        due = mass != self._mass or held != self._wanted or (held and not self.held)
        place = self.place(pose, held)
        stands = self._solver.supported or not held
        if stands and not (self._solver.supported and place is self._solver.body.pose):
            # Where it is: the fingers stay as they are, with all their friction.
            self._solver.support(None if place is self._solver.body.pose else place)
            due = True
        self._said, self._mass, self._wanted = pose, mass, held
        self._to_let_go = held and self._solver.supported
        if not held:
            self.refusal = ""
        if due:
            self._failed = None
        self.lost = False
        return due

    def solve(self, pulls: Pulls) -> GraspSolution:
        """Return the equilibrium for pulls [m] by finger, or how far it came where there is none.

        To find that there is none takes long: pulls that failed are not tried again while nothing
        else is wanted, nor any with an object that is `lost`.

        Raises:
            InvalidValue, UnknownName: Bad pulls; nothing has moved.
        """
        if self._failed is not None:
            before, failed = self._failed
            if self.lost or _near(pulls, before):
                return failed
            if not failed.supported and self._grip(pulls) < self._weight:
                return self._lose(pulls, failed)
        found = self._solver.solve(pulls, mass=self._mass, snap=False)
        self.failure, self._failed = "", None
        if not found.converged:
            if found.supported:
                return self._fail(found.message, pulls, found)
            if self._grip(pulls) == 0.0:
                return self._lose(pulls, found)
            return self._fail(f"dropped: {found.message}", pulls, found)
        if not found.supported and not found.contacts:
            return self._lose(pulls, found)
        if self._to_let_go:
            found = self._let_go(found)
        self.solution = found
        return found

    def _fail(self, reason: str, pulls: Pulls, found: GraspSolution) -> GraspSolution:
        self.failure = reason
        self._failed = {name: np.array(pull) for name, pull in pulls.items()}, found
        return found

    def _lose(self, pulls: Pulls, found: GraspSolution) -> GraspSolution:
        self.lost = True
        what = "touches" if self._grip(pulls) == 0.0 else "presses enough to carry"
        return self._fail(f"dropped: no finger {what} it any more", pulls, found)

    @property
    def _weight(self) -> float:
        """[N]; just above 0 without one, which no grip at all is less than."""
        weight = self._mass * float(np.linalg.norm(self._arguments[3]))
        return max(weight, float(np.finfo(float).tiny))

    def _grip(self, pulls: Pulls) -> float:
        """The most that fingers could carry [N] of an object that stands where it was last.

        As if all they press and rub with were along its weight; infinite where it is not known.
        """
        body, fingers, most = self._solver.body, self._arguments[0], 0.0
        for mounted, alone in zip(fingers, self._alone, strict=True):
            here = body.shape.moved(mounted.base.inverse() @ body.pose)
            try:
                alone.obstacles = (*mounted.finger.obstacles, here)
            except InvalidValue:  # it lies on the finger's base, which no finger takes for a grip
                return math.inf
            name = mounted.finger.name
            found = alone.solve(pulls.get(name, self._solver.pulls[name]))
            if not found.certificate.converged:
                return math.inf
            most += sum(
                contact.force for contact in found.contacts if contact.obstacle == here.name
            )
        return most * math.hypot(1.0, body.friction)

    def _let_go(self, standing: GraspSolution) -> GraspSolution:
        self._to_let_go = False
        if not standing.contacts:
            self.refusal = "it stands still: no finger touches it"
            return standing
        found = self._solver.let_go()
        if not found.converged:
            self.refusal = f"it stands still: {found.message}"
            return standing
        self.refusal = ""
        return found


def _same(one: Pose, two: Pose) -> bool:
    return bool(
        np.array_equal(one.position, two.position)
        and np.array_equal(one.orientation, two.orientation)
    )


def _near(one: Pulls, two: Pulls) -> bool:
    return one.keys() == two.keys() and all(
        bool(np.all(np.abs(np.asarray(one[name]) - two[name]) <= _SAME)) for name in one
    )
