# SPDX-License-Identifier: Apache-2.0
"""``ccr topic echo``."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

import yaml

from ccr_ros.cli.ros.graph import full_name, graph_node
from ccr_ros.cli.ros.qos import add_qos_arguments, profile_for_publishers, profile_of
from ccr_ros.cli.ros.topic_type import expression, type_from_graph
from ccr_ros.cli.ros.types import message_type
from ccr_ros.cli.ros.verbs import Verbs, natural, positive_float
from ccr_ros.model.errors import CcrError, UnknownKey

#: How long to wait for a topic that nobody has yet, without --timeout [s].
WAIT_FOR_TOPIC = 5.0


def add_verb(verbs: Verbs) -> None:
    """Declare ``echo``."""
    one = verbs.add("echo", run_echo, "print the messages of a topic")
    one.add_argument("topic_name", help="name of the topic, as /chatter")
    one.add_argument("message_type", nargs="?", help="its type; default: found in the graph")
    one.add_argument("--once", action="store_true", help="end after the first message")
    one.add_argument(
        "--timeout", type=positive_float, metavar="N", help="end after so many seconds"
    )
    one.add_argument("--field", metavar="A.B", help="print this part of the messages only")
    one.add_argument(
        "--filter", metavar="EXPR", help="print messages for which this is true: 'm.data > 3'"
    )
    one.add_argument("--csv", action="store_true", help="one line each, values between commas")
    one.add_argument("--flow-style", action="store_true", help="YAML in braces")
    one.add_argument("--raw", action="store_true", help="the bytes as they come")
    one.add_argument("--no-arr", action="store_true", help="only type and length of arrays")
    one.add_argument("--no-str", action="store_true", help="only the length of strings")
    one.add_argument("-f", "--full-length", action="store_true", help="do not truncate")
    one.add_argument(
        "-l",
        "--truncate-length",
        type=natural,
        default=128,
        metavar="N",
        help="truncate arrays and strings to this length (default: 128)",
    )
    one.add_argument(
        "-i",
        "--include-message-info",
        action="store_true",
        help="with times of sending and receipt",
    )
    one.add_argument("--no-lost-messages", action="store_true", help="do not tell of lost messages")
    add_qos_arguments(one, "sensor_data")


def run_echo(args: argparse.Namespace) -> int:
    """Print messages until told to end."""
    import rclpy
    from rclpy.event_handler import SubscriptionEventCallbacks
    from rclpy.task import Future

    passes = expression(args.filter)
    with graph_node(args) as node:
        name = full_name(node, args.topic_name)
        profile_of(args)  # a bad one is told before any waiting
        if args.message_type is None:
            kind = type_from_graph(node, name, args.timeout or WAIT_FOR_TOPIC)
        else:
            kind = message_type(args.message_type)
        part = _selector(kind, args.field)
        show = _printer(args)
        done = Future()
        shown = 0

        def receive(message: Any, info: dict[str, Any]) -> None:
            nonlocal shown
            chosen = message if args.raw else part(message)
            if not done.done() and (args.raw or passes(chosen)):
                show(chosen, info)
                shown += 1
                if args.once:
                    done.set_result(True)

        profile = profile_for_publishers(node, name, args)
        lost = SubscriptionEventCallbacks(
            message_lost=None if args.no_lost_messages else _tell_of_loss
        )
        node.create_subscription(kind, name, receive, profile, event_callbacks=lost, raw=args.raw)
        if args.timeout is not None:
            node.create_timer(args.timeout, lambda: done.done() or done.set_result(False))
        rclpy.spin_until_future_complete(node, done)
    if args.once and not shown:
        raise CcrError(f"no message on topic {name!r} in {args.timeout:g} s")
    return 0


def _tell_of_loss(status: Any) -> None:
    print(
        "A message was lost!!!\n"
        f"\ttotal count change:{status.total_count_change}\n"
        f"\ttotal count: {status.total_count}---"
    )


def _selector(kind: Any, path: str | None) -> Callable[[Any], Any]:
    """Return a function that gives the part of a message which ``--field`` names.

    Raises:
        UnknownKey: messages of this kind have no such part; it lists the fields there are.
    """
    names = [name for name in (path or "").split(".") if name]
    part = kind()
    for depth, name in enumerate(names):
        fields: dict[str, str] = getattr(part, "get_fields_and_field_types", dict)()
        if name not in fields:
            raise UnknownKey(".".join(names[: depth + 1]), name, ", ".join(fields) or "none")
        part = getattr(part, name)

    def select(message: Any) -> Any:
        for name in names:
            message = getattr(message, name)
        return message

    return select


def _printer(args: argparse.Namespace) -> Callable[[Any, dict[str, Any]], None]:
    from rosidl_runtime_py import message_to_csv, message_to_yaml

    shorten: dict[str, Any] = {
        "truncate_length": None if args.full_length else args.truncate_length,
        "no_arr": args.no_arr,
        "no_str": args.no_str,
    }

    def show(message: Any, info: dict[str, Any]) -> None:
        if not hasattr(message, "get_fields_and_field_types"):  # a plain value, or raw bytes
            if args.include_message_info:
                print(f"---Got new message, message info:---\n{info}\n---Message data:---")
            print(message, end="\n---\n")
        elif args.csv:
            stamps = [str(value) for value in info.values()] if args.include_message_info else []
            print(",".join([*stamps, message_to_csv(message, **shorten)]))
        else:
            if args.include_message_info:
                print(yaml.dump(info), end="---\n")
            print(message_to_yaml(message, flow_style=args.flow_style, **shorten), end="---\n")

    return show
