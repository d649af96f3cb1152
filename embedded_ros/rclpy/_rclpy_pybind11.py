# SPDX-License-Identifier: Apache-2.0
"""What code imports from rclpy's compiled module: error classes, and what waitables are made of."""

from __future__ import annotations

import importlib
from typing import Any

from .exceptions import InvalidHandle


class RCLError(RuntimeError):
    """A middleware operation failed."""


class RCLInvalidROSArgsError(RCLError):
    """A --ros-args argument has a value that cannot be read."""


class UnknownROSArgsError(RuntimeError):
    """A --ros-args section holds an unknown argument."""


class NodeNameNonExistentError(RCLError):
    """No node of that name is known."""


class RMWError(RuntimeError):
    """The middleware refused something, such as bytes that are no message."""


class UnsupportedEventTypeError(RCLError):
    """The middleware has no event of that kind."""


class InvalidArgument(ValueError):
    """An argument is invalid."""


def __getattr__(name: str) -> Any:
    """Classes of this runtime that rclpy has in its compiled module."""
    if name not in _ELSEWHERE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, _, attribute = _ELSEWHERE[name].rpartition(".")
    return getattr(importlib.import_module(module, __package__), attribute)


_ELSEWHERE = {
    "Client": ".impl.wait_set.make_client",
    "EventHandle": ".event_handler.EventHandle",
    "GoalEvent": ".impl.server_goal.GoalEvent",
    "GuardCondition": ".impl.wait_set.make_guard_condition",
    "Service": ".impl.wait_set.make_service",
    "Subscription": ".impl.wait_set.make_subscription",
    "Timer": ".impl.wait_set.make_timer",
    "WaitSet": ".impl.wait_set.WaitSet",
    "rmw_qos_profile_t": ".qos.rmw_qos_profile_t",
}

__all__ = [
    "InvalidArgument",
    "InvalidHandle",
    "NodeNameNonExistentError",
    "RCLError",
    "RCLInvalidROSArgsError",
    "RMWError",
    "UnknownROSArgsError",
    "UnsupportedEventTypeError",
]
