# SPDX-License-Identifier: Apache-2.0
"""The gripper's states, and the events that lead from one to another; nothing moves here."""

from __future__ import annotations

from enum import StrEnum

from transitions import Machine

from ccr_ros.model.errors import CcrError


class State(StrEnum):
    """What the gripper does; the texts are those of ``ccr_msgs/msg/GripperState``."""

    IDLE = "idle"
    OPENING = "opening"
    READY = "ready"
    CLOSING = "closing"
    HOLDING = "holding"
    MOVING = "moving"
    RELEASING = "releasing"
    STOPPED = "stopped"
    FAULT = "fault"


class Event(StrEnum):
    """What may lead from one state to another."""

    OPEN = "open"  # the fingers shall go open before they close
    OPENED = "opened"
    CLOSE = "close"  # a grasp begins; one that is under way gives way to it
    MISS = "miss"  # closed on nothing
    ARRIVE = "arrive"  # closed as far as asked, on nothing, as was allowed
    GRIP = "grip"  # the grasp is done
    HOLD = "hold"  # what is touched shall be held
    ADOPT = "adopt"  # found holding at the start
    REGRIP = "regrip"  # hold on with another force
    MOVE = "move"  # the object that is held shall be moved
    MOVED = "moved"  # as far as it goes; it is held where it is now
    RELEASE = "release"
    RELEASED = "released"
    STOP = "stop"
    FAIL = "fail"
    RESET = "reset"


_WORKING = tuple(state for state in State if state is not State.FAULT)

# The only ways out of HOLDING and MOVING are RELEASE and those that keep all pulls (STOP, FAIL).
# That STOPPED and FAULT do so, and that REGRIP, MOVE and MISS do not loosen a grip, is the
# coordinator's part.
TRANSITIONS: tuple[tuple[Event, tuple[State, ...], State], ...] = (
    (Event.OPEN, (State.IDLE,), State.OPENING),
    (Event.OPENED, (State.OPENING,), State.READY),
    (Event.CLOSE, (State.READY, State.STOPPED, State.CLOSING), State.CLOSING),
    (Event.MISS, (State.CLOSING,), State.OPENING),
    (Event.ARRIVE, (State.CLOSING,), State.READY),
    (Event.GRIP, (State.CLOSING,), State.HOLDING),
    (Event.HOLD, (State.CLOSING, State.STOPPED, State.MOVING), State.HOLDING),
    (Event.ADOPT, (State.IDLE,), State.HOLDING),
    (Event.REGRIP, (State.HOLDING,), State.HOLDING),
    (Event.MOVE, (State.HOLDING, State.MOVING), State.MOVING),
    (Event.MOVED, (State.MOVING,), State.HOLDING),
    (Event.RELEASE, tuple(s for s in _WORKING if s is not State.RELEASING), State.RELEASING),
    (Event.RELEASED, (State.RELEASING,), State.READY),
    (Event.STOP, _WORKING, State.STOPPED),
    (Event.FAIL, _WORKING, State.FAULT),
    (Event.RESET, (State.FAULT,), State.STOPPED),
)


class NotAllowed(CcrError):
    """An event that means nothing in the state the gripper is in.

    Attributes:
        event: The event.
        state: The state.
    """

    def __init__(self, event: Event, state: State) -> None:
        self.event = event
        self.state = state
        super().__init__(f"{event} is not possible while the gripper is {state}")


class GripperMachine:
    """Keeps the state; starts IDLE."""

    def __init__(self) -> None:
        self.state: str = State.IDLE  # written by the library
        self._machine = Machine(
            self,
            states=[str(state) for state in State],
            transitions=[
                [str(event), [str(source) for source in sources], str(target)]
                for event, sources, target in TRANSITIONS
            ],
            initial=str(State.IDLE),
            auto_transitions=False,
        )

    @property
    def now(self) -> State:
        """The state."""
        return State(self.state)

    def may(self, event: Event) -> bool:
        """Tell whether an event leads anywhere from here."""
        return bool(self._machine.get_transitions(str(event), self.state))

    def fire(self, event: Event) -> State:
        """Take an event and return the new state.

        Raises:
            NotAllowed: It leads nowhere from here; the state is as it was.
        """
        if not self.may(event):
            raise NotAllowed(event, self.now)
        self._machine.events[str(event)].trigger(self)
        return self.now
