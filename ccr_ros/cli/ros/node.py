# SPDX-License-Identifier: Apache-2.0
"""Look at the nodes of the ROS graph, as `ros2 node` does.

  ccr node list
  ccr node info /solver_node

`ccr node VERB --help` tells more.
"""

from __future__ import annotations

import argparse
import sys

from ccr_ros.cli.ros.graph import find_node, graph_node, node_names, split_node_name, visible
from ccr_ros.cli.ros.verbs import Verbs
from ccr_ros.cli.ros.verbs import run_verb as run

__all__ = ["add_arguments", "run"]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verbs and their arguments."""
    verbs = Verbs(parser)
    one = verbs.add("list", run_list, "list the nodes")
    one.add_argument("-a", "--all", action="store_true", help="hidden ones as well")
    one.add_argument("-c", "--count-nodes", action="store_true", help="only how many")

    one = verbs.add("info", run_info, "tell a node's topics, services and actions")
    one.add_argument("node_name", help="full name of the node, as /talker")
    one.add_argument(
        "--include-hidden", action="store_true", help="hidden topics, services and actions as well"
    )


def run_list(args: argparse.Namespace) -> None:
    """Print the nodes."""
    with graph_node(args) as node:
        names = node_names(node, args.all)
    if args.count_nodes:
        print(len(names))
        return
    if len(set(names)) < len(names):
        print(
            "WARNING: Be aware that there are nodes in the graph that share an exact name, "
            "which can have unintended side effects.",
            file=sys.stderr,
        )
    for name in names:
        print(name)


def run_info(args: argparse.Namespace) -> None:
    """Print everything a node has."""
    with graph_node(args) as node:
        from rclpy.action import (
            get_action_client_names_and_types_by_node,
            get_action_server_names_and_types_by_node,
        )

        full = find_node(node, args.node_name)
        count = node_names(node, include_hidden=True).count(full)
        if count > 1:
            print(
                f'There are {count} nodes in the graph with the exact name "{full}". '
                "You are seeing information about only one of them.",
                file=sys.stderr,
            )
        name, namespace = split_node_name(full)
        parts = {
            "Subscribers": node.get_subscriber_names_and_types_by_node(name, namespace),
            "Publishers": node.get_publisher_names_and_types_by_node(name, namespace),
            "Service Servers": node.get_service_names_and_types_by_node(name, namespace),
            "Service Clients": node.get_client_names_and_types_by_node(name, namespace),
            "Action Servers": get_action_server_names_and_types_by_node(node, name, namespace),
            "Action Clients": get_action_client_names_and_types_by_node(node, name, namespace),
        }
        print(full)
        for title, pairs in parts.items():
            print(f"  {title}:")
            lines = [
                f"    {one}: {', '.join(types)}"
                for one, types in visible(pairs, args.include_hidden)
            ]
            print("\n".join(lines))  # ros2 leaves an empty line where there is nothing
