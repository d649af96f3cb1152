# SPDX-License-Identifier: Apache-2.0
"""Action clients."""

from __future__ import annotations

import threading
import time
import uuid
import weakref
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from action_msgs.msg import GoalStatus
from unique_identifier_msgs.msg import UUID

from .._rclpy_pybind11 import RCLError
from ..callback_groups import CallbackGroup
from ..client import Client
from ..event_handler import SubscriptionEventCallbacks
from ..exceptions import InvalidHandle
from ..impl.action_end import ActionEnd
from ..impl.queued import await_or_execute
from ..qos import QoSProfile, qos_profile_action_status_default, qos_profile_services_default
from ..task import Future
from ..waitable import NumberOfEntities

if TYPE_CHECKING:
    from ..node import Node

_ENDED = (GoalStatus.STATUS_SUCCEEDED, GoalStatus.STATUS_CANCELED, GoalStatus.STATUS_ABORTED)


class ClientGoalHandle:
    """A goal that a server has answered."""

    def __init__(self, action_client: ActionClient, goal_id: Any, goal_response: Any) -> None:
        self._action_client = action_client
        self._goal_id = goal_id
        self._goal_response = goal_response
        self._status: int = GoalStatus.STATUS_UNKNOWN

    def __eq__(self, other: Any) -> bool:
        return bool(self._goal_id == other.goal_id)

    def __repr__(self) -> str:
        return (
            f"ClientGoalHandle <id={self.goal_id.uuid}, accepted={self.accepted}, "
            f"status={self.status}>"
        )

    @property
    def goal_id(self) -> Any:
        """The goal's UUID message."""
        return self._goal_id

    @property
    def stamp(self) -> Any:
        """When the server accepted the goal."""
        return self._goal_response.stamp

    @property
    def accepted(self) -> bool:
        """Whether it did."""
        return bool(self._goal_response.accepted)

    @property
    def status(self) -> int:
        """What the server told last: a constant of GoalStatus."""
        return self._status

    def cancel_goal(self) -> Any:
        """Ask the server to cancel the goal and wait for its response, while another thread spins
        the node.
        """
        return self._action_client._wait(self.cancel_goal_async())

    def cancel_goal_async(self) -> Future:
        """Ask the server to cancel the goal; the future gets its response."""
        return self._action_client._cancel_goal_async(self)

    def get_result(self) -> Any:
        """Wait until the goal has ended and get status and result, while another thread spins the
        node.
        """
        return self._action_client._wait(self.get_result_async())

    def get_result_async(self) -> Future:
        """Ask for status and result; the future gets them when the goal has ended."""
        return self._action_client._get_result_async(self)


class _GoalFuture(Future):
    """Turns the response to a goal into a handle."""

    def __init__(self, accept: Callable[[Any], ClientGoalHandle]) -> None:
        super().__init__()
        self._accept = accept

    def set_result(self, result: Any) -> None:
        super().set_result(self._accept(result))


