# SPDX-License-Identifier: Apache-2.0
"""Publishers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from embedded_ros.interfaces.registry import registry
from embedded_ros.transport import INFINITE, Writer

from .destroyable import Destroyable
from .duration import Duration
from .event_handler import PublisherEventCallbacks
from .qos import QoSProfile

if TYPE_CHECKING:
    from .node import Node


class Publisher(Destroyable):
    """Sends messages on a topic. Made by :meth:`rclpy.node.Node.create_publisher`."""

    def __init__(
        self,
        node: Node,
        msg_type: Any,
        topic: str,
        qos_profile: QoSProfile,
        event_callbacks: PublisherEventCallbacks,
        callback_group: Any,
    ) -> None:
        self._node = node
        self._full_topic = node._ros_full_name(topic)
        self._endpoint: Writer = node._ros_open(
            msg_type, self._full_topic, qos_profile, writer=True
        )
        self._serialize = registry.serializer(msg_type)
        self.msg_type = msg_type
        self.topic = topic
        self.qos_profile = qos_profile
        self.event_handlers = event_callbacks.create_event_handlers(callback_group, self, topic)

    def publish(self, msg: Any) -> None:
        """Send a message, or the bytes of an encoded one. Waits for at most half a second for
        subscribers that stand still, where the history is KEEP_ALL.

        :raises TypeError: the message is of another type than the publisher's.
        """
        if isinstance(msg, self.msg_type):
            payload = self._serialize(msg)
        elif isinstance(msg, bytes):
            payload = msg
        else:
            raise TypeError(f"Expected {self.msg_type}, got {type(msg)}")
        try:
            self.handle._endpoint.write(payload)
        except TimeoutError as error:
            # Somebody else's standstill must not end this program.
            self._node.get_logger().warning(
                f"dropped a message on '{self._full_topic}': {error}", throttle_duration_sec=1.0
            )

    def get_subscription_count(self) -> int:
        """How many subscriptions are connected."""
        return self.handle._endpoint.matched()

    @property
    def topic_name(self) -> str:
        """The full topic name."""
        return self.handle._full_topic

    def assert_liveliness(self) -> None:
        """Show subscribers that this publisher is alive (for MANUAL_BY_TOPIC liveliness)."""
        self.handle._endpoint.assert_liveliness()

    def wait_for_all_acked(self, timeout: Duration | None = None) -> bool:
        """Wait until all reliable subscriptions have everything; False after ``timeout`` (default:
        none).
        """
        limit = INFINITE if timeout is None or timeout.nanoseconds < 0 else timeout.nanoseconds
        return self.handle._endpoint.wait_for_acked(min(limit, INFINITE // 2))

    def destroy(self) -> None:
        """Leave the topic; use :meth:`rclpy.node.Node.destroy_publisher`."""
        for handler in self.event_handlers:
            handler.destroy()
        if not self._ros_destroyed:
            super().destroy()
            self._node._ros_announce(writer=self._endpoint, remove=True)
            self._endpoint.close()
