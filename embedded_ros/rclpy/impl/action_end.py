# SPDX-License-Identifier: Apache-2.0
"""What action clients and servers have in common.

An action is three services and two topics below ``<action>/_action``. They are the node's ordinary
entities, served by its executor in the action's callback group, but no list of the node shows them.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from ..callback_groups import CallbackGroup
from ..exceptions import InvalidHandle, NameValidationException
from ..service import Service
from ..type_support import check_for_type_support
from ..waitable import Waitable
from .queued import Work

if TYPE_CHECKING:
    from ..node import Node


class AnsweringService(Service):
    """A service whose callback takes a request and a function that sends the response."""

    def take_work(self) -> Work | None:
        request, header = self.service_take_request()
        if header is None:
            return None
        return lambda: self.callback(request, partial(self._respond, header))

    def _respond(self, header: Any, response: Any) -> bool:
        """Answer; False when the service was destroyed since the request came."""
        try:
            self.send_response(response, header)
        except InvalidHandle:
            self._node.get_logger().warning(
                f"Failed to send a response of '{self.srv_name}': the server was destroyed"
            )
            return False
        return True


class ActionEnd(Waitable):
    """An action client or server (`role`): what it consists of, and how that is destroyed."""

    def __init__(
        self,
        node: Node,
        action_type: Any,
        action_name: str,
        callback_group: CallbackGroup | None,
        role: str,
    ) -> None:
        super().__init__(callback_group or node.default_callback_group)
        check_for_type_support(action_type)
        if not hasattr(action_type, "Goal"):
            raise RuntimeError(
                f"The action type provided is not valid ({action_type}), this might be a message "
                f"or service"
            )
        self._node = node
        self._action_type = action_type
        self._logger = node.get_logger().get_child(f"action_{role}")
        self._prefix = f"{action_name}/_action/"
        self._destroyers: dict[Any, Callable[[Any], bool]] = {}
        try:
            node._ros_full_name(self._prefix + "send_goal" if action_name else "", service=True)
        except NameValidationException as error:
            raise ValueError(
                f"Failed to create action {role} due to invalid topic name '{action_name}': {error}"
            ) from None

    @property
    def _parts(self) -> list[Any]:
        """The entities of the node that belong to this action."""
        return list(self._destroyers)

    def is_ready(self, wait_set: Any) -> bool:
        return False

    def take_data(self) -> Any:
        return None

    async def execute(self, taken_data: Any) -> None:
        pass

    def __enter__(self) -> Any:
        return self

    def __exit__(self, *args: object) -> None:
        pass

    def destroy(self) -> None:
        """Leave the action."""
        for part, destroy in self._destroyers.items():
            destroy(part)
        if self in self._node.waitables:
            self._node.remove_waitable(self)
