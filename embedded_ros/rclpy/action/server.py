# SPDX-License-Identifier: Apache-2.0
"""Action servers."""

from __future__ import annotations

import threading
import traceback
from collections.abc import Callable
from enum import Enum
from typing import TYPE_CHECKING, Any

from action_msgs.msg import GoalInfo, GoalStatus
from action_msgs.srv import CancelGoal

from .._rclpy_pybind11 import RCLError
from ..callback_groups import CallbackGroup
from ..constants import S_TO_NS
from ..event_handler import PublisherEventCallbacks
from ..impl.action_end import ActionEnd, AnsweringService
from ..impl.queued import await_or_execute
from ..impl.server_goal import GoalEvent, ServerGoalHandle
from ..publisher import Publisher
from ..qos import QoSProfile, qos_profile_action_status_default, qos_profile_services_default
from ..waitable import NumberOfEntities

if TYPE_CHECKING:
    from ..node import Node

_Callback = Callable[[Any], Any]
_Respond = Callable[[Any], bool]


class GoalResponse(Enum):
    """Answers to a new goal."""

    REJECT = 1
    ACCEPT = 2


class CancelResponse(Enum):
    """Answers to a request to cancel a goal."""

    REJECT = 1
    ACCEPT = 2


def default_handle_accepted_callback(goal_handle: ServerGoalHandle) -> None:
    """Execute the goal."""
    goal_handle.execute()


def default_goal_callback(goal_request: Any) -> GoalResponse:
    """Accept every goal."""
    return GoalResponse.ACCEPT


def default_cancel_callback(cancel_request: Any) -> CancelResponse:
    """Cancel no goal."""
    return CancelResponse.REJECT


def _nanoseconds(goal_info: Any) -> int:
    return int(goal_info.stamp.sec * S_TO_NS + goal_info.stamp.nanosec)


