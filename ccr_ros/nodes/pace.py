# SPDX-License-Identifier: Apache-2.0
"""At most so many messages per second, and the last one never left out."""

from __future__ import annotations

from collections.abc import Callable

from rclpy.clock import Clock
from rclpy.node import Node


class Pace:
    """Calls something at once when it is told of a change, or as soon as the rate allows it.

    Args:
        node: The node to make the timer on.
        rate: Most calls per second [Hz].
        clock: Of the timer.
        act: What is called.
    """

    def __init__(self, node: Node, rate: float, clock: Clock, act: Callable[[], None]) -> None:
        self._act = act
        self._waiting = False
        self._timer = node.create_timer(1.0 / rate, self._tick, clock=clock)
        self._timer.cancel()  # runs for one period after a call

    @property
    def free(self) -> bool:
        """Whether `changed` would call at once."""
        return bool(self._timer.is_canceled())

    def changed(self) -> None:
        """Call now if the last call is a period ago, else when it is."""
        if self.free:
            self._timer.reset()
            self._act()
        else:
            self._waiting = True

    def _tick(self) -> None:
        if self._waiting:
            self._waiting = False
            self._act()
        else:
            self._timer.cancel()
