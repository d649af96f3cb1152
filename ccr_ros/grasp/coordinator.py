# SPDX-License-Identifier: Apache-2.0
"""The gripper as a whole: takes goals and calls, moves the fingers step by step, answers."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ccr_ros.model.errors import CcrError

from .closing import Closing, Verdict
from .finger_control import FingerControl
from .gripper_base import GripperBase
from .machine import Event, State
from .margin_keeper import MarginKeeper
from .move_path import MovePath
from .moves import MoveGoal, MoveRun
from .moving import Moving
from .opening import Opening
from .progress import Lasting
from .runs import End, GraspGoal, Outcome, ReleaseGoal, Run
from .settings import GraspSettings
from .watch import bridge_trouble, solver_trouble

_FEELING = (State.CLOSING, State.HOLDING, State.MOVING)  # what is touched must be known
_LONGEST_STEP = 0.1  # s; a step that comes late moves no farther than this allows


class GripperCoordinator(GripperBase):
    """Grasps, holds, moves what is held, and lets go.

    What is heard goes into ``fingers``, ``servos`` and ``thing``; `step` is called at a steady
    rate and moves the commands, which are `FingerControl.command`. Times are seconds of one steady
    clock.

    Args:
        fingers: The gripper's fingers.
        settings: Speeds, forces and times.
    """

    def __init__(self, fingers: Sequence[FingerControl], settings: GraspSettings) -> None:
        super().__init__(fingers, settings)
        self._keeper = MarginKeeper(self.grip, self.thing, settings)
        self._opening: Opening | None = None
        self._pressed = Lasting()
        self._stepped_at: float | None = None

    # What is asked

    def grasp(self, goal: GraspGoal, now: float) -> Run[GraspGoal]:
        """Begin to grasp; a grasp under way gives way to this one.

        Raises:
            Refused: Not in this state, or the fingers cannot be moved or felt.
        """
        self._may(Event.CLOSE, now)
        if self._runs.release is not None:
            raise self._refuse("a release is due; cancel it first")
        if trouble := solver_trouble(self.fingers.values(), now, self.settings):
            raise self._refuse(trouble)
        if self.state is State.HOLDING:
            missing = [n for n in goal.required if not self.grip.touches(self.fingers[n])]
            if missing or goal.thing not in ("", self.grip.thing):
                raise self._refuse("something else is held; release it first")
        self._runs.end_grasp(Outcome(End.FAILED, "a newer grasp took its place"))
        run = self._runs.grasp = Run(goal, now)
        self.refusal = ""
        if self.state is State.HOLDING:
            self.grip.commit(goal.force)
            self._fire(Event.REGRIP, "holding with another force")
            self._pressed = Lasting()
        elif self.state is State.IDLE and not self._is_open():
            self._adopt()
            self._begin_opening(Event.OPEN, "opening before the grasp", now)
        elif self.state is not State.OPENING:
            if self.state is State.IDLE:
                self._fire(Event.OPEN, "open")
                self._fire(Event.OPENED, "open")
            self._begin_closing()
        return run

    def release(self, goal: ReleaseGoal, now: float) -> Run[ReleaseGoal]:
        """Let go, now or after the goal's delay; a release that waits gives way to this one.

        Raises:
            Refused: Not in this state, or the fingers cannot be moved.
        """
        self._may(Event.RELEASE, now)
        self._runs.end_release(Outcome(End.FAILED, "a newer release took its place"))
        self._runs.release = Run(goal, now)
        self.refusal = ""
        return self._runs.release

    def move(self, goal: MoveGoal, now: float) -> MoveRun:
        """Begin to move what is held; a motion under way gives way to this one.

        Raises:
            Refused: Nothing is held, or it is not known how; or the fingers cannot be moved.
        """
        self._may(Event.MOVE, now)
        if self._runs.release is not None:
            raise self._refuse("a release is due; cancel it first")
        trouble = solver_trouble(self.fingers.values(), now, self.settings)
        if trouble := trouble or self.thing.trouble(now, self.settings):
            raise self._refuse(trouble)
        thing, least = self.thing.newest, self.settings.move_stop_margin
        if thing is not None and thing.name != (self.grip.thing or thing.name):
            raise self._refuse(f"the solver tells of {thing.name!r}, held is {self.grip.thing!r}")
        if thing is not None and thing.margin < least:
            raise self._refuse(f"friction margin: {thing.margin:.3f} is below {least:g}")
        if not self.grip.complete:
            raise self._refuse(self._not_gripped())
        self._runs.end_grasp(Outcome(End.FAILED, "a motion came"))
        self._runs.end_move(Outcome(End.FAILED, "a newer motion took its place"))
        run = self._runs.move = MoveRun(goal, now)
        self.refusal = ""
        self._moving = Moving(self.fingers, self.grip, self.thing, run, self.settings, now)
        self._fire(Event.MOVE, "moving the object")
        return run

    @property
    def plan_wanted(self) -> MoveRun | None:
        """The motion that a plan is waited for; None: none."""
        moving = self._moving
        if moving is None or self.state is not State.MOVING or not moving.wants_plan:
            return None
        return moving.run

    def take_plan(self, run: MoveRun, answer: MovePath | CcrError) -> None:
        """Take the plan of a motion, or why there is none; too late for another motion than now."""
        if self._moving is not None and self.plan_wanted is run:
            self._moving.take(answer)

    def cancel(self, run: Run[GraspGoal] | Run[ReleaseGoal] | MoveRun) -> None:
        """Give up a run: the fingers keep the pulls they have, and with them what they grip."""
        if run is self._runs.grasp:
            self._runs.end_grasp(
                Outcome(End.CANCELED, "cancelled; the fingers keep what they grip")
            )
            if self.state is State.HOLDING:
                self.grip.commit(None)
            else:
                self._freeze(Event.STOP, "the grasp was cancelled")
        elif run is self._runs.release:
            begun = self.state is State.RELEASING
            self._runs.end_release(
                Outcome(End.CANCELED, "cancelled" if begun else "kept: cancelled")
            )
            if begun:
                self._freeze(Event.STOP, "the release was cancelled")
        elif run is self._runs.move:
            text = "cancelled; the object is held where it is"
            self._runs.end_move(Outcome(End.CANCELED, text))
            self.grip.commit(None)
            self._fire(Event.MOVED, text)

    def stop(self) -> str:
        """Freeze all fingers where they are; nothing is let go of, and a waiting release is off."""
        self._runs.end_all("stopped")
        if self.state is State.FAULT:
            return f"nothing moves: {self.message}"
        self._freeze(Event.STOP, "stopped")
        return "stopped; the fingers keep what they grip"

    def hold(self, now: float) -> str:
        """Hold what is touched, each finger with the force it has; a waiting release is off.

        Raises:
            Refused: Not in this state, or the grip is not complete.
        """
        if self.state is State.MOVING:
            self._runs.end_all("held where it is")
            self.grip.commit(None)
            self._fire(Event.HOLD, "holding")
        elif self.state is not State.HOLDING:
            self._may(Event.HOLD, now)
            if trouble := solver_trouble(self.fingers.values(), now, self.settings):
                raise self._refuse(trouble)
            if not self.grip.complete:
                raise self._refuse(self._not_gripped())
            self._take_up()
            self.grip.commit(None)
            self._runs.end_all("held as it is")
            self._fire(Event.HOLD, "holding")
        else:
            self._runs.end_release(Outcome(End.FAILED, "off: hold was called"))
        self.refusal = ""
        return "holding"

    def reset(self, now: float) -> str:
        """Leave FAULT for STOPPED, without motion.

        Raises:
            Refused: The servo bridge is still silent or not active.
        """
        if self.state is not State.FAULT:
            return f"there is no fault; the gripper is {self.state}"
        if trouble := bridge_trouble(self.fingers.values(), self.servos, now, self.settings):
            raise self._refuse(trouble)
        self.refusal = ""
        self._take_up()
        self._fire(Event.RESET, "reset; the fingers keep what they grip")
        return self.message

    # The step

    def step(self, now: float) -> None:
        """Look at what was heard, and move the commands by as much as the time since allows."""
        before = now if self._stepped_at is None else self._stepped_at
        seconds, self._stepped_at = min(max(now - before, 0.0), _LONGEST_STEP), now
        if not self._adopted:
            self._find_out(now)
            return
        if trouble := self._trouble(now):
            self._runs.end_all(trouble)
            self._freeze(Event.FAIL, trouble)
            return
        run = self._runs.release
        if run is not None and self.release_in(now) == 0.0:
            self._begin_releasing(run.goal, now)
        if self.state in (State.OPENING, State.RELEASING) and self._opening is not None:
            self._open_on(self._opening, now, seconds)
        elif self.state is State.CLOSING and self._closing is not None:
            self._take(self._closing.step(now, seconds), now)
        elif self.state is State.HOLDING:
            self._hold_on(now)
        elif self.state is State.MOVING and self._moving is not None:
            self._take_move(self._moving.step(now, seconds))
        if (
            self._runs.grasp is not None
            and now - self._runs.grasp.started > self._runs.grasp.goal.timeout
        ):
            self._time_out()

    def _find_out(self, now: float) -> None:
        """Adopt the pulls once all fingers are known, and what they hold."""
        fingers = list(self.fingers.values())
        tolerance = self.settings.place_tolerance
        if bridge_trouble(fingers, self.servos, now, self.settings):
            return
        if solver_trouble(fingers, now, self.settings):
            return
        if any(abs(f.solved_place - f.measured_place) > tolerance for f in fingers):
            return  # the solver has not come to these pulls yet
        self._adopted = True
        self._adopt()
        if self.grip.complete:
            self.grip.commit(None)
            self._fire(Event.ADOPT, "found holding")
        elif any(self.grip.touches(finger) for finger in fingers):
            self._fire(Event.STOP, "found touching something")
        else:
            self.message = "ready for a grasp"

    def _trouble(self, now: float) -> str:
        fingers = self.fingers.values()
        if not self.commanding:
            return ""
        trouble = bridge_trouble(fingers, self.servos, now, self.settings)
        if not trouble and self.state in _FEELING:
            trouble = solver_trouble(fingers, now, self.settings)
        return trouble

    def _open_on(self, opening: Opening, now: float, seconds: float) -> None:
        if opening.step(now, seconds):
            if self.state is State.RELEASING:
                self._fire(Event.RELEASED, "open")
                self._runs.end_release(Outcome(End.DONE, "released", reached=True))
                return
            self._fire(Event.OPENED, self.message)
            if self._runs.grasp is not None:
                self._begin_closing()
        elif trouble := opening.trouble(now):
            self._runs.end_all(trouble, stalled=True)
            self._freeze(Event.STOP, trouble)

    def _hold_on(self, now: float) -> None:
        self._keeper.step()
        carried = self.thing.fresh is not None
        if lost := self.grip.hold(now, carried):
            reason = f"{lost} lost the object"
            self._runs.end_all(reason)
            self._freeze(Event.FAIL, reason)
            return
        run = self._runs.grasp
        if run is None:
            return
        near = self.grip.miss(carried) <= self.settings.force_tolerance and all(
            self.grip.known(finger) for finger in self.grip.needed
        )
        if self._pressed.holds(near and self.grip.complete, now, self.settings.settle_time):
            self._runs.end_grasp(Outcome(End.DONE, "held with the new force", reached=True))

    def _time_out(self) -> None:
        if self._runs.grasp is not None:
            text = f"not done within {self._runs.grasp.goal.timeout:g} s"
            self._runs.end_grasp(Outcome(End.FAILED, text, stalled=True))
            if self.state is not State.HOLDING:
                self._freeze(Event.STOP, text)

    def _take(self, verdict: Verdict | None, now: float) -> None:
        if verdict is None or self._runs.grasp is None:
            return
        goal, message = self._runs.grasp.goal, verdict.outcome.message
        self._runs.end_grasp(verdict.outcome)
        if verdict.event is Event.GRIP:
            self.grip.commit(goal.force)
            self._fire(Event.GRIP, message)
        elif verdict.event is Event.MISS:
            self._begin_opening(Event.MISS, message, now)
        elif verdict.event is Event.ARRIVE:
            self._fire(Event.ARRIVE, message)
        else:
            self._freeze(verdict.event, message)

    def _take_move(self, verdict: Verdict | None) -> None:
        if verdict is None:
            return
        self._runs.end_move(verdict.outcome)
        if verdict.event is Event.MOVED:
            self.grip.commit(None)
            self._fire(Event.MOVED, verdict.outcome.message)
        else:
            self._runs.end_all(verdict.outcome.message)
            self._freeze(verdict.event, verdict.outcome.message)

    # Changes

    def _begin_closing(self) -> None:
        if self._runs.grasp is None:
            return
        goal = self._runs.grasp.goal
        self._take_up()
        self.grip.thing, self.grip.required = goal.thing, goal.required
        self._closing = Closing(self.fingers, self.grip, goal, self.settings)
        self._fire(Event.CLOSE, "closing")

    def _begin_opening(self, event: Event, message: str, now: float) -> None:
        speed = self.settings.open_speed
        self._opening = Opening(self.fingers, self.settings, speed, math.inf, now)
        self._fire(event, message)

    def _begin_releasing(self, goal: ReleaseGoal, now: float) -> None:
        self._runs.end_grasp(Outcome(End.FAILED, "a release came"))
        self._runs.end_move(Outcome(End.FAILED, "a release came", limiting="a release came"))
        self._take_up()
        self.grip.clear()
        fast, slow = self.settings.fast_release_speed, self.settings.slow_release_speed
        speed = fast if goal.fast else slow
        self._opening = Opening(self.fingers, self.settings, speed, goal.gap, now)
        self._fire(Event.RELEASE, "letting go")
