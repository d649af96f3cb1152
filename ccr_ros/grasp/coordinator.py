# SPDX-License-Identifier: Apache-2.0
"""The gripper as a whole: takes goals and calls, moves the fingers step by step, answers."""

from __future__ import annotations

import math
from collections.abc import Sequence

from .closing import Closing, Verdict
from .finger_control import FingerControl
from .grip import Grip
from .machine import Event, GripperMachine, State
from .opening import Opening, is_open
from .progress import Lasting
from .runs import End, GraspGoal, Outcome, Refused, ReleaseGoal, Run
from .settings import GraspSettings
from .watch import ServoHealth, bridge_trouble, solver_trouble

_LONGEST_STEP = 0.1  # s; a step that comes late moves no farther than this allows
_MOVING = (State.OPENING, State.CLOSING, State.RELEASING)


class GripperCoordinator:
    """Grasps, holds and lets go.

    What is heard goes into ``fingers`` and ``servos``; `step` is called at a steady rate and moves
    the commands, which are `FingerControl.command`. Times are seconds of one steady clock.

    Args:
        fingers: The gripper's fingers.
        settings: Speeds, forces and times.
    """

    def __init__(self, fingers: Sequence[FingerControl], settings: GraspSettings) -> None:
        self.fingers = {finger.name: finger for finger in fingers}
        self.settings = settings
        self.servos = ServoHealth()
        self.grip = Grip(self.fingers, settings)
        self.message = "where the fingers are is not known yet"
        self.refusal = ""
        self._machine = GripperMachine()
        self._closing: Closing | None = None
        self._grasp: Run[GraspGoal] | None = None  # under way
        self._release: Run[ReleaseGoal] | None = None  # waiting for its time, or under way
        self._opening: Opening | None = None
        self._pressed = Lasting()
        self._adopted = False
        self._stepped_at: float | None = None

    # What may be seen

    @property
    def state(self) -> State:
        """What the gripper does."""
        return self._machine.now

    @property
    def phase(self) -> str:
        """``approach`` or ``press`` while closing, else empty."""
        return self._closing.phase if self._closing and self.state is State.CLOSING else ""

    @property
    def commanding(self) -> bool:
        """Whether commands must go out."""
        return self.state in (*_MOVING, State.HOLDING)

    @property
    def object_held(self) -> bool:
        """Whether all required fingers touch, with their efforts agreeing, once gripped."""
        return self.grip.committed and self.grip.complete

    def target(self, finger: FingerControl) -> float:
        """Force that a finger is regulated to [N]; 0: it is not."""
        if self.state is State.HOLDING:
            return self.grip.targets.get(finger.name, 0.0)
        if self._closing is not None and self.state is State.CLOSING and self.grip.touches(finger):
            return self._closing.target
        return 0.0

    @property
    def target_force(self) -> float:
        """Target of the grasp that is under way or holds [N]; 0: none."""
        if self._grasp is not None:
            return self._grasp.goal.force
        return max(self.grip.targets.values(), default=0.0) if self.state is State.HOLDING else 0.0

    def release_in(self, now: float) -> float:
        """Return the time until a waiting release begins [s]; negative: none waits."""
        run = self._release
        if run is None or self.state is State.RELEASING:
            return -1.0
        return max(0.0, run.started + run.goal.delay - now)

    # What is asked

    def grasp(self, goal: GraspGoal, now: float) -> Run[GraspGoal]:
        """Begin to grasp; a grasp under way gives way to this one.

        Raises:
            Refused: Not in this state, or the fingers cannot be moved or felt.
        """
        self._may(Event.CLOSE, now)
        if self._release is not None:
            raise self._refuse("a release is due; cancel it first")
        if trouble := solver_trouble(self.fingers.values(), now, self.settings):
            raise self._refuse(trouble)
        if self.state is State.HOLDING:
            missing = [n for n in goal.required if not self.grip.touches(self.fingers[n])]
            if missing or goal.thing not in ("", self.grip.thing):
                raise self._refuse("something else is held; release it first")
        self._end_grasp(Outcome(End.FAILED, "a newer grasp took its place"))
        run = self._grasp = Run(goal, now)
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
        self._end_release(Outcome(End.FAILED, "a newer release took its place"))
        self._release = Run(goal, now)
        self.refusal = ""
        return self._release

    def cancel(self, run: Run[GraspGoal] | Run[ReleaseGoal]) -> None:
        """Give up a run: the fingers keep the pulls they have, and with them what they grip."""
        if run is self._grasp:
            self._end_grasp(Outcome(End.CANCELED, "cancelled; the fingers keep what they grip"))
            if self.state is State.HOLDING:
                self.grip.commit(None)
            else:
                self._freeze(Event.STOP, "the grasp was cancelled")
        elif run is self._release:
            begun = self.state is State.RELEASING
            self._end_release(Outcome(End.CANCELED, "cancelled" if begun else "kept: cancelled"))
            if begun:
                self._freeze(Event.STOP, "the release was cancelled")

    def stop(self) -> str:
        """Freeze all fingers where they are; nothing is let go of, and a waiting release is off."""
        self._end_all("stopped")
        if self.state is State.FAULT:
            return f"nothing moves: {self.message}"
        self._freeze(Event.STOP, "stopped")
        return "stopped; the fingers keep what they grip"

    def hold(self, now: float) -> str:
        """Hold what is touched, each finger with the force it has; a waiting release is off.

        Raises:
            Refused: Not in this state, or the grip is not complete.
        """
        if self.state is not State.HOLDING:
            self._may(Event.HOLD, now)
            if trouble := solver_trouble(self.fingers.values(), now, self.settings):
                raise self._refuse(trouble)
            if not self.grip.complete:
                names = [f.name for f in self.grip.needed if not self.grip.agrees(f)]
                raise self._refuse(f"nothing is gripped: {', '.join(names)} does not press")
            self._take_up()
            self.grip.commit(None)
            self._end_all("held as it is")
            self._fire(Event.HOLD, "holding")
        else:
            self._end_release(Outcome(End.FAILED, "off: hold was called"))
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
            self._end_all(trouble)
            self._freeze(Event.FAIL, trouble)
            return
        run = self._release
        if run is not None and self.release_in(now) == 0.0:
            self._begin_releasing(run.goal, now)
        if self.state in (State.OPENING, State.RELEASING) and self._opening is not None:
            self._open_on(self._opening, now, seconds)
        elif self.state is State.CLOSING and self._closing is not None:
            self._take(self._closing.step(now, seconds), now)
        elif self.state is State.HOLDING:
            self._hold_on(now)
        if self._grasp is not None and now - self._grasp.started > self._grasp.goal.timeout:
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
        if not trouble and self.state in (State.CLOSING, State.HOLDING):
            trouble = solver_trouble(fingers, now, self.settings)
        return trouble

    def _open_on(self, opening: Opening, now: float, seconds: float) -> None:
        if opening.step(now, seconds):
            if self.state is State.RELEASING:
                self._fire(Event.RELEASED, "open")
                self._end_release(Outcome(End.DONE, "released", reached=True))
                return
            self._fire(Event.OPENED, self.message)
            if self._grasp is not None:
                self._begin_closing()
        elif trouble := opening.trouble(now):
            self._end_all(trouble, stalled=True)
            self._freeze(Event.STOP, trouble)

    def _hold_on(self, now: float) -> None:
        if lost := self.grip.hold(now):
            reason = f"{lost} lost the object"
            self._end_all(reason)
            self._freeze(Event.FAIL, reason)
            return
        run = self._grasp
        if run is None:
            return
        tolerance = self.settings.force_tolerance
        near = all(
            abs(self.grip.force(f) - run.goal.force) <= tolerance and self.grip.known(f)
            for f in self.grip.needed
        )
        if self._pressed.holds(near and self.grip.complete, now, self.settings.settle_time):
            self._end_grasp(Outcome(End.DONE, "held with the new force", reached=True))

    def _time_out(self) -> None:
        if self._grasp is not None:
            text = f"not done within {self._grasp.goal.timeout:g} s"
            self._end_grasp(Outcome(End.FAILED, text, stalled=True))
            if self.state is not State.HOLDING:
                self._freeze(Event.STOP, text)

    def _take(self, verdict: Verdict | None, now: float) -> None:
        if verdict is None or self._grasp is None:
            return
        goal, message = self._grasp.goal, verdict.outcome.message
        self._end_grasp(verdict.outcome)
        if verdict.event is Event.GRIP:
            self.grip.commit(goal.force)
            self._fire(Event.GRIP, message)
        elif verdict.event is Event.MISS:
            self._begin_opening(Event.MISS, message, now)
        elif verdict.event is Event.ARRIVE:
            self._fire(Event.ARRIVE, message)
        else:
            self._freeze(verdict.event, message)

    # Changes

    def _begin_closing(self) -> None:
        if self._grasp is None:
            return
        goal = self._grasp.goal
        self._take_up()
        self.grip.thing, self.grip.required = goal.thing, goal.required
        self._closing = Closing(self.fingers, self.grip, goal, self.settings)
        self._fire(Event.CLOSE, "closing")

    def _begin_opening(self, event: Event, message: str, now: float) -> None:
        speed = self.settings.open_speed
        self._opening = Opening(self.fingers, self.settings, speed, math.inf, now)
        self._fire(event, message)

    def _begin_releasing(self, goal: ReleaseGoal, now: float) -> None:
        self._end_grasp(Outcome(End.FAILED, "a release came"))
        self._take_up()
        self.grip.clear()
        fast, slow = self.settings.fast_release_speed, self.settings.slow_release_speed
        speed = fast if goal.fast else slow
        self._opening = Opening(self.fingers, self.settings, speed, goal.gap, now)
        self._fire(Event.RELEASE, "letting go")

    def _take_up(self) -> None:
        """Continue from where the fingers are; from the command where a grip depends on it."""
        if self.commanding:
            return
        for finger in self.fingers.values():
            if self.grip.committed:
                finger.freeze(self.settings.place_tolerance)
                finger.place = min(finger.place, finger.measured_place + self.settings.max_lead)
            else:
                finger.adopt()

    def _adopt(self) -> None:
        for finger in self.fingers.values():
            finger.adopt()

    def _freeze(self, event: Event, message: str) -> None:
        for finger in self.fingers.values():
            finger.freeze(self.settings.place_tolerance)
        self._fire(event, message)

    def _is_open(self) -> bool:
        return is_open(tuple(self.fingers.values()), self.settings.place_tolerance)

    def _fire(self, event: Event, message: str) -> None:
        self._machine.fire(event)
        self.message = message

    def _may(self, event: Event, now: float) -> None:
        state = self.state
        if not self._adopted:
            raise self._refuse(self._unknown(now))
        grasping = event is Event.CLOSE and state in (State.IDLE, State.OPENING, State.HOLDING)
        if not grasping and not self._machine.may(event):
            hint = f" ({self.message}); reset it first" if state is State.FAULT else ""
            raise self._refuse(f"the gripper is {state}{hint}")
        if trouble := bridge_trouble(self.fingers.values(), self.servos, now, self.settings):
            raise self._refuse(trouble)

    def _unknown(self, now: float) -> str:
        fingers = self.fingers.values()
        return (
            bridge_trouble(fingers, self.servos, now, self.settings)
            or solver_trouble(fingers, now, self.settings)
            or "the solver has not come to the measured pulls yet"
        )

    def _refuse(self, reason: str) -> Refused:
        self.refusal = reason
        return Refused(reason)

    def _end_grasp(self, outcome: Outcome) -> None:
        run, self._grasp = self._grasp, None
        if run is not None:
            run.finish(outcome)

    def _end_release(self, outcome: Outcome) -> None:
        run, self._release = self._release, None
        if run is not None:
            run.finish(outcome)

    def _end_all(self, reason: str, stalled: bool = False) -> None:
        outcome = Outcome(End.FAILED, reason, stalled=stalled)
        self._end_grasp(outcome)
        self._end_release(outcome)
