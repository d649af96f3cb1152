# SPDX-License-Identifier: Apache-2.0
"""Subscriptions."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from enum import Enum
from typing import TYPE_CHECKING, Any

from embedded_ros.interfaces.registry import registry
from embedded_ros.transport import Reader, Sample

from .event_handler import SubscriptionEventCallbacks
from .impl.queued import QueuedEntity, Work, await_or_execute
from .qos import HistoryPolicy, QoSProfile

if TYPE_CHECKING:
    from .node import Node


def _takes(callback: Callable[..., Any], count: int) -> bool:
    try:
        inspect.signature(callback).bind(*[None] * count)
    except TypeError:
        return False
    return True


class Subscription(QueuedEntity):
    """Receives messages of a topic. Made by :meth:`rclpy.node.Node.create_subscription`."""

    class CallbackType(Enum):
        """Whether the callback takes the message alone or message and message info."""

        MessageOnly = 0
        WithMessageInfo = 1

    def __init__(
        self,
        node: Node,
        msg_type: Any,
        topic: str,
        callback: Callable[..., Any],
        callback_group: Any,
        qos_profile: QoSProfile,
        raw: bool,
        event_callbacks: SubscriptionEventCallbacks,
    ) -> None:
        self.callback = callback
        self._node = node
        self._full_topic = node._ros_full_name(topic)
        reader: Reader = node._ros_open(msg_type, self._full_topic, qos_profile, writer=False)
        keep_all = qos_profile.history == HistoryPolicy.KEEP_ALL
        super().__init__(reader, None if keep_all else max(qos_profile.depth, 1))
        self._deserialize = registry.deserializer(msg_type)
        self.msg_type = msg_type
        self.topic = topic
        self.callback_group = callback_group
        self.qos_profile = qos_profile
        self.raw = raw
        self.event_handlers = event_callbacks.create_event_handlers(callback_group, self, topic)

    @property
    def callback(self) -> Callable[..., Any]:
        """What is called with each message."""
        return self._callback

    @callback.setter
    def callback(self, value: Callable[..., Any]) -> None:
        if _takes(value, 1):
            self._callback_type = Subscription.CallbackType.MessageOnly
        elif _takes(value, 2):
            self._callback_type = Subscription.CallbackType.WithMessageInfo
        else:
            raise RuntimeError(
                "Subscription.__init__(): callback should be either be callable with one argument"
                "(to get only the message) or two (to get message and message info)"
            )
        self._callback = value

    @property
    def topic_name(self) -> str:
        """The full topic name."""
        return self.handle._full_topic

    def get_publisher_count(self) -> int:
        """How many publishers are connected."""
        return self.handle._endpoint.matched()

    def take(self) -> tuple[Any, dict[str, Any]] | None:
        """Take the oldest message and its info (timestamps in ns), or None when there is none."""
        return self._take(self._queue.popleft(), self.raw) if self._queue else None

    def take_message(self, msg_type: Any, raw: bool) -> tuple[Any, dict[str, Any]] | None:
        """Take a message that no executor is to take, as :meth:`take`."""
        self.drain()
        return self._take(self._queue.popleft(), raw) if self._queue else None

    def _take(self, sample: Sample, raw: bool) -> tuple[Any, dict[str, Any]] | None:
        info = {
            "source_timestamp": sample.source_timestamp,
            "received_timestamp": sample.received_timestamp,
            "publication_sequence_number": None,
            "reception_sequence_number": None,
        }
        if raw:
            return sample.payload, info
        try:
            return self._deserialize(sample.payload), info
        except Exception as error:
            # Whatever comes over the wire must not end the program.
            self._node.get_logger().error(
                f"dropped a message on '{self._full_topic}' that cannot be read: {error}"
            )
            return None

    def take_work(self) -> Work | None:
        taken = self.take()
        if taken is None:
            return None
        callback = self._callback
        message, info = taken
        if self._callback_type is Subscription.CallbackType.MessageOnly:
            return lambda: await_or_execute(callback, message)
        return lambda: await_or_execute(callback, message, info)

    def destroy(self) -> None:
        """Leave the topic; use :meth:`rclpy.node.Node.destroy_subscription`."""
        for handler in self.event_handlers:
            handler.destroy()
        if not self._ros_destroyed:
            self._node._ros_announce(reader=self._endpoint, remove=True)
            super().destroy()
