# SPDX-License-Identifier: Apache-2.0
"""The goals of an action server and the states that they go through."""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from typing import TYPE_CHECKING, Any

from action_msgs.msg import GoalStatus

from .._rclpy_pybind11 import RCLError
from ..task import Future

if TYPE_CHECKING:
    from ..action.server import ActionServer


class GoalEvent(IntEnum):
    """What changes the state of a goal."""

    EXECUTE = 0
    CANCEL_GOAL = 1
    SUCCEED = 2
    ABORT = 3
    CANCELED = 4


ACCEPTED, EXECUTING, CANCELING, SUCCEEDED, CANCELED, ABORTED = range(1, 7)
_STATES = ("UNKNOWN", "ACCEPTED", "EXECUTING", "CANCELING", "SUCCEEDED", "CANCELED", "ABORTED")
_TRANSITIONS = {
    (ACCEPTED, GoalEvent.EXECUTE): EXECUTING,
    (ACCEPTED, GoalEvent.CANCEL_GOAL): CANCELING,
    (EXECUTING, GoalEvent.CANCEL_GOAL): CANCELING,
    (EXECUTING, GoalEvent.SUCCEED): SUCCEEDED,
    (EXECUTING, GoalEvent.ABORT): ABORTED,
    (CANCELING, GoalEvent.SUCCEED): SUCCEEDED,
    (CANCELING, GoalEvent.ABORT): ABORTED,
    (CANCELING, GoalEvent.CANCELED): CANCELED,
}


class ServerGoalHandle:
    """A goal that the server accepted. States change as rcl_action's state machine allows."""

    def __init__(self, action_server: ActionServer, goal_info: Any, goal_request: Any) -> None:
        self._action_server = action_server
        self._goal_info = goal_info
        self._goal_request = goal_request
        self._state = ACCEPTED
        self._result = Future()
        #: the server's, so that status messages tell of changes in their order
        self._lock = action_server._lock

    def __eq__(self, other: Any) -> bool:
        return bool(self.goal_id == other.goal_id)

    @property
    def request(self) -> Any:
        """The goal."""
        return self._goal_request

    @property
    def goal_id(self) -> Any:
        """The goal's UUID message."""
        return self._goal_info.goal_id

    @property
    def is_active(self) -> bool:
        """Whether the goal has not ended."""
        return self._state in (ACCEPTED, EXECUTING, CANCELING)

    @property
    def _cancelable(self) -> bool:
        return self._state in (ACCEPTED, EXECUTING)

    @property
    def is_cancel_requested(self) -> bool:
        """Whether the goal is to end by :meth:`canceled`."""
        return self._state == CANCELING

    @property
    def status(self) -> int:
        """A constant of GoalStatus; STATUS_UNKNOWN once the goal has expired."""
        return self._state

    def _update_state(self, event: GoalEvent) -> None:
        with self._lock:
            if self._state == GoalStatus.STATUS_UNKNOWN:  # destroyed
                return
            new = _TRANSITIONS.get((self._state, event))
            if new is None:
                raise RCLError(
                    f"Failed to update goal state: goal_handle attempted invalid transition from "
                    f"state {_STATES[self._state]} with event {event.name}"
                )
            self._state = new
            self._action_server._publish_status()
            if not self.is_active:
                self._action_server.notify_goal_done()

    def execute(self, execute_callback: Callable[[Any], Any] | None = None) -> None:
        """Have the executor run the goal, with the server's callback unless another is given.

        :raises RCLError: the goal is executing already, or has ended.
        """
        # A goal may be canceled before it is executed; the callback then sees to that.
        if not self.is_cancel_requested:
            self._update_state(GoalEvent.EXECUTE)
        self._action_server.notify_execute(self, execute_callback)

    def publish_feedback(self, feedback: Any) -> None:
        """Tell the clients how far the goal is.

        :raises TypeError: the feedback is of another type than the action's.
        """
        action_type = self._action_server.action_type
        if not isinstance(feedback, action_type.Feedback):
            raise TypeError(f"Expected {action_type.Feedback}, got {type(feedback)}")
        if self._state != GoalStatus.STATUS_UNKNOWN:
            message = action_type.Impl.FeedbackMessage(goal_id=self.goal_id, feedback=feedback)
            self._action_server._feedback.publish(message)

    def succeed(self) -> None:
        """End with success. :raises RCLError: the goal has ended, or was not executed."""
        self._update_state(GoalEvent.SUCCEED)

    def abort(self) -> None:
        """End with failure. :raises RCLError: the goal has ended, or was not executed."""
        self._update_state(GoalEvent.ABORT)

    def canceled(self) -> None:
        """End as canceled. :raises RCLError: nobody has requested that."""
        self._update_state(GoalEvent.CANCELED)

    def destroy(self) -> None:
        """Forget the goal: its state is unknown from now on, and does not change."""
        with self._lock:
            self._state = GoalStatus.STATUS_UNKNOWN
