# SPDX-License-Identifier: Apache-2.0
"""Look at lifecycle nodes, and change their state, as `ros2 lifecycle` does.

  ccr lifecycle get /gripper
  ccr lifecycle set /gripper configure

`ccr lifecycle VERB --help` tells more.
"""

from __future__ import annotations

import argparse
import sys
from typing import Any

from ccr_ros.cli.ros.graph import (
    find_node,
    graph_node,
    node_names,
    spin_until,
    spin_until_seen,
    unknown,
)
from ccr_ros.cli.ros.verbs import Verbs
from ccr_ros.cli.ros.verbs import run_verb as run
from ccr_ros.model.errors import CcrError

__all__ = ["add_arguments", "run"]

EXIT_REFUSED = 1
_ANSWER_LIMIT = 5.0  # s; nodes answer in milliseconds while they spin, transitions excepted


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verbs and their arguments."""
    verbs = Verbs(parser)
    one = verbs.add("nodes", run_nodes, "list the lifecycle nodes")
    one.add_argument("-a", "--all", action="store_true", help="hidden ones as well")
    one.add_argument("-c", "--count-nodes", action="store_true", help="only how many")

    one = verbs.add("get", run_get, "tell the state of one node or of all")
    one.add_argument("node_name", nargs="?", help="full name of the node; default: all nodes")
    one.add_argument("--include-hidden-nodes", action="store_true", help="of hidden nodes as well")

    one = verbs.add("set", run_set, "trigger a transition (exit code 1 if it fails)")
    one.add_argument("node_name", help="full name of the node")
    one.add_argument("transition", help="label or number of the transition, as configure")
    one.add_argument("--include-hidden-nodes", action="store_true", help=argparse.SUPPRESS)

    one = verbs.add("list", run_list, "list the transitions that a node can make now")
    one.add_argument("node_name", help="full name of the node")
    one.add_argument("-a", "--all", action="store_true", help="those from other states as well")
    one.add_argument("--include-hidden-nodes", action="store_true", help=argparse.SUPPRESS)


def _lifecycle_nodes(node: Any, include_hidden: bool) -> list[str]:
    services = dict(node.get_service_names_and_types())
    return [
        name
        for name in dict.fromkeys(node_names(node, include_hidden))
        if "lifecycle_msgs/srv/GetState" in services.get(f"{name}/get_state", ())
    ]


def _find(node: Any, name: str) -> str:
    full = find_node(node, name)
    if not spin_until_seen(node, lambda: full in _lifecycle_nodes(node, include_hidden=True)):
        raise unknown("lifecycle node", full, _lifecycle_nodes(node, include_hidden=False))
    return full


def _call(
    node: Any, kind: Any, name: str, limit: float | None = _ANSWER_LIMIT, **fields: Any
) -> Any:
    client = node.create_client(kind, name)
    if not spin_until(node, client.service_is_ready, _ANSWER_LIMIT):
        raise CcrError(f"service {name!r} has gone")
    future = client.call_async(kind.Request(**fields))
    if not spin_until(node, future.done, limit):
        raise CcrError(f"service {name!r} does not answer; does its node spin?")
    return future.result()


def run_nodes(args: argparse.Namespace) -> None:
    """Print the lifecycle nodes."""
    with graph_node(args) as node:
        names = _lifecycle_nodes(node, args.all)
    if args.count_nodes:
        print(len(names))
    else:
        for name in names:
            print(name)


def run_get(args: argparse.Namespace) -> None:
    """Print the state of nodes."""
    with graph_node(args) as node:
        from lifecycle_msgs.srv import GetState

        if args.node_name:
            names = [_find(node, args.node_name)]
        else:
            names = _lifecycle_nodes(node, args.include_hidden_nodes)
        for name in names:
            state = _call(node, GetState, f"{name}/get_state").current_state
            prefix = "" if args.node_name else f"{name}: "
            print(f"{prefix}{state.label} [{state.id}]")


def _transitions(node: Any, name: str, every: bool = False) -> list[Any]:
    from lifecycle_msgs.srv import GetAvailableTransitions

    service = "get_transition_graph" if every else "get_available_transitions"
    return _call(node, GetAvailableTransitions, f"{name}/{service}").available_transitions


def run_list(args: argparse.Namespace) -> None:
    """Print transitions."""
    with graph_node(args) as node:
        for one in _transitions(node, _find(node, args.node_name), args.all):
            print(
                f"- {one.transition.label} [{one.transition.id}]\n"
                f"\tStart: {one.start_state.label}\n\tGoal: {one.goal_state.label}"
            )


def run_set(args: argparse.Namespace) -> int:
    """Trigger a transition."""
    with graph_node(args) as node:
        from lifecycle_msgs.srv import ChangeState

        name = _find(node, args.node_name)
        there = [one.transition for one in _transitions(node, name)]
        chosen = [one for one in there if args.transition == one.label] or [
            one for one in there if args.transition == str(one.id)
        ]
        if not chosen:
            labels = [f"{one.label} [{one.id}]" for one in there]
            raise CcrError(
                f"node {name!r} has no transition {args.transition!r} in its state; "
                f"it has: {', '.join(labels) or 'none'}"
            )
        service = f"{name}/change_state"
        if _call(node, ChangeState, service, limit=None, transition=chosen[0]).success:
            print("Transitioning successful")
            return 0
    print("Transitioning failed", file=sys.stderr)
    return EXIT_REFUSED
