# SPDX-License-Identifier: Apache-2.0
"""Feeds ROS clocks from /clock when the parameter use_sim_time is true."""

from __future__ import annotations

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
        self._node: Node | None = None
        self._clocks: list[ROSClock] = []
        self._subscription: Any = None
        self._last: Time | None = None
        self._active = False
        if node is not None:
            self.attach_node(node)

    def attach_node(self, node: Node) -> None:
        """Follow a node's parameter ``use_sim_time`` and listen to /clock through it."""
        self.detach_node()
        self._node = node
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

    def detach_node(self) -> None:
        """Leave the node; the time stands still where it was."""
        node, self._node = self._node, None
        if node is not None:
            node.remove_on_set_parameters_callback(self._on_parameters)
            if self._subscription is not None:
                node.destroy_subscription(self._subscription)
                self._subscription = None

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
        if self._node is None:
            return
        if enabled and self._subscription is None:
            qos = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
            self._subscription = self._node.create_subscription(
                rosgraph_msgs.msg.Clock, CLOCK_TOPIC, self._on_clock, qos
            )
        elif not enabled and self._subscription is not None:
            self._node.destroy_subscription(self._subscription)
            self._subscription = None

    def _apply(self, clock: ROSClock) -> None:
        if self._active and self._last is not None:
            clock.set_ros_time_override(self._last)
        clock._set_ros_time_is_active(self._active)
        if self._node is not None:
            self._node._restart_timers(clock)

    def attach_clock(self, clock: ROSClock) -> None:
        """Feed a clock.

        :raises ValueError: it is no ROS clock.
        """
        if clock.clock_type != ClockType.ROS_TIME or not isinstance(clock, ROSClock):
            raise ValueError("Only clocks with type ROS_TIME can be attached.")
        self._clocks.append(clock)
        self._apply(clock)

    def detach_clock(self, clock: ROSClock) -> None:
        """Feed a clock no longer."""
        self._clocks.remove(clock)

    def _on_clock(self, message: Any) -> None:
        before = self._last
        self._last = Time.from_msg(message.clock)
        for clock in self._clocks:
            clock.set_ros_time_override(self._last)
            if self._node is not None and (before is None or self._last < before):
                self._node._restart_timers(clock)

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
