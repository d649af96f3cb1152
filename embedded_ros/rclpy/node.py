# SPDX-License-Identifier: Apache-2.0
"""Nodes."""

from __future__ import annotations

import weakref
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor, ParameterEvent, SetParametersResult

from ._rclpy_pybind11 import NodeNameNonExistentError
from .callback_groups import (
    CallbackGroup,
    MutuallyExclusiveCallbackGroup,
    ReentrantCallbackGroup,
)
from .client import Client
from .clock import Clock, ROSClock
from .destroyable import Destroyable
from .exceptions import NotInitializedException
from .executors import Executor
from .expand_topic_name import expand_topic_name
from .guard_condition import GuardCondition
from .impl.arguments import NodeArguments, parse_arguments
from .impl.rcutils_logger import RcutilsLogger
from .impl.rosout import Rosout
from .logging import get_logger
from .logging_service import LoggingService
from .node_entities import EntityHolder
from .node_graph import GraphViewer
from .node_parameters import ParameterHolder
from .parameter import Parameter
from .parameter_service import ParameterService
from .publisher import Publisher
from .qos import QoSProfile, qos_profile_parameter_events
from .service import Service
from .subscription import Subscription
from .time_source import TimeSource
from .timer import Rate, Timer
from .type_description_service import TypeDescriptionService
from .utilities import get_default_context
from .validate_full_topic_name import validate_full_topic_name
from .validate_namespace import validate_namespace
from .validate_node_name import validate_node_name
from .validate_topic_name import validate_topic_name

# Programs import more from here than what is defined here.
__all__ = [
    "HIDDEN_NODE_PREFIX",
    "CallbackGroup",
    "Client",
    "Clock",
    "GuardCondition",
    "MutuallyExclusiveCallbackGroup",
    "Node",
    "NodeNameNonExistentError",
    "Parameter",
    "ParameterDescriptor",
    "Publisher",
    "QoSProfile",
    "Rate",
    "ReentrantCallbackGroup",
    "Service",
    "SetParametersResult",
    "Subscription",
    "Timer",
]

#: tools hide nodes whose names start so
HIDDEN_NODE_PREFIX = "_"


