# SPDX-License-Identifier: Apache-2.0
"""Error classes that code imports from rclpy's compiled module."""

from __future__ import annotations

from .exceptions import InvalidHandle


class RCLError(RuntimeError):
    """A middleware operation failed."""


class RCLInvalidROSArgsError(RCLError):
    """A --ros-args argument has a value that cannot be read."""


class UnknownROSArgsError(RuntimeError):
    """A --ros-args section holds an unknown argument."""


class NodeNameNonExistentError(RCLError):
    """No node of that name is known."""


class UnsupportedEventTypeError(RCLError):
    """The middleware has no event of that kind."""


class InvalidArgument(ValueError):
    """An argument is invalid."""


__all__ = [
    "InvalidArgument",
    "InvalidHandle",
    "NodeNameNonExistentError",
    "RCLError",
    "RCLInvalidROSArgsError",
    "UnknownROSArgsError",
    "UnsupportedEventTypeError",
]
