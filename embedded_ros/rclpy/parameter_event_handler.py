# SPDX-License-Identifier: Apache-2.0
"""Callbacks for changes of other nodes' parameters."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from rcl_interfaces.msg import ParameterEvent

from .callback_groups import CallbackGroup
from .event_handler import SubscriptionEventCallbacks
from .node import Node
from .qos import QoSProfile, qos_profile_parameter_events
from .qos_overriding_options import QoSOverridingOptions


@dataclass(eq=False)
class ParameterCallbackHandle:
    """A callback for one parameter of one node."""

    parameter_name: str
    node_name: str
    callback: Callable[[Any], None]


@dataclass(eq=False)
class ParameterEventCallbackHandle:
    """A callback for all parameter events."""

    callback: Callable[[Any], None]


class ParameterEventHandler:
    """Listens to /parameter_events and calls back. What was added last is called first."""

    class Callbacks:
        """The callbacks of a handler, by parameter and node name."""

        def __init__(self) -> None:
            self.parameter_callbacks: dict[tuple[str, str], list[ParameterCallbackHandle]] = {}
            self.event_callbacks: list[ParameterEventCallbackHandle] = []
            self._lock = threading.RLock()

        def event_callback(self, event: Any) -> None:
            """Call whatever concerns an event."""
            with self._lock:
                for key, handles in list(self.parameter_callbacks.items()):
                    parameter = ParameterEventHandler.get_parameter_from_event(event, *key)
                    if parameter is not None:
                        for handle in list(handles):
                            handle.callback(parameter)
                for event_handle in list(self.event_callbacks):
                    event_handle.callback(event)

        def add_parameter_callback(
            self, parameter_name: str, node_name: str, callback: Callable[[Any], None]
        ) -> ParameterCallbackHandle:
            """Add a callback for one parameter of one node, by its full name."""
            handle = ParameterCallbackHandle(parameter_name, node_name, callback)
            with self._lock:
                known = self.parameter_callbacks.setdefault((parameter_name, node_name), [])
                known.insert(0, handle)
            return handle

        def remove_parameter_callback(self, handle: ParameterCallbackHandle) -> None:
            """:raises RuntimeError: it is not there."""
            key = handle.parameter_name, handle.node_name
            with self._lock:
                _remove(self.parameter_callbacks.get(key, []), handle)
                if not self.parameter_callbacks[key]:
                    del self.parameter_callbacks[key]

        def add_parameter_event_callback(
            self, callback: Callable[[Any], None]
        ) -> ParameterEventCallbackHandle:
            """Add a callback for all events."""
            handle = ParameterEventCallbackHandle(callback)
            with self._lock:
                self.event_callbacks.insert(0, handle)
            return handle

        def remove_parameter_event_callback(self, handle: ParameterEventCallbackHandle) -> None:
            """:raises RuntimeError: it is not there."""
            with self._lock:
                _remove(self.event_callbacks, handle)

    def __init__(
        self,
        node: Node,
        qos_profile: QoSProfile = qos_profile_parameter_events,
        callback_group: CallbackGroup | None = None,
        event_callbacks: SubscriptionEventCallbacks | None = None,
        qos_overriding_options: QoSOverridingOptions | None = None,
        raw: bool = False,
    ) -> None:
        """Subscribe through `node`, with the arguments of a subscription."""
        self.node = node
        self.qos_profile = qos_profile
        self._callbacks = ParameterEventHandler.Callbacks()
        self.parameter_event_subscription = node.create_subscription(
            ParameterEvent,
            "/parameter_events",
            self._callbacks.event_callback,
            qos_profile,
            callback_group=callback_group,
            event_callbacks=event_callbacks,
            qos_overriding_options=qos_overriding_options,
            raw=raw,
        )

    def destroy(self) -> None:
        """Listen no longer."""
        self.node.destroy_subscription(self.parameter_event_subscription)

    @staticmethod
    def get_parameter_from_event(event: Any, parameter_name: str, node_name: str) -> Any:
        """The message of a new or changed parameter in an event, None when it is not there."""
        if event.node == node_name:
            for parameter in ParameterEventHandler.get_parameters_from_event(event):
                if parameter.name == parameter_name:
                    return parameter
        return None

    @staticmethod
    def get_parameters_from_event(event: Any) -> Iterable[Any]:
        """The messages of all new and changed parameters in an event."""
        yield from event.new_parameters
        yield from event.changed_parameters

    def add_parameter_callback(
        self, parameter_name: str, node_name: str, callback: Callable[[Any], None]
    ) -> ParameterCallbackHandle:
        """Have `callback` called with the message of a parameter that was set.

        :param node_name: whose parameter; relative names are in this node's namespace, an empty one
            is this node's own.
        """
        full = self._resolve_path(node_name)
        return self._callbacks.add_parameter_callback(parameter_name, full, callback)

    def remove_parameter_callback(self, handle: ParameterCallbackHandle) -> None:
        """:raises RuntimeError: it was removed before."""
        self._callbacks.remove_parameter_callback(handle)

    def add_parameter_event_callback(
        self, callback: Callable[[Any], None]
    ) -> ParameterEventCallbackHandle:
        """Have `callback` called with every event of every node."""
        return self._callbacks.add_parameter_event_callback(callback)

    def remove_parameter_event_callback(self, handle: ParameterEventCallbackHandle) -> None:
        """:raises RuntimeError: it was removed before."""
        self._callbacks.remove_parameter_event_callback(handle)

    def _resolve_path(self, node_path: str | None = None) -> str:
        if not node_path:
            return self.node.get_fully_qualified_name()
        if node_path.startswith("/"):
            return node_path
        return f"{self.node.get_namespace().rstrip('/')}/{node_path}"


def _remove(known: list[Any], handle: Any) -> None:
    if handle not in known:
        raise RuntimeError("Callback doesn't exist")
    known.remove(handle)