class Node(ParameterHolder, EntityHolder, GraphViewer, Destroyable):
    """A participant of the ROS graph: it makes publishers, subscriptions and timers and holds
    parameters.
    """

    def __init__(
        self,
        node_name: str,
        *,
        context: Any = None,
        cli_args: list[str] | None = None,
        namespace: str | None = None,
        use_global_arguments: bool = True,
        enable_rosout: bool = True,
        start_parameter_services: bool = True,
        parameter_overrides: list[Parameter] | None = None,
        allow_undeclared_parameters: bool = False,
        automatically_declare_parameters_from_overrides: bool = False,
        enable_logger_service: bool = False,
    ) -> None:
        """Create a node.

        :param cli_args: arguments for this node alone, as after ``--ros-args``.
        :param use_global_arguments: whether the process's arguments count as well.
        :param start_parameter_services: whether others may read and set parameters.
        :param parameter_overrides: initial values that beat all others.
        :param enable_logger_service: whether others may read and set logger levels.
        :raises NotInitializedException: the context is not initialised.
        :raises InvalidNodeNameException: the name is invalid; InvalidNamespaceException likewise.
        """
        ParameterHolder.__init__(self, allow_undeclared_parameters)
        EntityHolder.__init__(self)
        self._context = get_default_context() if context is None else context
        if not self._context.ok():
            raise NotInitializedException("cannot create node")
        self._ros_executor_ref: weakref.ref[Executor] | None = None
        self._ros_released = False

        sources = [self._context.arguments] if use_global_arguments else []
        if cli_args:
            sources.insert(0, parse_arguments(["--ros-args", *cli_args])[0])
        self._ros_arguments = NodeArguments(sources)
        namespace = namespace or "/"
        if not namespace.startswith("/"):
            namespace = "/" + namespace
        validate_node_name(node_name)
        validate_namespace(namespace)
        self._ros_name, self._ros_namespace = self._ros_arguments.names(node_name, namespace)

        self._ros_entry = self._context.graph.add_node(self._ros_namespace, self._ros_name)
        self._context.nodes.add(self)
        self._logger = get_logger(self.get_fully_qualified_name()[1:].replace("/", "."))
        self._clock = ROSClock()
        self._ros_rosout = (
            Rosout(self) if enable_rosout and self._ros_arguments.logs("rosout") else None
        )
        self._parameter_event_publisher = self.create_publisher(
            ParameterEvent,
            "/parameter_events",
            qos_profile_parameter_events,
        )
        self._ros_read_overrides(parameter_overrides)
        if automatically_declare_parameters_from_overrides:
            self.declare_parameters(
                "",
                [
                    (name, parameter.value, ParameterDescriptor())
                    for name, parameter in self._parameter_overrides.items()
                ],
                ignore_override=True,
            )
        self._time_source = TimeSource(node=self)
        self._time_source.attach_clock(self._clock)
        if start_parameter_services:
            self._parameter_service = ParameterService(self)
        if enable_logger_service:
            self._logger_service = LoggingService(self)
        self._type_description_service = TypeDescriptionService(self)

    def _ros_read_overrides(self, overrides: list[Parameter] | None) -> None:
        given = self._ros_arguments.parameters(self.get_fully_qualified_name())
        self._parameter_overrides = {
            name: Parameter(name, value=value) for name, value in given.items()
        }
        self._parameter_overrides.update({p.name: p for p in overrides or []})

    # --- what the node is

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.get_fully_qualified_name()}>"

    @property
    def context(self) -> Any:
        """The context of the node."""
        return self._context

    @property
    def default_callback_group(self) -> CallbackGroup:
        """The group of everything that was created without one."""
        return self._default_callback_group

    def get_name(self) -> str:
        """The node name, after remapping."""
        return self.handle._ros_name

    def get_namespace(self) -> str:
        """The namespace, after remapping."""
        return self.handle._ros_namespace

    def get_fully_qualified_name(self) -> str:
        """Namespace and name."""
        return f"{self._ros_namespace.rstrip('/')}/{self._ros_name}"

    def get_clock(self) -> Clock:
        """The node's clock: ROS time."""
        return self._clock

    def get_logger(self) -> RcutilsLogger:
        """The node's logger."""
        return self._logger

    @property
    def executor(self) -> Executor | None:
        """The executor that the node is in."""
        return self._ros_executor_ref() if self._ros_executor_ref is not None else None

    @executor.setter
    def executor(self, new_executor: Executor | None) -> None:
        current = self.executor
        if current is new_executor:
            return
        if current is not None:
            current.remove_node(self)
        self._ros_executor_ref = None if new_executor is None else weakref.ref(new_executor)
        if new_executor is not None:
            new_executor.add_node(self)

    def _wake_executor(self) -> None:
        executor = self.executor
        if executor is not None:
            executor.wake()

    # --- names

    def _ros_full_name(self, name: str, service: bool = False, remap: bool = True) -> str:
        if not isinstance(name, str):
            raise TypeError(f"a topic or service name must be a str, got {name!r}")
        validate_topic_name(name, is_service=service)
        try:
            full = expand_topic_name(name, self.get_name(), self.get_namespace())
        except ValueError as error:
            raise ValueError(str(error)) from None
        if remap:
            full = self._ros_arguments.remap(full, self._ros_name, self._ros_namespace, service)
        validate_full_topic_name(full, is_service=service)
        return full

    def resolve_topic_name(self, topic: str, *, only_expand: bool = False) -> str:
        """The full name of a topic, after remapping unless ``only_expand``."""
        return self._ros_full_name(topic, remap=not only_expand)

    def resolve_service_name(self, service: str, *, only_expand: bool = False) -> str:
        """The full name of a service, after remapping unless ``only_expand``."""
        return self._ros_full_name(service, service=True, remap=not only_expand)

    def destroy_node(self) -> None:
        """Leave the graph with everything that was made here."""
        self._ros_destroyed = True
        self._ros_release()

    def _ros_release(self) -> None:
        """Leave the graph; name and logger stay usable, as they do in rclpy after a shutdown."""
        if self._ros_released:
            return
        self._ros_released = True
        executor = self.executor
        if executor is not None:
            executor.remove_node(self)
        if self._ros_rosout is not None:
            self._ros_rosout.close()
        self._ros_destroy_entities(orphan=not self._ros_destroyed)
        self._context.nodes.discard(self)
        if self._context.ok():
            self._context.graph.remove_node(self._ros_entry)
