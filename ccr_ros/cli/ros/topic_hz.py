# SPDX-License-Identifier: Apache-2.0
"""``ccr topic hz``."""

from __future__ import annotations

import argparse
import statistics
from collections import deque
from typing import Any

from ccr_ros.cli.ros.graph import full_name, graph_node
from ccr_ros.cli.ros.topic_type import expression, type_from_graph
from ccr_ros.cli.ros.verbs import Verbs, positive_int


def add_verb(verbs: Verbs) -> None:
    """Declare ``hz``."""
    one = verbs.add("hz", run_hz, "measure how often messages come")
    one.add_argument("topic_name", help="name of the topic, as /chatter")
    one.add_argument(
        "-w",
        "--window",
        type=positive_int,
        default=10000,
        metavar="N",
        help="over how many messages (default: 10000)",
    )
    one.add_argument(
        "--filter", metavar="EXPR", help="count messages for which this is true: 'm.data > 3'"
    )
    one.add_argument("--wall-time", action="store_true", help="not in simulated time")


class Rate:
    """Statistics of the times between messages.

    Args:
        window: How many of the last intervals count.
    """

    def __init__(self, window: int) -> None:
        self._intervals: deque[int] = deque(maxlen=window)
        self._last: int | None = None
        self._told: int | None = None

    def add(self, now: int) -> None:
        """Note a message at a time in nanoseconds; going back in time starts anew."""
        if self._last is not None and now >= self._last:
            self._intervals.append(now - self._last)
        elif self._last is not None:
            print("time has reset, resetting counters")
            self._intervals.clear()
            self._told = None
        if self._told is None:
            self._told = now
        self._last = now

    def report(self) -> str | None:
        """Return the statistics if a second of messages has come since the last time, else None."""
        if self._last is None or self._told is None or self._last < self._told + 1_000_000_000:
            return None
        self._told = self._last
        seconds = [interval * 1e-9 for interval in self._intervals]
        mean = statistics.fmean(seconds)
        return (
            f"average rate: {1.0 / mean if mean else 0.0:.3f}\n"
            f"\tmin: {min(seconds):.3f}s max: {max(seconds):.3f}s "
            f"std dev: {statistics.pstdev(seconds):.5f}s window: {len(seconds)}"
        )


def run_hz(args: argparse.Namespace) -> None:
    """Print the rate, once a second, until told to end."""
    import rclpy
    from rclpy.clock import Clock, ClockType
    from rclpy.qos import qos_profile_sensor_data

    passes = expression(args.filter)
    with graph_node(args) as node:
        name = full_name(node, args.topic_name)
        kind = type_from_graph(node, name, limit=None)
        clock = Clock(clock_type=ClockType.SYSTEM_TIME) if args.wall_time else node.get_clock()
        rate = Rate(args.window)

        def receive(message: Any) -> None:
            now = clock.now().nanoseconds
            # Time 0: simulated, and no /clock yet.
            if now and (args.filter is None or passes(message)):
                rate.add(now)
                if text := rate.report():
                    print(text)

        # Without a filter nobody looks into the messages: they are not decoded.
        node.create_subscription(
            kind, name, receive, qos_profile_sensor_data, raw=args.filter is None
        )
        rclpy.spin(node)
