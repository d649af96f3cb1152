# SPDX-License-Identifier: Apache-2.0
"""``ccr topic pub``."""

from __future__ import annotations

import argparse
import itertools
import time
from typing import Any

from ccr_ros.cli.ros.graph import full_name, graph_node, plural, spin_until
from ccr_ros.cli.ros.qos import add_qos_arguments, profile_of
from ccr_ros.cli.ros.types import fill, message_type, read_values
from ccr_ros.cli.ros.verbs import Verbs, natural, positive_float
from ccr_ros.model.errors import CcrError

#: How long the last message may be on its way to reliable subscriptions [s].
_ACKNOWLEDGED_WITHIN = 5.0


def add_verb(verbs: Verbs) -> None:
    """Declare ``pub``."""
    one = verbs.add("pub", run_pub, "publish messages on a topic")
    one.add_argument("topic_name", help="name of the topic, as /chatter")
    one.add_argument("message_type", help="its type, as std_msgs/msg/String")
    values = one.add_mutually_exclusive_group()
    values.add_argument(
        "values",
        nargs="?",
        default="{}",
        help="YAML, as 'data: hello'; fields that are not given keep their default, "
        "a header 'auto' and a stamp 'now' get the time of each message",
    )
    values.add_argument("--stdin", action="store_true", help="read the values from standard input")
    one.add_argument(
        "-r", "--rate", metavar="N", type=positive_float, default=1.0, help="in Hz (default: 1)"
    )
    one.add_argument(
        "-p", "--print", metavar="N", type=natural, default=1, help="print every Nth message only"
    )
    times = one.add_mutually_exclusive_group()
    times.add_argument("-1", "--once", action="store_true", help="publish one message and end")
    times.add_argument(
        "-t", "--times", metavar="N", type=natural, default=0, help="end after so many messages"
    )
    one.add_argument(
        "-w",
        "--wait-matching-subscriptions",
        metavar="N",
        type=natural,
        help="wait for so many subscriptions first (default: 1 with --once or --times, else 0)",
    )
    one.add_argument(
        "--max-wait-time-secs", metavar="N", type=positive_float, help="wait no longer for them"
    )
    one.add_argument(
        "--keep-alive",
        metavar="N",
        type=positive_float,
        default=0.1,
        help="seconds to stay after the last message (default: 0.1)",
    )
    one.add_argument("-n", "--node-name", metavar="NAME", help="name of the publishing node")
    add_qos_arguments(one, "default")


def run_pub(args: argparse.Namespace) -> None:
    """Publish until told to end."""
    import rclpy
    from rclpy.duration import Duration

    times = 1 if args.once else args.times
    wanted = args.wait_matching_subscriptions
    wanted = min(times, 1) if wanted is None else wanted
    if args.max_wait_time_secs is not None and not wanted:
        raise CcrError("--max-wait-time-secs needs --once, --times or -w, else nothing is awaited")
    values = read_values(args.values, args.stdin)
    with graph_node(args, args.node_name, settle=False) as node:
        name = full_name(node, args.topic_name)
        kind = message_type(args.message_type)
        message = kind()
        stamps = fill(message, values, expand_header_auto=True, expand_time_now=True)
        publisher = node.create_publisher(kind, name, profile_of(args))
        _wait_for_subscriptions(node, publisher, wanted, args.max_wait_time_secs)
        print("publisher: beginning loop")
        counter = itertools.count(1)
        count = 0

        def publish() -> None:
            nonlocal count
            now = node.get_clock().now().to_msg()
            for put in stamps:
                put(now)
            count = next(counter)
            if args.print and count % args.print == 0:
                print(f"publishing #{count}: {message!r}\n")
            publisher.publish(message)

        publish()
        if times != 1:
            node.create_timer(1.0 / args.rate, publish)
        while times == 0 or count < times:
            rclpy.spin_once(node)
        # A subscription may find its publisher after that has found it.
        publisher.wait_for_all_acked(Duration(seconds=_ACKNOWLEDGED_WITHIN))
        time.sleep(args.keep_alive)


def _wait_for_subscriptions(node: Any, publisher: Any, wanted: int, limit: float | None) -> None:
    end = None if limit is None else time.monotonic() + limit

    def enough() -> bool:
        return publisher.get_subscription_count() >= wanted

    while not enough():
        left = None if end is None else end - time.monotonic()
        if left is not None and left <= 0:
            count = publisher.get_subscription_count()
            raise CcrError(
                f"topic {publisher.topic_name!r} has {plural(count, 'matching subscription')} "
                f"after {limit:g} s, and {wanted} are awaited"
            )
        print(f"Waiting for at least {wanted} matching subscription(s)...")
        spin_until(node, enough, 1.0 if left is None else min(left, 1.0))
