# SPDX-License-Identifier: Apache-2.0
"""Look at actions, and send goals, as `ros2 action` does.

  ccr action list -t
  ccr action send_goal /fibonacci example_interfaces/action/Fibonacci '{order: 5}' -f

`ccr action VERB --help` tells more.
"""

from __future__ import annotations

import argparse
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

from ccr_ros.cli.ros.graph import (
    EXIT_TERMINATED,
    full_name,
    graph_node,
    node_names,
    spin_until,
    split_node_name,
    types_of,
    visible,
    wait_for_type,
)
from ccr_ros.cli.ros.types import action_type, fill, full_type_name, read_values
from ccr_ros.cli.ros.verbs import Verbs, positive_float
from ccr_ros.cli.ros.verbs import run_verb as run
from ccr_ros.model.errors import CcrError

__all__ = ["add_arguments", "run"]

EXIT_NOT_SUCCEEDED = 1


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verbs and their arguments."""
    verbs = Verbs(parser)
    one = verbs.add("list", run_list, "list the actions")
    one.add_argument("-t", "--show-types", action="store_true", help="with their types")
    one.add_argument("-c", "--count-actions", action="store_true", help="only how many")

    one = verbs.add(
        "send_goal",
        run_send_goal,
        "send a goal and wait for its result (exit code 1 if it does not succeed)",
    )
    one.add_argument("action_name", help="name of the action, as /fibonacci")
    one.add_argument("action_type", help="its type, as example_interfaces/action/Fibonacci")
    values = one.add_mutually_exclusive_group()
    values.add_argument(
        "goal",
        nargs="?",
        default="{}",
        help="YAML, as '{order: 5}'; fields that are not given keep their default",
    )
    values.add_argument("--stdin", action="store_true", help="read the goal from standard input")
    one.add_argument("-f", "--feedback", action="store_true", help="print the feedback")
    one.add_argument(
        "--timeout",
        metavar="N",
        type=positive_float,
        default=5.0,
        help="seconds to wait for the action server to come up (default: 5)",
    )

    one = verbs.add("info", run_info, "tell who serves and who uses an action")
    one.add_argument("action_name", help="name of the action")
    one.add_argument("-t", "--show-types", action="store_true", help="with types")
    one.add_argument("-c", "--count", action="store_true", help="only how many")

    one = verbs.add("type", run_type, "print an action's type")
    one.add_argument("action_name", help="name of the action")


def run_list(args: argparse.Namespace) -> None:
    """Print the actions."""
    with graph_node(args) as node:
        from rclpy.action import get_action_names_and_types

        actions = visible(get_action_names_and_types(node), include_hidden=False)
    if args.count_actions:
        print(len(actions))
    else:
        for name, types in actions:
            print(f"{name} [{', '.join(types)}]" if args.show_types else name)


def run_type(args: argparse.Namespace) -> None:
    """Print the types of an action."""
    with graph_node(args) as node:
        print(*_types_of(node, full_name(node, args.action_name)), sep="\n")


def _types_of(node: Any, name: str) -> list[str]:
    from rclpy.action import get_action_names_and_types

    return types_of(node, "action", name, lambda: get_action_names_and_types(node))


def run_info(args: argparse.Namespace) -> None:
    """Print clients and servers of an action."""
    with graph_node(args) as node:
        from rclpy.action import (
            get_action_client_names_and_types_by_node,
            get_action_server_names_and_types_by_node,
        )

        name = full_name(node, args.action_name)
        _types_of(node, name)
        print(f"Action: {name}")
        for what, ask in (
            ("clients", get_action_client_names_and_types_by_node),
            ("servers", get_action_server_names_and_types_by_node),
        ):
            users = {
                user: dict(ask(node, *split_node_name(user))).get(name)
                for user in node_names(node, include_hidden=True)
            }
            found = {user: types for user, types in users.items() if types}
            print(f"Action {what}: {len(found)}")
            for user, types in found.items() if not args.count else ():
                print(f"    {user} [{', '.join(types)}]" if args.show_types else f"    {user}")


@contextmanager
def _interruptible() -> Iterator[Callable[[], int]]:
    """Give a function that tells which signal has come, 0 for none; the block goes on when it does.

    Raises:
        KeyboardInterrupt: at the end, SIGINT has come; SystemExit: SIGTERM has.
    """
    received = 0

    def note(number: int, frame: object) -> None:
        nonlocal received
        received = number

    before = {number: signal.signal(number, note) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield lambda: received
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if received == signal.SIGINT:
        raise KeyboardInterrupt
    if received:
        raise SystemExit(EXIT_TERMINATED)


def run_send_goal(args: argparse.Namespace) -> int:
    """Send a goal, print what comes of it, and cancel it if interrupted."""
    values = read_values(args.goal, args.stdin)
    # rclpy stays up when a signal comes: the goal is to be cancelled then.
    with (
        _interruptible() as interrupted,
        graph_node(args, settle=False, signals=False) as node,
    ):
        from rclpy.action import ActionClient, get_action_names_and_types

        name = full_name(node, args.action_name)
        kind = action_type(args.action_type)
        goal = kind.Goal()
        fill(goal, values)
        print("Waiting for an action server to become available...")
        type_name = full_type_name(args.action_type, "action")
        actions = partial(get_action_names_and_types, node)
        wait_for_type(node, "action", name, type_name, actions, args.timeout)
        client = ActionClient(node, kind, name)
        try:
            if not spin_until(
                node, lambda: client.server_is_ready() or bool(interrupted()), args.timeout
            ):
                raise CcrError(f"action {name!r} has clients, but no server")
            return 0 if interrupted() else _follow(node, client, goal, args.feedback, interrupted)
        finally:
            client.destroy()
    return 0


def _follow(
    node: Any, client: Any, goal: Any, feedback: bool, interrupted: Callable[[], int]
) -> int:
    import rclpy
    from action_msgs.msg import GoalStatus
    from rosidl_runtime_py import message_to_yaml

    def show_feedback(message: Any) -> None:
        print(f"Feedback:\n    {message_to_yaml(message.feedback)}")

    def wait(future: Any) -> bool:
        """Tell whether the future is done, rather than a signal there."""
        while not future.done() and not interrupted():
            rclpy.spin_until_future_complete(node, future, timeout_sec=0.1)
        return future.done()

    print(f"Sending goal:\n     {message_to_yaml(goal)}")
    accepting = client.send_goal_async(goal, show_feedback if feedback else None)
    if not wait(accepting):
        return EXIT_NOT_SUCCEEDED
    handle = accepting.result()
    if not handle.accepted:
        print("Goal was rejected.")
        return EXIT_NOT_SUCCEEDED
    print(f"Goal accepted with ID: {bytes(handle.goal_id.uuid).hex()}\n")
    finishing = handle.get_result_async()
    if not wait(finishing):
        print("Canceling goal...")
        cancelling = handle.cancel_goal_async()
        if not spin_until(node, cancelling.done, limit=5.0):
            raise CcrError("the action server does not answer; the goal may still run")
        if not cancelling.result().goals_canceling:
            raise CcrError("the action server did not cancel the goal")
        print("Goal canceled.")
        return EXIT_NOT_SUCCEEDED
    result = finishing.result()
    names = {
        value: key.removeprefix("STATUS_")
        for key in dir(GoalStatus)
        if key.startswith("STATUS_") and isinstance(value := getattr(GoalStatus, key), int)
    }
    print(f"Result:\n    {message_to_yaml(result.result)}")
    print(f"Goal finished with status: {names.get(result.status, 'UNKNOWN')}")
    return 0 if result.status == GoalStatus.STATUS_SUCCEEDED else EXIT_NOT_SUCCEEDED
