# SPDX-License-Identifier: Apache-2.0
"""Events of publishers and subscriptions, with warnings on incompatible peers by default."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from enum import IntEnum
from typing import Any, ClassVar, NamedTuple

from ._rclpy_pybind11 import UnsupportedEventTypeError as UnsupportedEventTypeError
from .destroyable import Destroyable
from .impl.queued import await_or_execute
from .logging import get_logger
from .qos import QoSPolicyKind, qos_policy_name_from_kind
from .waitable import NumberOfEntities, Waitable

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
#: DDS counts a peer of another type as one of incompatible QoS, with this policy id
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


class QoSRequestedDeadlineMissedInfo(NamedTuple):
    """Something happened so many times, and so many times since it was last looked at."""

    total_count: int
    total_count_change: int


class QoSRequestedIncompatibleQoSInfo(NamedTuple):
    """Peers refused because of their QoS."""

    total_count: int
    total_count_change: int
    last_policy_kind: QoSPolicyKind


class QoSLivelinessChangedInfo(NamedTuple):
    """Publishers that came to life or fell silent."""

    alive_count: int
    not_alive_count: int
    alive_count_change: int
    not_alive_count_change: int


class QoSPublisherMatchedInfo(NamedTuple):
    """Peers connected."""

    total_count: int
    total_count_change: int
    current_count: int
    current_count_change: int


QoSOfferedDeadlineMissedInfo = QoSLivelinessLostInfo = QoSRequestedDeadlineMissedInfo
QoSMessageLostInfo = IncompatibleTypeInfo = QoSRequestedDeadlineMissedInfo
QoSOfferedIncompatibleQoSInfo = QoSRequestedIncompatibleQoSInfo
QoSSubscriptionMatchedInfo = QoSPublisherMatchedInfo

#: the transport's status behind the last word of an event's name
_STATUSES = {"MISSED": "deadline", "LOST": "liveliness", "CHANGED": "liveliness"}
_STATUSES |= {"QOS": "incompatible_qos", "TYPE": "incompatible_qos", "MATCHED": "matched"}


class EventHandle(Destroyable):
    """Counts one kind of event of a publisher or subscription."""

    def __init__(self, parent: Any, event_type: IntEnum) -> None:
        self._endpoint = parent.handle._endpoint
        self._kind = event_type.name.rpartition("_")[2]
        lost = event_type is QoSSubscriptionEventType.RCL_SUBSCRIPTION_MESSAGE_LOST
        self._status = "lost" if lost else _STATUSES[self._kind]
        self._now = self._taken = (0, 0)
        # Of incompatible peers: all that were counted, and those of this kind.
        self._counted = self._own = 0
        self._policy = QoSPolicyKind.INVALID

    def is_ready(self) -> bool:
        """Whether there is news."""
        if not self._ros_destroyed:
            status = self._endpoint.status(self._status)
            self._now = status.total, status.detail
            if self._status == "incompatible_qos":
                if (status.detail == _TYPE_CONSISTENCY) == (self._kind == "TYPE"):
                    self._own += status.total - self._counted
                    self._policy = _POLICIES.get(status.detail, QoSPolicyKind.INVALID)
                self._counted = status.total
                self._now = self._own, 0
        return self._now != self._taken

    def take_event(self) -> Any:
        """What has happened, and what of it since the last call."""
        (total, current), (old_total, old_current) = self._now, self._taken
        self._taken = self._now
        changes = total - old_total, current - old_current
        if self._kind == "QOS":
            return QoSRequestedIncompatibleQoSInfo(total, changes[0], self._policy)
        if self._kind == "MATCHED":
            return QoSPublisherMatchedInfo(total, changes[0], current, changes[1])
        if self._kind == "CHANGED":
            return QoSLivelinessChangedInfo(total, current, *changes)
        return QoSRequestedDeadlineMissedInfo(total, changes[0])


class EventHandler(Waitable):
    """Calls back on one kind of event of a publisher or subscription."""

    def __init__(
        self,
        *,
        callback_group: Any,
        callback: Callable[[Any], Any],
        event_type: IntEnum,
        parent_impl: Any,
    ) -> None:
        super().__init__(callback_group)
        self.event_type = event_type
        self.callback = callback
        self._event = EventHandle(parent_impl, event_type)

    def is_ready(self, wait_set: Any) -> bool:
        return self._event.is_ready()

    def take_data(self) -> Any:
        return self._event.take_event()

    async def execute(self, taken_data: Any) -> None:
        await await_or_execute(self.callback, taken_data)

    def get_num_entities(self) -> NumberOfEntities:
        return NumberOfEntities(num_events=1)

    def destroy(self) -> None:
        """Look no more."""
        self._event.destroy()


class QoSEventHandler(EventHandler):
    """The former name of :class:`EventHandler`."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        text = "QoSEventHandler is deprecated, use EventHandler instead."
        warnings.warn(text, DeprecationWarning, stacklevel=2)
        super().__init__(*args, **kwargs)


