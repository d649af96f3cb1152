# SPDX-License-Identifier: Apache-2.0
"""Declares a node's parameters with description and range, in one line each."""

from __future__ import annotations

from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node

_FIXED = "Takes effect at start only."

Limits = tuple[float, float] | tuple[int, int] | str


class Declarations:
    """Declares parameters on a node and returns their values.

    Args:
        node: The node.
    """

    def __init__(self, node: Node) -> None:
        self._node = node

    def fixed(self, name: str, default: Any, text: str, limits: Limits = "") -> Any:
        """Declare a parameter that takes effect at start only.

        Args:
            limits: The range of a number, or in words what else is allowed.

        Raises:
            rclpy.exceptions.ParameterException: The value given is of the wrong type or range.
        """
        return self._declare(name, default, f"{text} {_FIXED}", limits, read_only=True)

    def live(self, name: str, default: Any, text: str, limits: Limits = "") -> Any:
        """Declare a parameter that may be set while the node runs; see `fixed`."""
        return self._declare(name, default, text, limits, read_only=False)

    def _declare(self, name: str, default: Any, text: str, limits: Limits, read_only: bool) -> Any:
        descriptor = ParameterDescriptor(description=text, read_only=read_only)
        if isinstance(limits, str):
            descriptor.additional_constraints = limits
        elif isinstance(default, int):
            low, high = limits
            descriptor.integer_range = [
                IntegerRange(from_value=int(low), to_value=int(high), step=1)
            ]
        else:
            low, high = limits
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=float(low), to_value=float(high), step=0.0)
            ]
        return self._node.declare_parameter(name, default, descriptor).value
