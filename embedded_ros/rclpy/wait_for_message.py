# SPDX-License-Identifier: Apache-2.0
"""Waiting for a single message."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from .qos import QoSProfile

if TYPE_CHECKING:
    from .node import Node


def wait_for_message(
    msg_type: Any,
    node: Node,
    topic: str,
    *,
    qos_profile: QoSProfile | int = 1,
    time_to_wait: float = -1,
) -> tuple[bool, Any]:
    """Wait for the next message of a topic without spinning the node.

    :param time_to_wait: seconds; negative: no limit.
    :return: whether one came, and the message.
    """
    context = node.context
    waiter = context.participant.create_waiter()
    subscription = node.create_subscription(msg_type, topic, lambda _: None, qos_profile)
    # The executor must not take what this function waits for.
    node._subscriptions.remove(subscription)
    node._wake_executor()
    end = None if time_to_wait < 0 else time.monotonic() + time_to_wait
    context.add_waker(waiter)
    try:
        waiter.set_readers({subscription._endpoint})
        while context.ok():
            left = None if end is None else end - time.monotonic()
            if left is not None and left <= 0:
                break
            waiter.wait(None if left is None else int(left * 1e9))
            subscription.drain()
            taken = subscription.take()
            if taken is not None:
                return True, taken[0]
        return False, None
    finally:
        node._subscriptions.append(subscription)
        node.destroy_subscription(subscription)
        waiter.close()