class _EventCallbacks:
    """What both sides share: callbacks by kind of event, and the default warnings."""

    #: attribute names, and the events that they are called for
    _events: ClassVar[dict[str, IntEnum]]
    _refusal: str

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

    def create_event_handlers(
        self, callback_group: Any, entity: Any, topic_name: str
    ) -> list[EventHandler]:
        """Handlers for the callbacks that are set."""
        logger = get_logger(entity._node.get_logger().name)

        def refused(info: Any) -> None:
            policy = qos_policy_name_from_kind(info.last_policy_kind)
            logger.warn(self._refusal.format(topic_name, policy))

        def other_type(_: Any) -> None:
            logger.warn(
                f"Incompatible type on topic '{topic_name}', no messages will be sent to it."
            )

        defaults = {"incompatible_qos": refused, "incompatible_type": other_type}
        handlers = []
        for name, event_type in self._events.items():
            callback = getattr(self, name)
            if callback is None and self.use_default_callbacks:
                callback = defaults.get(name)
            if callback is not None:
                handlers.append(
                    EventHandler(
                        callback_group=callback_group,
                        callback=callback,
                        event_type=event_type,
                        parent_impl=entity,
                    )
                )
        return handlers


class PublisherEventCallbacks(_EventCallbacks):
    """Callbacks for the events of a publisher."""

    _events: ClassVar[dict[str, IntEnum]] = {
        "deadline": QoSPublisherEventType.RCL_PUBLISHER_OFFERED_DEADLINE_MISSED,
        "liveliness": QoSPublisherEventType.RCL_PUBLISHER_LIVELINESS_LOST,
        "incompatible_qos": QoSPublisherEventType.RCL_PUBLISHER_OFFERED_INCOMPATIBLE_QOS,
        "incompatible_type": QoSPublisherEventType.RCL_PUBLISHER_INCOMPATIBLE_TYPE,
        "matched": QoSPublisherEventType.RCL_PUBLISHER_MATCHED,
    }
    _refusal = (
        "New subscription discovered on topic '{}', requesting incompatible QoS. "
        "No messages will be sent to it. Last incompatible policy: {}"
    )


class SubscriptionEventCallbacks(_EventCallbacks):
    """Callbacks for the events of a subscription."""

    _events: ClassVar[dict[str, IntEnum]] = {
        "deadline": QoSSubscriptionEventType.RCL_SUBSCRIPTION_REQUESTED_DEADLINE_MISSED,
        "incompatible_qos": QoSSubscriptionEventType.RCL_SUBSCRIPTION_REQUESTED_INCOMPATIBLE_QOS,
        "liveliness": QoSSubscriptionEventType.RCL_SUBSCRIPTION_LIVELINESS_CHANGED,
        "message_lost": QoSSubscriptionEventType.RCL_SUBSCRIPTION_MESSAGE_LOST,
        "incompatible_type": QoSSubscriptionEventType.RCL_SUBSCRIPTION_INCOMPATIBLE_TYPE,
        "matched": QoSSubscriptionEventType.RCL_SUBSCRIPTION_MATCHED,
    }
    _refusal = (
        "New publisher discovered on topic '{}', offering incompatible QoS. "
        "No messages will be received from it. Last incompatible policy: {}"
    )

    def __init__(self, *, message_lost: Callable[[Any], Any] | None = None, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.message_lost = message_lost
