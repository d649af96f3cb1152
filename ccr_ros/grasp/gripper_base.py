# SPDX-License-Identifier: Apache-2.0
"""What all motions of a gripper need: its fingers, its state, and what is under way."""

from __future__ import annotations

from collections.abc import Sequence

from .closing import Closing
from .finger_control import FingerControl
from .grip import Grip
from .machine import Event, GripperMachine, State
from .motion import ObjectWatch
from .moving import Moving
from .opening import is_open
from .runs import Refused
from .settings import GraspSettings
from .under_way import UnderWay
from .watch import ServoHealth, bridge_trouble, solver_trouble

_IN_MOTION = (State.OPENING, State.CLOSING, State.MOVING, State.RELEASING)


class GripperBase:
    """The gripper as it may be seen, and the changes of its state that several motions share.

    Args:
        fingers: The gripper's fingers.
        settings: Speeds, forces and times.
    """

    def __init__(self, fingers: Sequence[FingerControl], settings: GraspSettings) -> None:
        self.fingers = {finger.name: finger for finger in fingers}
        self.settings = settings
        self.servos = ServoHealth()
        self.thing = ObjectWatch()
        self.grip = Grip(self.fingers, settings)
        self.message = "where the fingers are is not known yet"
        self.refusal = ""
        self._machine = GripperMachine()
        self._runs = UnderWay()
        self._closing: Closing | None = None
        self._moving: Moving | None = None
        self._adopted = False

    # What may be seen

    @property
    def state(self) -> State:
        """What the gripper does."""
        return self._machine.now

    @property
    def phase(self) -> str:
        """``approach`` or ``press`` while closing, ``plan`` or ``go`` while moving, else empty."""
        if self._closing is not None and self.state is State.CLOSING:
            return self._closing.phase
        if self._moving is not None and self.state is State.MOVING:
            return self._moving.phase
        return ""

    @property
    def commanding(self) -> bool:
        """Whether commands must go out."""
        return self.state in (*_IN_MOTION, State.HOLDING)

    @property
    def object_held(self) -> bool:
        """Whether all required fingers touch, with their efforts agreeing, once gripped."""
        return self.grip.committed and self.grip.complete

    def target(self, finger: FingerControl) -> float:
        """Force that a finger is regulated to [N]; 0: it is not."""
        if self.state is State.HOLDING:
            target = self.grip.targets.get(finger.name, 0.0)
            return (target + self.grip.extra) * finger.force_share if target > 0.0 else 0.0
        if self._closing is not None and self.state is State.CLOSING and self.grip.touches(finger):
            return self._closing.target * finger.force_share
        return 0.0

    @property
    def target_force(self) -> float:
        """Target level of the grasp that is under way or holds [N]; 0: none."""
        if self._runs.grasp is not None:
            return self._runs.grasp.goal.force + self.grip.extra
        fingers = self.fingers.values()
        return max((self.target(f) / f.force_share for f in fingers), default=0.0)

    def release_in(self, now: float) -> float:
        """Return the time until a waiting release begins [s]; negative: none waits."""
        run = self._runs.release
        if run is None or self.state is State.RELEASING:
            return -1.0
        return max(0.0, run.started + run.goal.delay - now)

    # Changes

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

    def _not_gripped(self) -> str:
        names = [f.name for f in self.grip.needed if not self.grip.agrees(f)]
        return f"nothing is gripped: {', '.join(names)} does not press"

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
