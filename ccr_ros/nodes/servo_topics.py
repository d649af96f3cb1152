# SPDX-License-Identifier: Apache-2.0
"""The servo bridge's topics: what is heard goes to the bridge, what is measured is published."""

from __future__ import annotations

import math
from collections.abc import Callable

from builtin_interfaces.msg import Time as TimeMessage
from ccr_msgs.msg import CablePulls, FingerState, ServoState
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from ccr_ros.actuation.bridge import ServoBridge
from ccr_ros.actuation.driver import ServoDriver
from ccr_ros.actuation.drivers.loopback import LoopbackDriver
from ccr_ros.actuation.drivers.ros2_control import Ros2ControlDriver
from ccr_ros.actuation.states import BridgeState
from ccr_ros.model import CcrError

from .qos import COMMAND, JOINT_STATES, LATCHED
from .servo_conversions import (
    commands_from_message,
    joint_state_message,
    pulls_message,
    servo_state_message,
    tensions_from_message,
)
from .servo_parameters import ServoParameters

_WARN_EVERY = 2.0  # s


class ServoTopics:
    """Publishers and subscriptions, which stay whatever the bridge behind them.

    Args:
        node: The node to make them on.
        parameters: What is served.
        changed: Called when a command was refused, which diagnostics tell.
    """

    def __init__(
        self, node: Node, parameters: ServoParameters, changed: Callable[[], None]
    ) -> None:
        self.bridge: ServoBridge | None = None
        self.received = self.refused = 0
        self.refusal = ""  # why the newest command was refused
        self._driver: ServoDriver | None = None
        self._node = node
        self._log = node.get_logger()
        self._changed = changed
        self._driver_name = parameters.driver
        self._fingers = {
            mounted.finger.name: mounted.finger.cable_names
            for mounted in parameters.gripper.fingers
        }
        self._places = {
            finger: parameters.rack.of_finger(finger, cables)
            for finger, cables in self._fingers.items()
        }
        self._pulls = {
            finger: node.create_publisher(CablePulls, f"{finger}/cable_pulls", COMMAND)
            for finger in self._fingers
        }
        self._commands = node.create_publisher(Float64MultiArray, "servo_commands", COMMAND)
        self._state = node.create_publisher(ServoState, "servo_state", LATCHED)
        external = parameters.driver == Ros2ControlDriver.name
        if external:
            node.create_subscription(
                JointState, "joint_states", self._take_joints, qos_profile_sensor_data
            )
        else:
            self._joints = node.create_publisher(JointState, "joint_states", JOINT_STATES)
        self._external = external
        for finger in self._fingers:
            self._subscribe(finger, simulated=parameters.driver == LoopbackDriver.name)

    def _subscribe(self, finger: str, simulated: bool) -> None:
        self._node.create_subscription(
            CablePulls,
            f"{finger}/cable_pull_commands",
            lambda message: self._take_command(finger, message),
            COMMAND,
        )
        if simulated:
            self._node.create_subscription(
                FingerState,
                f"{finger}/state",
                lambda message: self._take_tensions(finger, message),
                LATCHED,
            )

    def serve(self, bridge: ServoBridge | None) -> None:
        """Let what is heard go to a bridge (None: to none) from now on."""
        self.bridge = bridge
        self._driver = None if bridge is None else bridge.driver

    def send(self, angles: list[float]) -> None:
        """Publish setpoints of the servos [rad]."""
        self._commands.publish(Float64MultiArray(data=angles))

    # Out

    def publish_measured(self, stamp: TimeMessage) -> None:
        """Publish what was measured just now, and the setpoints that servos were sent."""
        bridge = self.bridge
        if bridge is None:
            return
        for finger, places in self._places.items():
            axes = [bridge.axes[place] for place in places]
            if all(math.isfinite(axis.pull) for axis in axes):
                self._pulls[finger].publish(pulls_message(stamp, axes))
        if not self._external:  # else the driver has published, and joint states come from others
            self._joints.publish(joint_state_message(stamp, bridge))
            if bridge.leading and bridge.state != BridgeState.INACTIVE:
                self.send(list(bridge.setpoints))

    def publish_state(self, stamp: TimeMessage, reason: str) -> None:
        """Publish the bridge's state; ``reason`` counts where there is no bridge."""
        message = servo_state_message(stamp, self.bridge, self._driver_name, reason)
        self._state.publish(message)

    # In

    def _take_command(self, finger: str, message: CablePulls) -> None:
        self.received += 1
        now = self._now()
        stamp = message.header.stamp
        at = stamp.sec + 1e-9 * stamp.nanosec if stamp.sec or stamp.nanosec else now
        try:
            if self.bridge is None:
                raise CcrError("the bridge is not configured")
            pulls = commands_from_message(message, self._fingers[finger])
            places = dict(zip(self._fingers[finger], self._places[finger], strict=True))
            self.bridge.command({places[cable]: p for cable, p in pulls.items()}, at, now)
        except CcrError as error:
            self.refused += 1
            self.refusal = f"command for {finger} refused: {error}"
            self._log.warning(
                f"{self.refusal} (nothing moves by it)", throttle_duration_sec=_WARN_EVERY
            )
            self._changed()

    def _take_tensions(self, finger: str, message: FingerState) -> None:
        if not isinstance(self._driver, LoopbackDriver):
            return
        if message.forces_are != FingerState.NEWTON:
            self._log.warning(
                f"tensions of {finger} are not in newton (its file has no youngs_modulus): "
                "simulated servos tell no effort",
                once=True,
            )
        tensions = tensions_from_message(message)
        places = zip(self._fingers[finger], self._places[finger], strict=True)
        self._driver.set_tensions({place: tensions.get(cable, math.nan) for cable, place in places})

    def _take_joints(self, message: JointState) -> None:
        if not isinstance(self._driver, Ros2ControlDriver):
            return
        try:
            self._driver.take(
                message.name, message.position, message.velocity, message.effort, self._now()
            )
        except CcrError as error:
            self._log.warning(f"joint states refused: {error}", throttle_duration_sec=_WARN_EVERY)

    def _now(self) -> float:
        return self._node.get_clock().now().nanoseconds * 1e-9