class ActionServer(ActionEnd):
    """Executes goals for action clients."""

    def __init__(
        self,
        node: Node,
        action_type: Any,
        action_name: str,
        execute_callback: _Callback,
        *,
        callback_group: CallbackGroup | None = None,
        goal_callback: _Callback | None = default_goal_callback,
        handle_accepted_callback: _Callback | None = default_handle_accepted_callback,
        cancel_callback: _Callback | None = default_cancel_callback,
        goal_service_qos_profile: QoSProfile = qos_profile_services_default,
        result_service_qos_profile: QoSProfile = qos_profile_services_default,
        cancel_service_qos_profile: QoSProfile = qos_profile_services_default,
        feedback_pub_qos_profile: QoSProfile = QoSProfile(depth=10),  # noqa: B008 - as in rclpy
        status_pub_qos_profile: QoSProfile = qos_profile_action_status_default,
        result_timeout: float = 900,
    ) -> None:
        """Create a server. Callbacks may be coroutine functions.

        :param execute_callback: takes the goal handle, ends the goal and returns its result; a goal
            that it did not end, or in which it raised, is aborted.
        :param goal_callback: takes the goal, returns a :class:`GoalResponse`.
        :param handle_accepted_callback: takes the handle of an accepted goal, and calls its
            ``execute()`` now or later.
        :param cancel_callback: takes the handle, returns a :class:`CancelResponse`.
        :param result_timeout: how long an ended goal is kept, s, counted from its acceptance.
        :raises AttributeError: ``action_type`` is no ROS interface.
        :raises ValueError: the action name is invalid, or ``result_timeout`` negative.
        """
        super().__init__(node, action_type, action_name, callback_group, "server")
        self._lock = threading.RLock()
        self.register_handle_accepted_callback(handle_accepted_callback)
        self.register_goal_callback(goal_callback)
        self.register_cancel_callback(cancel_callback)
        self.register_execute_callback(execute_callback)
        if result_timeout < 0:
            raise ValueError(f"result_timeout must be non-negative, got {result_timeout} s")
        self._result_timeout = int(result_timeout * S_TO_NS)
        self._next_expiry: int | None = None
        self._goal_handles: dict[bytes, ServerGoalHandle] = {}
        # Publishers first: another thread may be spinning the node, and services call back.
        types = action_type.Impl
        self._feedback = self._publish(types.FeedbackMessage, "feedback", feedback_pub_qos_profile)
        self._status = self._publish(types.GoalStatusMessage, "status", status_pub_qos_profile)
        for name, service, callback, qos in (
            ("get_result", types.GetResultService, self._on_result, result_service_qos_profile),
            ("cancel_goal", types.CancelGoalService, self._on_cancel, cancel_service_qos_profile),
            ("send_goal", types.SendGoalService, self._on_goal, goal_service_qos_profile),
        ):
            self._serve(name, service, callback, qos)
        node.add_waitable(self)

    def _publish(self, msg_type: Any, name: str, qos: QoSProfile) -> Publisher:
        quiet = PublisherEventCallbacks(use_default_callbacks=False)
        topic = self._prefix + name
        publisher = self._node.create_publisher(msg_type, topic, qos, event_callbacks=quiet)
        self._destroyers[publisher] = self._node.destroy_publisher
        return publisher

    def _serve(self, name: str, srv_type: Any, callback: Any, qos: QoSProfile) -> None:
        full, node = self._prefix + name, self._node
        service = AnsweringService(node, srv_type, full, callback, self.callback_group, qos)
        self._destroyers[service] = node.destroy_service
        node._ros_keep(service, node._services)

    @property
    def action_type(self) -> Any:
        """The action class."""
        return self._action_type

    def get_num_entities(self) -> NumberOfEntities:
        return NumberOfEntities(num_timers=1, num_services=3)

    # --- what clients ask for

    async def _on_goal(self, request: Any, respond: _Respond) -> None:
        info = GoalInfo(goal_id=request.goal_id)
        key = bytes(request.goal_id.uuid)
        handle: ServerGoalHandle | None = None
        if key not in self._goal_handles:
            answer = await await_or_execute(self._goal_callback, request.goal)
            if answer == GoalResponse.ACCEPT:
                info.stamp = self._node.get_clock().now().to_msg()
                handle = ServerGoalHandle(self, info, request.goal)
                with self._lock:
                    # The same goal may have come in again while the callback ran.
                    if self._goal_handles.setdefault(key, handle) is not handle:
                        handle = None
            elif not isinstance(answer, GoalResponse):
                self._logger.warning(
                    "Goal request callback did not return a GoalResponse type. Rejecting goal."
                )
        response = self._action_type.Impl.SendGoalService.Response
        if respond(response(accepted=handle is not None, stamp=info.stamp)) and handle is not None:
            await await_or_execute(self._accepted_callback, handle)

    def _to_cancel(self, wanted: Any) -> tuple[list[ServerGoalHandle], int]:
        """The goals that a cancel request is about, by the rules of CancelGoal.srv, and its return
        code.
        """
        key, stamp = bytes(wanted.goal_id.uuid), _nanoseconds(wanted)
        with self._lock:
            goals = [goal for goal in self._goal_handles.values() if goal._cancelable]
        if any(key) and not stamp:
            goals = [goal for goal in goals if bytes(goal.goal_id.uuid) == key]
            if goals:
                return goals, CancelGoal.Response.ERROR_NONE
            if key in self._goal_handles:
                return [], CancelGoal.Response.ERROR_GOAL_TERMINATED
            return [], CancelGoal.Response.ERROR_UNKNOWN_GOAL_ID
        if stamp:
            goals = [
                goal
                for goal in goals
                if _nanoseconds(goal._goal_info) <= stamp or bytes(goal.goal_id.uuid) == key
            ]
        return goals, CancelGoal.Response.ERROR_NONE

    async def _on_cancel(self, request: Any, respond: _Respond) -> None:
        goals, code = self._to_cancel(request.goal_info)
        response = self._action_type.Impl.CancelGoalService.Response(return_code=code)
        for goal in goals:
            if await await_or_execute(self._cancel_callback, goal) == CancelResponse.ACCEPT:
                try:
                    goal._update_state(GoalEvent.CANCEL_GOAL)
                    response.goals_canceling.append(goal._goal_info)
                except RCLError as error:  # it ended while the callback ran
                    self._logger.debug(f"Failed to cancel goal in cancel callback: {error}")
        respond(response)

    async def _on_result(self, request: Any, respond: _Respond) -> None:
        handle = self._goal_handles.get(bytes(request.goal_id.uuid))
        if handle is None:  # a response's status is STATUS_UNKNOWN unless set
            respond(self._action_type.Impl.GetResultService.Response())
        else:
            handle._result.add_done_callback(lambda future: respond(future.result()))

    # --- goals

    def notify_execute(
        self, goal_handle: ServerGoalHandle, execute_callback: _Callback | None
    ) -> None:
        """Have the executor run a goal; use :meth:`ServerGoalHandle.execute`."""
        executor = self._node.executor
        if executor is None:
            raise RuntimeError("a goal can only be executed while its node is in an executor")
        callback = execute_callback or self._execute_callback
        executor.create_task(self._execute_goal, callback, goal_handle)

    async def _execute_goal(self, callback: _Callback, goal: ServerGoalHandle) -> None:
        try:
            result = await await_or_execute(callback, goal)
        except Exception as error:
            result = self._action_type.Result()
            self._logger.error(f"Error raised in execute callback: {error}")
            traceback.print_exc()
        if goal.is_active:
            self._logger.warning(
                f"Goal state not set, assuming aborted. Goal ID: {goal.goal_id.uuid}"
            )
            goal.abort()
        response = self._action_type.Impl.GetResultService.Response
        goal._result.set_result(response(status=goal.status, result=result))

    def _publish_status(self) -> None:
        statuses = [
            GoalStatus(goal_info=goal._goal_info, status=goal.status)
            for goal in self._goal_handles.values()
        ]
        self._status.publish(self._action_type.Impl.GoalStatusMessage(status_list=statuses))

    def notify_goal_done(self) -> None:
        """Find out when the next goal expires."""
        with self._lock:
            ended = [
                _nanoseconds(goal._goal_info)
                for goal in self._goal_handles.values()
                if not goal.is_active
            ]
            self._next_expiry = min(ended) + self._result_timeout if ended else None

    def is_ready(self, wait_set: Any) -> bool:
        """Whether a goal is to expire. Requests reach the executor through the services."""
        end = self._next_expiry
        return end is not None and self._node.get_clock().now().nanoseconds > end

    async def execute(self, taken_data: Any) -> None:
        """Forget the goals that have ended and are too old."""
        with self._lock:
            start = self._node.get_clock().now().nanoseconds - self._result_timeout
            for key, goal in list(self._goal_handles.items()):
                if not goal.is_active and _nanoseconds(goal._goal_info) < start:
                    goal.destroy()
                    del self._goal_handles[key]
            self.notify_goal_done()

    # --- callbacks

    def register_handle_accepted_callback(self, handle_accepted_callback: _Callback | None) -> None:
        """Set what is called with the handle of a new goal; None: execute it at once."""
        self._accepted_callback = handle_accepted_callback or default_handle_accepted_callback

    def register_goal_callback(self, goal_callback: _Callback | None) -> None:
        """Set what decides on goals; None: all are accepted."""
        self._goal_callback = goal_callback or default_goal_callback

    def register_cancel_callback(self, cancel_callback: _Callback | None) -> None:
        """Set what decides on cancel requests; None: all are rejected."""
        self._cancel_callback = cancel_callback or default_cancel_callback

    def register_execute_callback(self, execute_callback: _Callback) -> None:
        """Set what executes goals.

        :raises TypeError: it is not callable.
        """
        if not callable(execute_callback):
            raise TypeError("Failed to register goal execution callback: not callable")
        self._execute_callback = execute_callback

    def destroy(self) -> None:
        """Leave the action; goals that are being executed can no longer be heard of."""
        with self._lock:
            for goal in self._goal_handles.values():
                goal.destroy()
        super().destroy()
