# SPDX-License-Identifier: Apache-2.0
"""A node beside the one under test: publishes, keeps what it hears, waits for what shall come."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from typing import Any

from builtin_interfaces.msg import Time
from ccr_msgs.msg import CablePulls, FingerState, Object, ObjectArray
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseArray
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from shape_msgs.msg import SolidPrimitive
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

TIMEOUT = 60.0  # s; never reached when all is well


class Probe:
    """Shares one executor with the nodes under test, which run only while the probe waits."""

    def __init__(self, context: Context, namespace: str = "gripper", name: str = "probe") -> None:
        self.node = Node(name, namespace=namespace, context=context)
        self.executor = SingleThreadedExecutor(context=context)
        self.executor.add_node(self.node)
        self.heard: dict[str, list[Any]] = {}
        self._publishers: dict[str, Any] = {}
        self._stamp = 0

    def add(self, node: Node) -> Node:
        """Run a node under test along with the probe."""
        self.executor.add_node(node)
        return node

    def close(self) -> None:
        for node in list(self.executor.get_nodes()):
            self.executor.remove_node(node)
            node.destroy_node()
        self.executor.shutdown()

    def until(self, condition: Callable[[], Any], what: str = "what was waited for") -> Any:
        """Spin until the condition is true and return its value."""
        deadline = time.monotonic() + TIMEOUT
        while not (value := condition()):
            if time.monotonic() > deadline:
                raise AssertionError(f"{what} did not come within {TIMEOUT:g} s")
            self.executor.spin_once(timeout_sec=0.05)
        return value

    def spin_for(self, seconds: float) -> None:
        """Spin for a while, to see that something does not come."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self.executor.spin_once(timeout_sec=0.02)

    def listen(self, kind: type, topic: str, latched: bool = True, depth: int = 300) -> list[Any]:
        """Subscribe once; return the list that the messages are appended to."""
        if topic not in self.heard:
            self.heard[topic] = self.join(kind, topic, latched, depth)
        return self.heard[topic]

    def join(self, kind: type, topic: str, latched: bool = True, depth: int = 300) -> list[Any]:
        """As :meth:`listen`, with a subscription of its own, that comes after the messages."""
        qos = QoSProfile(depth=depth)
        if latched:
            qos.durability = DurabilityPolicy.TRANSIENT_LOCAL
        heard: list[Any] = []
        self.node.create_subscription(kind, topic, heard.append, qos)
        return heard

    def states(self, finger: str) -> list[FingerState]:
        return self.listen(FingerState, f"{finger}/state")

    def backbones(self, finger: str) -> list[PoseArray]:
        return self.listen(PoseArray, f"{finger}/backbone")

    def markers(self) -> list[MarkerArray]:
        return self.listen(MarkerArray, "markers")

    def transforms(self, static: bool = False) -> list[TFMessage]:
        return self.listen(TFMessage, "/tf_static" if static else "/tf", latched=static)

    def diagnostics(self) -> list[DiagnosticArray]:
        return self.listen(DiagnosticArray, "/diagnostics", latched=False)

    def publish(self, topic: str, message: Any) -> None:
        """Publish, after the topic's subscriber has been found the first time."""
        if topic not in self._publishers:
            publisher = self.node.create_publisher(type(message), topic, 300)
            self._publishers[topic] = publisher
            self.until(lambda: publisher.get_subscription_count() > 0, f"a subscriber to {topic}")
        self._publishers[topic].publish(message)

    def next_stamp(self) -> Time:
        self._stamp += 1
        return Time(sec=self._stamp, nanosec=5)

    def pull(self, finger: str, pulls: Iterable[float], names: Iterable[str] = ()) -> Time:
        """Publish pulls with a stamp of their own and return the stamp."""
        stamp = self.next_stamp()
        message = CablePulls(
            header=Header(stamp=stamp), names=list(names), pulls=[float(p) for p in pulls]
        )
        self.publish(f"{finger}/cable_pulls", message)
        return stamp

    def solved(self, finger: str, stamp: Time) -> FingerState:
        """Wait for the state that answers the pulls of this stamp."""
        states = self.states(finger)
        return self.until(
            lambda: next((s for s in reversed(states) if s.header.stamp == stamp), None),
            f"the state of {finger} at {stamp.sec} s",
        )

    def pull_and_wait(
        self, finger: str, pulls: Iterable[float], names: Iterable[str] = ()
    ) -> FingerState:
        self.states(finger)
        return self.solved(finger, self.pull(finger, pulls, names))

    def statuses(self, name: str) -> list[DiagnosticStatus]:
        """Return every status whose name ends so, oldest first."""
        found = [status for array in self.diagnostics() for status in array.status]
        return [status for status in found if status.name.endswith(name)]

    def status(self, name: str) -> DiagnosticStatus | None:
        """Return the newest status whose name ends so."""
        found = self.statuses(name)
        return found[-1] if found else None


def sphere(name: str, radius: float, center: tuple[float, float, float]) -> Object:
    """Return a spherical object."""
    item = Object(name=name)
    item.primitive = SolidPrimitive(type=SolidPrimitive.SPHERE, dimensions=[radius])
    item.pose.position.x, item.pose.position.y, item.pose.position.z = center
    item.pose.orientation.w = 1.0
    return item


def objects(*items: Object, frame: str = "", stamp: Time | None = None) -> ObjectArray:
    return ObjectArray(header=Header(frame_id=frame, stamp=stamp or Time()), objects=list(items))


def shown(array: MarkerArray, namespace: str) -> list[Marker]:
    """Return the markers of a namespace that are shown, not deleted."""
    return [m for m in array.markers if m.ns == namespace and m.action == Marker.ADD]
