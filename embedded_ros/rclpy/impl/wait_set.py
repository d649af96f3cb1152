# SPDX-License-Identifier: Apache-2.0
"""What waitables are made of: entities that no node lists, and the wait set that they join.

These are the classes of rclpy's compiled module that a user's Waitable holds.
"""

from __future__ import annotations

import time
from functools import partialmethod
from typing import TYPE_CHECKING, Any

from .. import client, guard_condition, service, subscription, timer
from ..event_handler import SubscriptionEventCallbacks
from ..qos import QoSProfile, rmw_qos_profile_t

if TYPE_CHECKING:
    from ..clock import Clock
    from ..context import ContextHandle
    from ..node import Node

#: how often :meth:`WaitSet.wait` looks, s
_STEP = 0.005


class WaitSet:
    """Tells which of its members were ready when it was last looked at."""

    def __init__(self, *_: Any) -> None:
        """Rclpy passes how many members of each kind there will be, and the context."""
        self._members: dict[str, list[Any]] = {}
        self._ready: dict[str, list[int]] = {}

    def clear_entities(self) -> None:
        """Forget all members."""
        self._members.clear()

    def _add(self, kind: str, member: Any) -> int:
        members = self._members.setdefault(kind, [])
        members.append(member.handle)
        return len(members) - 1

    add_subscription = partialmethod(_add, "subscription")
    add_guard_condition = partialmethod(_add, "guard_condition")
    add_timer = partialmethod(_add, "timer")
    add_client = partialmethod(_add, "client")
    add_service = partialmethod(_add, "service")
    add_event = partialmethod(_add, "event")

    def look(self) -> bool:
        """Find out who is ready; whether anybody is. Guard conditions are told only once."""
        self._ready = {
            kind: [place for place, member in enumerate(members) if self._is_ready(member)]
            for kind, members in self._members.items()
        }
        return any(self._ready.values())

    @staticmethod
    def _is_ready(member: Any) -> bool:
        if isinstance(member, guard_condition.GuardCondition):
            triggered, member._executor_triggered = member._executor_triggered, False
            return triggered
        return not member._ros_destroyed and bool(member.is_ready())

    def wait(self, timeout_nsec: int) -> None:
        """Wait until a member is ready, or for so long; negative: without limit."""
        end = time.monotonic_ns() + timeout_nsec
        while not self.look() and (timeout_nsec < 0 or time.monotonic_ns() < end):
            time.sleep(_STEP)

    def is_ready(self, kind: str, index: int) -> bool:
        """Whether the member that was added to its kind at this place was ready."""
        return index in self._ready.get(kind, ())

    def get_ready_entities(self, kind: str) -> list[int]:
        """The places of the members of a kind that were ready."""
        return list(self._ready.get(kind, ()))

    def members(self, *kinds: str) -> list[Any]:
        """The members of some kinds."""
        return [member for kind in kinds for member in self._members.get(kind, ())]

    def queued(self) -> list[Any]:
        """The members that are fed by readers."""
        return self.members("subscription", "client", "service")


def _profile(qos: rmw_qos_profile_t) -> QoSProfile:
    return QoSProfile(**qos.to_dict())


def make_client(node: Node, srv_type: Any, name: str, qos: rmw_qos_profile_t) -> client.Client:
    """A client that no node lists."""
    return client.Client(node, srv_type, name, _profile(qos), None)


def make_service(node: Node, srv_type: Any, name: str, qos: rmw_qos_profile_t) -> service.Service:
    """A server that no node lists."""
    return service.Service(node, srv_type, name, lambda *_: None, None, _profile(qos))


def make_subscription(
    node: Node, msg_type: Any, topic: str, qos: rmw_qos_profile_t
) -> subscription.Subscription:
    """A subscription that no node lists."""
    events = SubscriptionEventCallbacks(use_default_callbacks=False)
    return subscription.Subscription(
        node, msg_type, topic, lambda _: None, None, _profile(qos), False, events
    )


def make_timer(
    clock: Clock, context: ContextHandle, period_nsec: int, autostart: bool
) -> timer.Timer:
    """A timer that no node lists."""
    return timer.Timer(None, None, period_nsec, clock, context=context.context, autostart=autostart)


def make_guard_condition(context: ContextHandle) -> guard_condition.GuardCondition:
    """A guard condition that no node lists."""
    return guard_condition.GuardCondition(None, None, context.context)
