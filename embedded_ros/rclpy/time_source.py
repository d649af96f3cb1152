# SPDX-License-Identifier: Apache-2.0
"""Feeds ROS clocks from /clock when the parameter use_sim_time is true."""

from __future__ import annotations

import weakref
from typing import TYPE_CHECKING, Any

import rosgraph_msgs.msg
from rcl_interfaces.msg import SetParametersResult

from .clock import ROSClock
from .clock_type import ClockType
from .parameter import Parameter
from .qos import QoSProfile, ReliabilityPolicy
from .time import Time

if TYPE_CHECKING:
    from .node import Node

CLOCK_TOPIC = "/clock"
USE_SIM_TIME_NAME = "use_sim_time"


class TimeSource:
    """The link between a node's clocks and simulated time."""

    def __init__(self, *, node: Node | None = None) -> None:
        self._node: weakref.ref[Node] | None = None
        self._clocks: list[ROSClock] = []
        self._clock_sub: Any = None
        self._last: Time | None = None
        self._active = False
        if node is not None:
            self.attach_node(node)

    def attach_node(self, node: Node) -> None:
        """Follow a node's parameter ``use_sim_time`` and listen to /clock through it."""
        self.detach_node()
        self._node = weakref.ref(node)
        if not node.has_parameter(USE_SIM_TIME_NAME):
            node.declare_parameter(USE_SIM_TIME_NAME, False)
        if node.get_parameter(USE_SIM_TIME_NAME).type_ == Parameter.Type.BOOL:
            self.ros_time_is_active = node.get_parameter(USE_SIM_TIME_NAME).value
        else:
            node.get_logger().error(
                f"Invalid type for parameter {USE_SIM_TIME_NAME} "
                f"{node.get_parameter(USE_SIM_TIME_NAME).type_} should be bool"
            )
        node.add_on_set_parameters_callback(self._on_parameters)

    def _get_node(self) -> Node | None:
        return self._node() if self._node is not None else None

    def detach_node(self) -> None:
        """Leave the node; the time stands still where it was."""
        node, self._node = self._get_node(), None
        if node is not None:
            node.remove_on_set_parameters_callback(self._on_parameters)
            if self._clock_sub is not None:
                node.destroy_subscription(self._clock_sub)
                self._clock_sub = None

    @property
    def ros_time_is_active(self) -> bool:
        """Whether clocks follow /clock."""
        return self._active

    @ros_time_is_active.setter
    def ros_time_is_active(self, enabled: bool) -> None:
        if enabled == self._active:
            return
        self._active = enabled
        for clock in self._clocks:
            self._apply(clock)
        node = self._get_node()
        if node is None:
            return
        if enabled and self._clock_sub is None:
            qos = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
            self._clock_sub = node.create_subscription(
                rosgraph_msgs.msg.Clock, CLOCK_TOPIC, self.clock_callback, qos
            )
        elif not enabled and self._clock_sub is not None:
            node.destroy_subscription(self._clock_sub)
            self._clock_sub = None

    def _apply(self, clock: ROSClock) -> None:
        if self._active and self._last is not None:
            clock.set_ros_time_override(self._last)
        clock._set_ros_time_is_active(self._active)
        node = self._get_node()
        if node is not None:
            node._ros_restart_timers(clock)

    def attach_clock(self, clock: ROSClock) -> None:
        """Feed a clock.

        :raises ValueError: it is no ROS clock.
        """
        if clock.clock_type != ClockType.ROS_TIME or not isinstance(clock, ROSClock):
            raise ValueError("Only clocks with type ROS_TIME can be attached.")
        self._clocks.append(clock)
        self._apply(clock)

    def clock_callback(self, message: Any) -> None:
        """Set the clocks to the time of a message of /clock."""
        before, node = self._last, self._get_node()
        self._last = Time.from_msg(message.clock)
        for clock in self._clocks:
            clock.set_ros_time_override(self._last)
            if node is not None and (before is None or self._last < before):
                node._ros_restart_timers(clock)

    def _on_parameters(self, parameters: list[Parameter]) -> Any:
        for parameter in parameters:
            if parameter.name == USE_SIM_TIME_NAME:
                if parameter.type_ != Parameter.Type.BOOL:
                    return SetParametersResult(
                        successful=False,
                        reason=f"{USE_SIM_TIME_NAME} parameter set to something besides a bool",
                    )
                self.ros_time_is_active = parameter.value
        return SetParametersResult(successful=True)
