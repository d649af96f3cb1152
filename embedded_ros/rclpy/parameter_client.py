# SPDX-License-Identifier: Apache-2.0
"""A client of the parameter services of another node."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

from rcl_interfaces.msg import ParameterEvent
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)

from .callback_groups import CallbackGroup
from .client import Client
from .node import Node
from .parameter import Parameter, parameter_dict_from_yaml_file
from .qos import QoSProfile, qos_profile_parameter_events, qos_profile_services_default
from .subscription import Subscription
from .task import Future

Callback = Callable[[Future], None]


class AsyncParameterClient:
    """Reads and sets the parameters of another node.

    Methods return futures of the services' responses; a callback is called with the future once it
    is done.
    """

    def __init__(
        self,
        node: Node,
        remote_node_name: str,
        qos_profile: QoSProfile = qos_profile_services_default,
        callback_group: CallbackGroup | None = None,
    ) -> None:
        """Make the clients at `node`."""
        self.node = node
        self.remote_node_name = remote_node_name

        def client(srv_type: Any, name: str) -> Client:
            return node.create_client(
                srv_type,
                f"{remote_node_name}/{name}",
                qos_profile=qos_profile,
                callback_group=callback_group,
            )

        self._get = client(GetParameters, "get_parameters")
        self._list = client(ListParameters, "list_parameters")
        self._set = client(SetParameters, "set_parameters")
        self._get_types = client(GetParameterTypes, "get_parameter_types")
        self._describe = client(DescribeParameters, "describe_parameters")
        self._set_atomically = client(SetParametersAtomically, "set_parameters_atomically")

    def services_are_ready(self) -> bool:
        """Whether all services of the node were found."""
        return all(
            client.service_is_ready()
            for client in (
                self._list,
                self._set,
                self._get,
                self._get_types,
                self._describe,
                self._set_atomically,
            )
        )

    def wait_for_services(self, timeout_sec: float | None = None) -> bool:
        """Wait for all services; False when they do not come in time."""
        end = None if timeout_sec is None else time.monotonic() + timeout_sec
        while not (ready := self.services_are_ready()) and self.node.context.ok():
            left = 0.01 if end is None else min(end - time.monotonic(), 0.01)
            if left <= 0:
                break
            time.sleep(left)
        return ready

    @staticmethod
    def _call(client: Client, callback: Callback | None, **fields: Any) -> Future:
        future = client.call_async(client.srv_type.Request(**fields))
        if callback:
            future.add_done_callback(callback)
        return future

    def list_parameters(
        self,
        prefixes: list[str] | None = None,
        depth: int | None = None,
        callback: Callback | None = None,
    ) -> Future:
        """List parameters below `prefixes` (default: all), at most `depth` levels."""
        return self._call(self._list, callback, prefixes=prefixes or [], depth=depth or 0)

    def get_parameters(self, names: list[str], callback: Callback | None = None) -> Future:
        """Get values."""
        return self._call(self._get, callback, names=names)

    def describe_parameters(self, names: list[str], callback: Callback | None = None) -> Future:
        """Get descriptors."""
        return self._call(self._describe, callback, names=names)

    def get_parameter_types(self, names: list[str], callback: Callback | None = None) -> Future:
        """Get types, as numbers of rcl_interfaces/msg/ParameterType."""
        return self._call(self._get_types, callback, names=names)

    def set_parameters(self, parameters: Sequence[Any], callback: Callback | None = None) -> Future:
        """Set parameters (objects or messages) one after the other."""
        return self._call(self._set, callback, parameters=_messages(parameters))

    def set_parameters_atomically(
        self, parameters: Sequence[Any], callback: Callback | None = None
    ) -> Future:
        """Set all parameters (objects or messages) or none."""
        return self._call(self._set_atomically, callback, parameters=_messages(parameters))

    def delete_parameters(self, names: list[str], callback: Callback | None = None) -> Future:
        """Unset parameters; this works for dynamically typed ones only."""
        return self.set_parameters([Parameter(name) for name in names], callback)

    def load_parameter_file(
        self, parameter_file: str, use_wildcard: bool = False, callback: Callback | None = None
    ) -> Future:
        """Set the parameters in a YAML file one after the other."""
        found = parameter_dict_from_yaml_file(parameter_file, use_wildcard)
        return self.set_parameters(list(found.values()), callback)

    def load_parameter_file_atomically(
        self, parameter_file: str, use_wildcard: bool = False, callback: Callback | None = None
    ) -> Future:
        """Set all parameters in a YAML file or none."""
        found = parameter_dict_from_yaml_file(parameter_file, use_wildcard)
        return self.set_parameters_atomically(list(found.values()), callback)

    def on_parameter_event(
        self,
        callback: Callable[[Any], Any],
        qos_profile: QoSProfile = qos_profile_parameter_events,
        **kwargs: Any,
    ) -> Subscription:
        """Subscribe to the parameter events of all nodes; keyword arguments are those of
        :meth:`rclpy.node.Node.create_subscription`.
        """
        return self.node.create_subscription(
            ParameterEvent, "/parameter_events", callback, qos_profile, **kwargs
        )


def _messages(parameters: Sequence[Any]) -> list[Any]:
    return [p.to_parameter_msg() if isinstance(p, Parameter) else p for p in parameters]
