# SPDX-License-Identifier: Apache-2.0
"""Pulls over time that shift and turn a held object, every contact kept.

The plan is made on the whole-gripper model itself: a step from sensitivities, then the equilibrium
there with all its friction, again and again (a continuation in the object's pose). What the model
does not follow within the limits is not planned; what stopped it is named.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass

import numpy as np

from ccr_ros.grasp.clearance import disk_clearance
from ccr_ros.grasp.statics import GraspSolution, GraspSolver
from ccr_ros.grasp.statics.path import turn_between
from ccr_ros.grasp.statics.sensitivity import grasp_sensitivity
from ccr_ros.model.errors import InvalidValue, NotConverged
from ccr_ros.model.rotation import Pose

from .step import StepLimits, best_step, constraint_rows
from .target import MoveLimits, MoveTarget

_ARM = 0.02  # m; as far from its centre a turn counts as much as a shift
_SCALE = np.array([1.0] * 3 + [_ARM] * 3)
_ASIDE = 0.4  # weight of motions that were not asked for
_LEAST = 0.02  # share of a step's wanted motion below which nothing gets on any more
_IDLE, _NEARER = 40, 1e-4  # waypoints in which it must come that much nearer [m], a turn at _ARM
_SHRINKS = 5  # times that a step is halved before it is given up


@dataclass(frozen=True, eq=False)
class Waypoint:
    """One pose on the way.

    Attributes:
        pulls: By finger (m,) [m].
        pose: Of the object in the gripper's frame.
        margin: Smallest friction margin; force: smallest contact force [N].
        moved: (6,) shift [m] and rotation vector [rad] since the beginning.
    """

    pulls: dict[str, np.ndarray]
    pose: Pose
    margin: float
    force: float
    moved: np.ndarray


@dataclass(frozen=True, eq=False)
class MovePlan:
    """A way to a target, or as far towards it as limits allow.

    Attributes:
        target: What was asked for.
        waypoints: From where the object is (included) on.
        reached: The last waypoint is the target, to its tolerances.
        share: Of the way that the last waypoint has, 1 for all of it.
        limiting: What stopped it, in words; empty if nothing did.
    """

    target: MoveTarget
    waypoints: tuple[Waypoint, ...]
    reached: bool
    share: float
    limiting: str

    @property
    def margin(self) -> float:
        """Smallest friction margin on the way."""
        return min(w.margin for w in self.waypoints)

    @property
    def moved(self) -> np.ndarray:
        """(6,) shift [m] and rotation vector [rad] at the end."""
        return self.waypoints[-1].moved


def plan_move(
    solver: GraspSolver,
    target: MoveTarget,
    limits: MoveLimits | None = None,
    watch: Callable[[Waypoint], bool] | None = None,
) -> MovePlan:
    """Plan pulls that move a held object; the solver is left where it stands.

    Args:
        solver: Of a grasp that holds its object.
        target: Where to.
        limits: What to keep.
        watch: Called with each new waypoint; the plan ends there when it returns False.

    Raises:
        InvalidValue: Nothing is held, the object is supported, or limits are not of this gripper.
        NotConverged: The present grasp is no equilibrium any more.
    """
    steps = move_steps(solver, target, limits)
    try:
        found = next(steps)
        while True:
            ends = found is not None and watch is not None and not watch(found)
            found = steps.send("stopped by the caller" if ends else "")
    except StopIteration as end:
        plan: MovePlan = end.value
        return plan
    finally:
        steps.close()


def move_steps(
    solver: GraspSolver, target: MoveTarget, limits: MoveLimits | None = None
) -> Generator[Waypoint | None, str | None, MovePlan]:
    """Plan as `plan_move` does, a solve at a time, for who has other things to do between.

    Yields each new waypoint, or None after a try that gave none. What is sent back, if not empty,
    is why the plan shall end there. The solver is for the plan alone until it is over.

    Raises:
        InvalidValue, NotConverged: As for `plan_move`.
    """
    limits = MoveLimits() if limits is None else limits
    bounds = limits.for_solver(solver)
    if solver.supported or solver.point is None:
        raise InvalidValue("grasp", "supported", "an object that the fingers alone hold (let_go)")
    before = solver.standing
    try:
        return (yield from _Planner(solver, target, limits, bounds).steps())
    finally:
        solver.resume(before)


class _Planner:
    def __init__(
        self,
        solver: GraspSolver,
        target: MoveTarget,
        limits: MoveLimits,
        bounds: StepLimits,
    ) -> None:
        self.solver = solver
        self.target = target
        self.limits = limits
        self.bounds = bounds
        self.start = solver.body.pose
        self.bases = [mounted.base for mounted in solver.hand.mounted]
        self.crowded = False  # fingers meet already, which no step can be blamed for
        self.way = np.concatenate([target.shift, target.turn])
        scaled = self.way * _SCALE
        self.along = scaled / np.linalg.norm(scaled)

    def steps(self) -> Generator[Waypoint | None, str | None, MovePlan]:
        solution = self.solver.solve({}).require_converged()
        first = self._waypoint(solution)
        self.crowded = disk_clearance(solution.fingers, self.bases).touching
        # A grasp that is weaker than the limits may be moved, and not get weaker.
        self.bounds = StepLimits(
            **{
                **vars(self.bounds),
                "margin": min(self.bounds.margin, max(0.0, solution.margin)),
                "least_force": min(self.bounds.least_force, first.force),
            }
        )
        waypoints, limiting, size = [first], "", self.limits.step
        nearest, idle = self._far(self.way), 0
        while len(waypoints) <= self.limits.waypoints:
            left = self.way - waypoints[-1].moved
            if self._there(left):
                return self._plan(waypoints, True, "")
            found = yield from self._step(solution, left, size)
            if isinstance(found, str):
                limiting = found
                break
            solution, size = found
            waypoints.append(self._waypoint(solution))
            size = min(self.limits.step, 2 * size)
            far = self._far(self.way - waypoints[-1].moved)
            nearest, idle = (far, 0) if far < nearest - _NEARER else (nearest, idle + 1)
            if idle >= _IDLE:
                limiting = "no pull brings the object nearer to all that was asked for"
                break
            limiting = (yield waypoints[-1]) or ""
            if limiting:
                break
        else:
            limiting = f"the number of waypoints: {self.limits.waypoints} at most"
        return self._plan(waypoints, False, limiting)

    def _missing(self, left: np.ndarray) -> tuple[float, float]:
        """How much of the shift [m] and of the turn [rad] that were asked for is left."""
        asked_shift, asked_turn = np.any(self.target.shift), np.any(self.target.turn)
        far = float(np.linalg.norm(left[:3])) if asked_shift else 0.0
        # Of a turn, what counts is how far it has come about the axis asked for.
        return far, abs(float(left[3:] @ _unit(self.target.turn))) if asked_turn else 0.0

    def _far(self, left: np.ndarray) -> float:
        far, turn = self._missing(left)
        return float(np.hypot(far, _ARM * turn))

    def _there(self, left: np.ndarray) -> bool:
        far, turn = self._missing(left)
        return far <= self.target.shift_tolerance and turn <= self.target.turn_tolerance

    def _step(
        self, solution: GraspSolution, left: np.ndarray, size: float
    ) -> Generator[None, str | None, tuple[GraspSolution, float] | str]:
        """The next solution and the step's size, or why there is none."""
        before = self.solver.standing
        pulls = np.concatenate(list(self.solver.pulls.values()))
        try:
            slopes = grasp_sensitivity(self.solver)
        except NotConverged as error:
            return str(error)
        scale = np.diag(_SCALE)
        onward = np.outer(self.along, self.along) @ scale
        weights = np.concatenate([onward, _ASIDE * (scale - onward)]) / (_ARM * 0.02)
        rows = constraint_rows(solution, slopes, pulls, self.bounds)
        missing = float(self.along @ (scale @ left))  # negative: it went too far
        wanted = self.along * missing
        aside = scale @ left - wanted
        # What has gone aside comes back no faster than the object goes on, lest it go back instead.
        far = float(np.linalg.norm(aside))
        wanted = (wanted + aside * min(1.0, abs(missing) / max(far, 1e-12))) / _SCALE
        why = ""
        for _ in range(_SHRINKS):
            step = best_step(wanted, weights, 1.0, slopes, rows, size)
            onwards = float(self.along @ (scale @ step.motion)) * np.sign(missing)
            able = float(np.abs(self.along @ scale @ slopes.motion).sum()) * size
            if missing == 0 or onwards < _LEAST * min(abs(missing), able):
                return why or "; ".join(step.limiting[:2]) or "no pull moves the object on"
            names = {m.finger.name: m.finger.cables for m in self.solver.hand.mounted}
            target, first = {}, 0
            for name, cables in names.items():
                target[name] = (pulls + step.change)[first : first + len(cables)]
                first += len(cables)
            found = self.solver.solve(target, snap=False)
            why = self._refusal(found)
            if not why:
                return found, size
            self.solver.resume(before)
            size *= 0.5
            if ended := (yield None):
                return ended
        return why

    def _refusal(self, found: GraspSolution) -> str:
        """Why a solution may not be a waypoint, or nothing."""
        if not found.converged:
            return found.message
        if not found.stability.exceeds(self.limits.stiffness):
            return f"stability: {found.softest} at the slightest disturbance"
        for contact in found.contacts:
            if contact.status == "slip" or contact.margin < self.bounds.margin - 0.02:
                return f"friction at disk {contact.disk} of {contact.finger}: it would slip"
        scaled = self._moved(found) * _SCALE
        aside = scaled - self.along * float(self.along @ scaled)
        if float(np.linalg.norm(aside)) > self.limits.drift:
            worst = int(np.argmax(np.abs(aside)))
            kind = "shift along" if worst < 3 else "turn about"
            return f"drift: the object would {kind} {'xyz'[worst % 3]}, which was not asked for"
        near = disk_clearance(found.fingers, self.bases)
        if near.touching and not self.crowded:
            return f"room: {near.in_words()}"
        return ""

    def _moved(self, solution: GraspSolution) -> np.ndarray:
        pose = solution.body.pose
        return np.concatenate([pose.position - self.start.position, turn_between(self.start, pose)])

    def _waypoint(self, solution: GraspSolution) -> Waypoint:
        moved = self._moved(solution)
        force = min((c.force for c in solution.contacts), default=0.0)
        return Waypoint(self.solver.pulls, solution.body.pose, solution.margin, force, moved)

    def _plan(self, waypoints: list[Waypoint], reached: bool, limiting: str) -> MovePlan:
        whole = float(self.along @ (_SCALE * self.way))
        share = float(self.along @ (_SCALE * waypoints[-1].moved)) / whole
        return MovePlan(self.target, tuple(waypoints), reached, 1.0 if reached else share, limiting)


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)