class ActionClient(ActionEnd):
    """Sends goals to an action server."""

    def __init__(
        self,
        node: Node,
        action_type: Any,
        action_name: str,
        *,
        callback_group: CallbackGroup | None = None,
        goal_service_qos_profile: QoSProfile = qos_profile_services_default,
        result_service_qos_profile: QoSProfile = qos_profile_services_default,
        cancel_service_qos_profile: QoSProfile = qos_profile_services_default,
        feedback_sub_qos_profile: QoSProfile = QoSProfile(depth=10),  # noqa: B008 - as in rclpy
        status_sub_qos_profile: QoSProfile = qos_profile_action_status_default,
    ) -> None:
        """Create a client.

        :raises AttributeError: ``action_type`` is no ROS interface.
        :raises ValueError: the action name is invalid.
        """
        super().__init__(node, action_type, action_name, callback_group, "client")
        # Handles that the user has dropped need no status.
        self._goal_handles: dict[bytes, weakref.ref[ClientGoalHandle]] = {}
        self._statuses: dict[bytes, int] = {}
        self._feedback_callbacks: dict[bytes, Callable[[Any], Any]] = {}
        types = action_type.Impl
        self._feedback = self._subscribe(
            types.FeedbackMessage, "feedback", self._on_feedback, feedback_sub_qos_profile
        )
        self._status = self._subscribe(
            types.GoalStatusMessage, "status", self._on_status, status_sub_qos_profile
        )
        self._goals, self._cancels, self._results = (
            self._connect(name, service, qos)
            for name, service, qos in (
                ("send_goal", types.SendGoalService, goal_service_qos_profile),
                ("cancel_goal", types.CancelGoalService, cancel_service_qos_profile),
                ("get_result", types.GetResultService, result_service_qos_profile),
            )
        )
        node.add_waitable(self)

    def _connect(self, name: str, srv_type: Any, qos: QoSProfile) -> Client:
        client = self._node.create_client(
            srv_type, self._prefix + name, qos_profile=qos, callback_group=self.callback_group
        )
        self._destroyers[client] = self._node.destroy_client
        return client

    def _subscribe(self, msg_type: Any, name: str, callback: Any, qos: QoSProfile) -> Any:
        subscription = self._node.create_subscription(
            msg_type,
            self._prefix + name,
            callback,
            qos,
            callback_group=self.callback_group,
            event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False),
        )
        self._destroyers[subscription] = self._node.destroy_subscription
        return subscription

    def get_num_entities(self) -> NumberOfEntities:
        return NumberOfEntities(num_subs=2, num_clients=3)

    # --- what the server tells

    async def _on_feedback(self, message: Any) -> None:
        callback = self._feedback_callbacks.get(bytes(message.goal_id.uuid))
        if callback is not None:
            await await_or_execute(callback, message)

    def _on_status(self, message: Any) -> None:
        self._statuses = {bytes(s.goal_info.goal_id.uuid): s.status for s in message.status_list}
        for key, reference in list(self._goal_handles.items()):
            handle = reference()
            if handle is not None and key in self._statuses:
                handle._status = self._statuses[key]
            if handle is None or handle._status in _ENDED:
                self._goal_handles.pop(key, None)

    def _accept(self, goal_id: Any, response: Any) -> ClientGoalHandle:
        handle = ClientGoalHandle(self, goal_id, response)
        key = bytes(goal_id.uuid)
        if not handle.accepted:
            self._feedback_callbacks.pop(key, None)
        elif key in self._goal_handles:
            raise RuntimeError(f"Two goals were accepted with the same ID ({handle})")
        else:
            # The status may be here before the response is.
            handle._status = self._statuses.get(key, GoalStatus.STATUS_UNKNOWN)
            self._goal_handles[key] = weakref.ref(handle)
        return handle

    # --- what the user asks for

    def _wait(self, future: Future) -> Any:
        """Wait for a future that another thread brings about; None after a shutdown."""
        done = threading.Event()
        future.add_done_callback(lambda _: done.set())
        while not done.wait(0.1) and self._node.context.ok():
            pass
        return future.result()

    def _ask(self, client: Client, what: str, request: Any, future: Future) -> Future:
        try:
            return client._send_request(request, future)
        except InvalidHandle as error:
            raise RCLError(f"Failed to send {what} request: {error}") from None

    @staticmethod
    def _check(goal_handle: ClientGoalHandle) -> None:
        if not isinstance(goal_handle, ClientGoalHandle):
            raise TypeError(f"Expected type ClientGoalHandle but received {type(goal_handle)}")

    def send_goal(self, goal: Any, **kwargs: Any) -> Any:
        """Send a goal and wait for status and result, while another thread spins the node.

        Arguments and errors as for :meth:`send_goal_async`.
        """
        handle = self._wait(self.send_goal_async(goal, **kwargs))
        return handle and handle.get_result()

    def send_goal_async(
        self,
        goal: Any,
        feedback_callback: Callable[[Any], Any] | None = None,
        goal_uuid: Any = None,
    ) -> Future:
        """Send a goal; the future gets a :class:`ClientGoalHandle` when the server has answered.

        :param feedback_callback: takes each feedback message of the goal.
        :param goal_uuid: UUID message, default a random one.
        :raises TypeError: the goal is of another type than the action's.
        :raises RCLError: the client was destroyed.
        """
        if not isinstance(goal, self._action_type.Goal):
            raise TypeError(f"Expected {self._action_type.Goal}, got {type(goal)}")
        goal_id = UUID(uuid=list(uuid.uuid4().bytes)) if goal_uuid is None else goal_uuid
        request = self._action_type.Impl.SendGoalService.Request(goal_id=goal_id, goal=goal)
        if feedback_callback is not None:
            # Before the goal is sent: its feedback may be here before the response is.
            self._feedback_callbacks[bytes(goal_id.uuid)] = feedback_callback
        future = _GoalFuture(lambda response: self._accept(goal_id, response))
        return self._ask(self._goals, "goal", request, future)

    def _cancel_goal_async(self, goal_handle: ClientGoalHandle) -> Future:
        self._check(goal_handle)
        request = self._action_type.Impl.CancelGoalService.Request()
        request.goal_info.goal_id = goal_handle.goal_id
        return self._ask(self._cancels, "cancel", request, Future())

    def _get_result_async(self, goal_handle: ClientGoalHandle) -> Future:
        self._check(goal_handle)
        key = bytes(goal_handle.goal_id.uuid)
        request = self._action_type.Impl.GetResultService.Request(goal_id=goal_handle.goal_id)
        future = self._ask(self._results, "result", request, Future())
        future.add_done_callback(lambda _: self._feedback_callbacks.pop(key, None))
        return future

    def server_is_ready(self) -> bool:
        """Whether a server of this action is there.

        :raises RCLError: the client was destroyed.
        """
        try:
            clients = (self._goals, self._cancels, self._results)
            return all(client.service_is_ready() for client in clients) and all(
                topic.get_publisher_count() > 0 for topic in (self._feedback, self._status)
            )
        except InvalidHandle as error:
            raise RCLError(f"Failed to check if action server is available: {error}") from None

    def wait_for_server(self, timeout_sec: float | None = None) -> bool:
        """Wait for a server; False when there is none in time."""
        end = None if timeout_sec is None else time.monotonic() + timeout_sec
        while not (ready := self.server_is_ready()) and self._node.context.ok():
            left = 0.01 if end is None else min(end - time.monotonic(), 0.01)
            if left <= 0:
                break
            time.sleep(left)
        return ready
