# SPDX-License-Identifier: Apache-2.0
"""How far a gripper turns an object in hand: close, let go, and plan a turn both ways.

The question that a gripper for turning is designed by (`turn_search`), asked of the
whole-gripper model (`ccr_ros.grasp.statics`) and its planner (`ccr_ros.grasp.manipulation`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..grasp.manipulation import MoveLimits, MovePlan, MoveTarget, Waypoint, plan_move
from ..grasp.statics import Body, GraspSolution, GraspSolver, close_with_forces
from ..grasp.statics.body import GRAVITY
from ..model import checks
from ..model.errors import NotConverged
from ..model.files import MountedFinger
from ..model.settings import SolverSettings

FARTHEST = np.deg2rad(90.0)  # a turn is planned no further than this
_TOLERANCE = np.deg2rad(0.2)  # as of a plan


@dataclass(frozen=True, eq=False)
class TurnTask:
    """What a gripper shall hold and turn about its z axis.

    Attributes:
        body: The object where it stands while the fingers close.
        forces: With which each finger presses when it is let go [N]: one, or by finger.
        limits: What the turn keeps (margin, drift, ...).
        gravity: (3,) [m/s^2] in the gripper's frame.
        farthest: A turn ends here [rad].
        stall: A turn ends where ``patience`` steps bring it on by less than this [rad].
        patience: Number of steps.
    """

    body: Body
    forces: float | Mapping[str, float]
    limits: MoveLimits = field(default_factory=MoveLimits)
    gravity: np.ndarray = field(default_factory=lambda: GRAVITY)
    farthest: float = FARTHEST
    stall: float = np.deg2rad(0.5)
    patience: int = 50

    def __post_init__(self) -> None:
        checks.real("farthest", self.farthest, above=0, high=np.pi, unit="rad")
        checks.real("stall", self.stall, low=0, high=np.pi, unit="rad")
        checks.integer("patience", self.patience, low=1, high=100000)


@dataclass(frozen=True, eq=False)
class TurnWay:
    """A turn one way.

    Attributes:
        plan: As far as it goes.
        limiting: What stopped it, in words.
    """

    plan: MovePlan
    limiting: str

    @property
    def angle(self) -> float:
        """About z [rad], positive either way."""
        return abs(float(self.plan.moved[5]))


@dataclass(frozen=True, eq=False)
class TurnResult:
    """What a gripper can do.

    Attributes:
        hold: The object let go, before any turn; None where the fingers did not come to hold it.
        ways: Turned by +z and by -z; empty where it is not held.
        failure: Why it is not held, or empty.
        solver: Where it stands after the object was let go.
    """

    hold: GraspSolution | None
    ways: tuple[TurnWay, ...]
    failure: str
    solver: GraspSolver

    @property
    def held(self) -> bool:
        """Whether the fingers alone hold the object, stable."""
        return not self.failure

    @property
    def angle(self) -> float:
        """The lesser of both turns [rad], 0 where the object is not held."""
        return min((way.angle for way in self.ways), default=0.0)

    def reached(self, angle: float) -> bool:
        """Whether it turns by so much [rad] either way, to a tolerance of 0.2 deg."""
        return self.held and bool(self.angle >= angle - _TOLERANCE)


def evaluate_turn(
    fingers: Sequence[MountedFinger],
    task: TurnTask,
    settings: SolverSettings | None = None,
    goes_on: Callable[[TurnResult], bool] | None = None,
) -> TurnResult:
    """Close fingers on an object, let it go, and plan a turn about z both ways.

    Args:
        fingers: The fingers and their bases.
        task: What they shall do.
        settings: Of the solver.
        goes_on: Called once the object is held and again once it is turned by +z; where it says
            False nothing further is tried.

    Raises:
        InvalidValue, UnknownName: Task and fingers do not fit together.
    """
    solver = GraspSolver(fingers, task.body, settings, task.gravity)
    task.limits.for_solver(solver)
    hold, failure = _hold(solver, task)
    if failure:
        return TurnResult(hold, (), failure, solver)
    result = TurnResult(hold, (), "", solver)
    for sign in (1.0, -1.0):
        if goes_on is not None and not goes_on(result):
            break
        result = replace(result, ways=(*result.ways, _turned(solver, task, sign)))
    return result


def _hold(solver: GraspSolver, task: TurnTask) -> tuple[GraspSolution | None, str]:
    try:
        close_with_forces(solver, task.forces)
    except NotConverged as error:
        return None, str(error)
    solution = solver.let_go()
    if not solution.converged or not solution.stable:
        return None, solution.message
    if any(contact.status == "slip" for contact in solution.contacts):
        return solution, "a contact slips when the object is let go"
    pressing = {contact.finger for contact in solution.contacts}
    idle = [name for name in solver.names if name not in pressing]
    if idle:
        return solution, f"{', '.join(idle)} lets go of the object when its support goes"
    return solution, ""


def _turned(solver: GraspSolver, task: TurnTask, sign: float) -> TurnWay:
    angles: list[float] = []

    def goes_on(waypoint: Waypoint) -> bool:
        angles.append(abs(float(waypoint.moved[5])))
        if len(angles) <= task.patience:
            return True
        return angles[-1] - angles[-1 - task.patience] >= task.stall

    target = MoveTarget(turn=np.array([0.0, 0.0, sign * task.farthest]))
    plan = plan_move(solver, target, task.limits, goes_on)
    limiting = plan.limiting
    if limiting == "stopped by the caller":
        limiting = (
            f"{task.patience} more steps of {task.limits.step * 1e3:g} mm turn it by less than"
            f" {np.rad2deg(task.stall):g} deg{_nearest(plan, task.limits)}"
        )
    return TurnWay(plan, limiting)


def _nearest(plan: MovePlan, limits: MoveLimits) -> str:
    last = plan.waypoints[-1]
    if last.margin < limits.margin + 0.02:
        return ", friction at its limit"
    if last.force < limits.least_force + 0.001:
        return ", a contact force at its least"
    return ""


@dataclass(frozen=True, eq=False)
class TurnRecord:
    """A turn step by step.

    Attributes:
        angles: (k,) about z [rad].
        pulls: (k, M) [m], in the order of ``cables``.
        cables: (M,) names, ``finger.cable``.
        forces: (k, F) sum of each finger's normal forces [N].
        margins: (k, F) smallest friction margin of each finger's contacts; nan without any.
        fingers: (F,) names.
    """

    angles: np.ndarray
    pulls: np.ndarray
    cables: tuple[str, ...]
    forces: np.ndarray
    margins: np.ndarray
    fingers: tuple[str, ...]


def record_turn(result: TurnResult) -> TurnRecord:
    """Walk the plans of a result again, from one end to the other, and note what contacts feel.

    Raises:
        InvalidValue: Nothing is held.
        NotConverged: The way is not found again.
    """
    solver = result.solver
    begin = solver.standing
    rows: list[tuple[float, np.ndarray, np.ndarray, np.ndarray]] = []
    try:
        for way in result.ways:
            solver.resume(begin)
            own = [_row(solver, waypoint) for waypoint in way.plan.waypoints]
            rows = own[:0:-1] + rows if way.plan.target.turn[2] < 0 else rows + own
    finally:
        solver.resume(begin)
    cables = tuple(
        f"{m.finger.name}.{name}" for m in solver.hand.mounted for name in m.finger.cable_names
    )
    angles, pulls, forces, margins = (np.array(column) for column in zip(*rows, strict=True))
    return TurnRecord(angles, pulls, cables, forces, margins, solver.names)


def _row(
    solver: GraspSolver, waypoint: Waypoint
) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
    solution = solver.solve(waypoint.pulls, snap=False).require_converged()
    forces = np.zeros(len(solver.names))
    margins = np.full(len(solver.names), np.nan)
    for contact in solution.contacts:
        index = solver.names.index(contact.finger)
        forces[index] += contact.force
        margins[index] = np.fmin(margins[index], contact.margin)
    pulls = np.concatenate(list(waypoint.pulls.values()))
    return float(waypoint.moved[5]), pulls, forces, margins


def scaled(task: TurnTask, scale: float) -> TurnTask:
    """Return the task with all forces times a factor."""
    if isinstance(task.forces, Mapping):
        return replace(task, forces={name: scale * f for name, f in task.forces.items()})
    return replace(task, forces=scale * task.forces)
