# SPDX-License-Identifier: Apache-2.0
"""pull_publisher: publishes the demo's objects and its script of cable pulls, then ends.

Publishes ``<finger>/cable_pulls`` and ``objects``; subscribes to ``<finger>/state`` to know when
the solver node is there.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from typing import Any

import rclpy
from ccr_msgs.msg import CablePulls, FingerState, Object, ObjectArray
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.context import Context
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future
from shape_msgs.msg import SolidPrimitive
from std_msgs.msg import Header

from ccr_ros.model import CcrError, FingerSolver, load_gripper
from ccr_ros.nodes.conversions import pose_message
from ccr_ros.nodes.qos import COMMAND, LATCHED
from ccr_ros.resources import find_config

from .script import BALL, GRIPPER_FILE, MAX_SECONDS, MIN_SECONDS, PullScript

_OBJECTS_EVERY = 1.0  # s
_LINGER = 0.3  # s, for the last pulls to be delivered before the publisher is gone


class PullPublisher(Node):
    """Waits for the solver's poses of all fingers, then plays the script once.

    Args:
        options: Of `rclpy.node.Node`.

    Attributes:
        done: A future that is complete when the script has been played.
        sent: Number of pull messages published.

    Raises:
        CcrError: The gripper file is not valid.
        rclpy.exceptions.ParameterException: A parameter is of the wrong type or out of range.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("pull_publisher", **options)
        file = self.declare_parameter(
            "gripper_file",
            GRIPPER_FILE,
            ParameterDescriptor(description="The solver node's gripper file.", read_only=True),
        ).value
        seconds = self._declare_number(
            "seconds", 18.0, MIN_SECONDS, MAX_SECONDS, "Time [s] it takes."
        )
        rate = self._declare_number("rate", 50.0, 1.0, 200.0, "Pulls per second and finger [Hz].")

        gripper = load_gripper(find_config(str(file)))
        self._script = PullScript(gripper.finger_names, seconds)
        self._cables = {m.finger.name: m.finger.cable_names[0] for m in gripper.fingers}
        self._lengths = {
            m.finger.name: float(FingerSolver(m.finger).rest_lengths[0]) for m in gripper.fingers
        }
        self.done = Future()
        self.sent = 0
        self._start = self._objects_sent = float("-inf")

        self._pulls = {
            name: self.create_publisher(CablePulls, f"{name}/cable_pulls", COMMAND)
            for name in gripper.finger_names
        }
        self._objects = self.create_publisher(ObjectArray, "objects", LATCHED)
        self._unheard = set(gripper.finger_names)
        self._listeners = [
            self.create_subscription(
                FingerState, f"{name}/state", lambda _, name=name: self._heard(name), LATCHED
            )
            for name in gripper.finger_names
        ]
        self._timer = self.create_timer(1.0 / rate, self._tick)
        self._timer.cancel()  # until all fingers have been heard

    def _declare_number(
        self, name: str, default: float, low: float, high: float, text: str
    ) -> float:
        limits = [FloatingPointRange(from_value=low, to_value=high, step=0.0)]
        descriptor = ParameterDescriptor(
            description=text, read_only=True, floating_point_range=limits
        )
        return float(self.declare_parameter(name, default, descriptor).value)

    def _heard(self, finger: str) -> None:
        if finger in self._unheard and self._unheard == {finger}:
            self.get_logger().info(f"all fingers are there; {self._script.seconds:g} s of pulls")
            self._start = self._now()
            self._timer.reset()
        self._unheard.discard(finger)

    def _now(self) -> float:
        return self.get_clock().now().nanoseconds * 1e-9

    def _tick(self) -> None:
        while self._listeners:  # here, as not in their own callbacks
            self.destroy_subscription(self._listeners.pop())
        now = self._now()
        if now - self._objects_sent >= _OBJECTS_EVERY:
            # More than once, as the solver's subscription keeps nothing for who comes late.
            self._objects_sent = now
            # Stamped before the pulls of this tick: a pose that is new because of the objects
            # does not pass for the answer to pulls.
            self._objects.publish(_objects(Header(stamp=self.get_clock().now().to_msg())))
        elapsed = now - self._start
        if elapsed < self._script.seconds + _LINGER:
            self._publish_pulls(min(elapsed, self._script.seconds))
        elif not self.done.done():
            self._timer.cancel()
            self.done.set_result(None)

    def _publish_pulls(self, elapsed: float) -> None:
        stamp = self.get_clock().now().to_msg()
        for name, publisher in self._pulls.items():
            pull = self._script.percent(name, elapsed) / 100.0 * self._lengths[name]
            publisher.publish(
                CablePulls(header=Header(stamp=stamp), names=[self._cables[name]], pulls=[pull])
            )
            self.sent += 1


def _objects(header: Header) -> ObjectArray:
    item = Object(name=BALL.name, pose=pose_message(BALL.pose.position, BALL.pose.orientation))
    item.primitive = SolidPrimitive(
        type=SolidPrimitive.SPHERE, dimensions=[float(size) for size in BALL.dimensions]
    )
    return ObjectArray(header=header, objects=[item])


def play(context: Context | None = None) -> str:
    """Play the script once in a context (default: rclpy's own); return what was sent, as JSON.

    Returns an empty text when the context ends before the script does.
    """
    node = PullPublisher(context=context)
    executor = None if context is None else SingleThreadedExecutor(context=context)
    rclpy.spin_until_future_complete(node, node.done, executor)
    return json.dumps({"pulls_sent": node.sent}) if node.done.done() else ""


def main(args: Sequence[str] | None = None) -> int:
    """Play the script once; print what was sent as one line of JSON; return the exit code."""
    try:
        rclpy.init(args=args)
        if sent := play():
            print(sent, flush=True)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except (CcrError, ParameterException) as error:
        print(f"pull_publisher: error: {' '.join(str(error).split())}", file=sys.stderr)
        return 1
    finally:
        rclpy.try_shutdown()
    return 0
