# SPDX-License-Identifier: Apache-2.0
"""QoS events of publishers and subscriptions, with warnings on incompatible QoS by default."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from embedded_ros.transport import Reader, StatusChange

from .logging import get_logger
from .qos import QoSPolicyKind, qos_policy_name_from_kind
from .waitable import Waitable

#: how often executors look at statuses, s
POLL_PERIOD = 0.1

#: DDS policy ids
_POLICIES = {
    2: QoSPolicyKind.DURABILITY,
    4: QoSPolicyKind.DEADLINE,
    8: QoSPolicyKind.LIVELINESS,
    11: QoSPolicyKind.RELIABILITY,
    12: QoSPolicyKind.LIFESPAN,
    13: QoSPolicyKind.HISTORY,
}
#: DDS reports a writer and a reader of different types under this policy id
_TYPE_CONSISTENCY = 24


class QoSPublisherEventType(IntEnum):
    """Events of publishers."""

    RCL_PUBLISHER_OFFERED_DEADLINE_MISSED = 0
    RCL_PUBLISHER_LIVELINESS_LOST = 1
    RCL_PUBLISHER_OFFERED_INCOMPATIBLE_QOS = 2
    RCL_PUBLISHER_INCOMPATIBLE_TYPE = 3
    RCL_PUBLISHER_MATCHED = 4


class QoSSubscriptionEventType(IntEnum):
    """Events of subscriptions."""

    RCL_SUBSCRIPTION_REQUESTED_DEADLINE_MISSED = 0
    RCL_SUBSCRIPTION_LIVELINESS_CHANGED = 1
    RCL_SUBSCRIPTION_REQUESTED_INCOMPATIBLE_QOS = 2
    RCL_SUBSCRIPTION_MESSAGE_LOST = 3
    RCL_SUBSCRIPTION_INCOMPATIBLE_TYPE = 4
    RCL_SUBSCRIPTION_MATCHED = 5


@dataclass
class QoSDeadlineMissedInfo:
    """Deadlines missed."""

    total_count: int
    total_count_change: int


@dataclass
class QoSIncompatibleInfo:
    """Peers refused because of their QoS, or because they use another type on the topic."""

    total_count: int
    total_count_change: int
    last_policy_kind: QoSPolicyKind
    types_differ: bool = False


@dataclass
class QoSLivelinessChangedInfo:
    """Publishers that came to life or fell silent."""

    alive_count: int
    alive_count_change: int
    not_alive_count: int
    not_alive_count_change: int


QoSRequestedDeadlineMissedInfo = QoSOfferedDeadlineMissedInfo = QoSDeadlineMissedInfo
QoSRequestedIncompatibleQoSInfo = QoSOfferedIncompatibleQoSInfo = QoSIncompatibleInfo
QoSLivelinessLostInfo = QoSMessageLostInfo = QoSDeadlineMissedInfo


@dataclass
class MatchedInfo:
    """Peers connected."""

    total_count: int
    total_count_change: int
    current_count: int
    current_count_change: int


QoSPublisherMatchedInfo = QoSSubscriptionMatchedInfo = MatchedInfo


class EventHandler(Waitable):
    """Looks at one status of a publisher or subscription and calls back when it changed."""

    def __init__(
        self, *, callback_group: Any, callback: Callable[[Any], Any], entity: Any, kind: str
    ) -> None:
        super().__init__(callback_group)
        self.callback = callback
        self._entity = entity
        self._kind = kind
        self._pending: StatusChange | None = None
        self._last_current = 0

    def is_ready(self, wait_set: Any) -> bool:
        if self._pending is None:
            status = self._entity.status(self._kind)
            if status.change or (self._kind == "matched" and status.detail != self._last_current):
                self._pending = status
        return self._pending is not None

    def take_data(self) -> Any:
        status, self._pending = self._pending, None
        if status is None:
            return None
        if self._kind == "incompatible_qos":
            kind = _POLICIES.get(status.detail, QoSPolicyKind.INVALID)
            differ = status.detail == _TYPE_CONSISTENCY
            return QoSIncompatibleInfo(status.total, status.change, kind, differ)
        if self._kind == "matched":
            change = status.detail - self._last_current
            self._last_current = status.detail
            return MatchedInfo(status.total, status.change, status.detail, change)
        if self._kind == "liveliness" and isinstance(self._entity, Reader):
            return QoSLivelinessChangedInfo(status.total, status.change, status.detail, 0)
        return QoSDeadlineMissedInfo(status.total, status.change)

    async def execute(self, taken_data: Any) -> None:
        if taken_data is not None:
            result = self.callback(taken_data)
            if hasattr(result, "__await__"):
                await result

    def destroy(self) -> None:
        """Look no more."""
        self._entity = _Gone()


class _Gone:
    @staticmethod
    def status(kind: str) -> StatusChange:
        return StatusChange(0, 0)


class _EventCallbacks:
    """What both sides share: callbacks by status kind, and the default warning."""

    _warning = ""

    def __init__(
        self,
        *,
        deadline: Callable[[Any], Any] | None = None,
        liveliness: Callable[[Any], Any] | None = None,
        incompatible_qos: Callable[[Any], Any] | None = None,
        incompatible_type: Callable[[Any], Any] | None = None,
        matched: Callable[[Any], Any] | None = None,
        use_default_callbacks: bool = True,
    ) -> None:
        self.deadline = deadline
        self.liveliness = liveliness
        self.incompatible_qos = incompatible_qos
        self.incompatible_type = incompatible_type
        self.matched = matched
        self.use_default_callbacks = use_default_callbacks

    def _callbacks(self) -> dict[str, Callable[[Any], Any] | None]:
        return {"deadline": self.deadline, "liveliness": self.liveliness, "matched": self.matched}

    def create_event_handlers(
        self, callback_group: Any, entity: Any, topic_name: str, logger: Any = None
    ) -> list[EventHandler]:
        """Handlers for the callbacks that are set."""
        log = logger or get_logger("rclpy")

        def warn(info: Any) -> None:
            if info.types_differ:
                log.warning(
                    f"Somebody uses the topic '{topic_name}' with another message type; not "
                    f"connected to it."
                )
            else:
                name = qos_policy_name_from_kind(info.last_policy_kind)
                log.warning(self._warning.format(topic=topic_name, policy=name))

        callbacks = self._callbacks()
        callbacks["incompatible_qos"] = self.incompatible_qos
        if self.incompatible_qos is None and self.use_default_callbacks:
            callbacks["incompatible_qos"] = warn
        return [
            EventHandler(callback_group=callback_group, callback=callback, entity=entity, kind=kind)
            for kind, callback in callbacks.items()
            if callback is not None
        ]


class PublisherEventCallbacks(_EventCallbacks):
    """Callbacks for the events of a publisher."""

    _warning = (
        "New subscription discovered on topic '{topic}', requesting incompatible QoS. "
        "No messages will be sent to it. Last incompatible policy: {policy}"
    )


class SubscriptionEventCallbacks(_EventCallbacks):
    """Callbacks for the events of a subscription."""

    _warning = (
        "New publisher discovered on topic '{topic}', offering incompatible QoS. "
        "No messages will be received from it. Last incompatible policy: {policy}"
    )

    def __init__(self, *, message_lost: Callable[[Any], Any] | None = None, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.message_lost = message_lost

    def _callbacks(self) -> dict[str, Callable[[Any], Any] | None]:
        return {**super()._callbacks(), "lost": self.message_lost}
