# SPDX-License-Identifier: Apache-2.0
"""Look at topics, and publish on them, as `ros2 topic` does.

ccr topic list -t
ccr topic echo /gripper/joint_states --once
ccr topic pub -1 /chatter std_msgs/msg/String 'data: hello'
ccr topic hz /gripper/joint_states
"""

from __future__ import annotations

import argparse
from typing import Any

from ccr_ros.cli.ros import topic_echo, topic_hz, topic_pub
from ccr_ros.cli.ros.graph import NamesAndTypes, full_name, graph_node, plural, types_of, visible
from ccr_ros.cli.ros.verbs import Verbs
from ccr_ros.cli.ros.verbs import run_verb as run

__all__ = ["add_arguments", "run"]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verbs and their arguments."""
    verbs = Verbs(parser)
    one = verbs.add("list", run_list, "list the topics")
    one.add_argument("-t", "--show-types", action="store_true", help="with their types")
    one.add_argument("-c", "--count-topics", action="store_true", help="only how many")
    one.add_argument("-v", "--verbose", action="store_true", help="with types and who uses them")
    one.add_argument("--include-hidden-topics", action="store_true", help="hidden ones as well")

    topic_echo.add_verb(verbs)
    topic_pub.add_verb(verbs)
    topic_hz.add_verb(verbs)

    one = verbs.add("info", run_info, "tell a topic's type and who publishes and subscribes")
    one.add_argument("topic_name", help="name of the topic, as /chatter")
    one.add_argument("-v", "--verbose", action="store_true", help="with nodes and their QoS")

    one = verbs.add("type", run_type, "print a topic's type")
    one.add_argument("topic_name", help="name of the topic, as /chatter")

    one = verbs.add("find", run_find, "list the topics of a type")
    one.add_argument("topic_type", help="the type, as std_msgs/msg/String")
    one.add_argument("-c", "--count-topics", action="store_true", help="only how many")
    one.add_argument("--include-hidden-topics", action="store_true", help="hidden ones as well")


def run_list(args: argparse.Namespace) -> None:
    """Print the topics."""
    with graph_node(args) as node:
        topics = visible(node.get_topic_names_and_types(), args.include_hidden_topics)
        if args.count_topics:
            print(len(topics))
        elif args.verbose:
            _print_users("Published topics", "publisher", topics, node.count_publishers)
            _print_users("Subscribed topics", "subscriber", topics, node.count_subscribers)
        else:
            for name, types in topics:
                print(f"{name} [{', '.join(types)}]" if args.show_types else name)


def _print_users(title: str, noun: str, topics: NamesAndTypes, count: Any) -> None:
    print(f"{title}:")
    for name, types in topics:
        if users := count(name):
            print(f" * {name} [{', '.join(types)}] {plural(users, noun)}")
    print()


def run_info(args: argparse.Namespace) -> None:
    """Print type, publishers and subscriptions of a topic."""
    with graph_node(args) as node:
        name = full_name(node, args.topic_name)
        types = types_of(node, "topic", name, node.get_topic_names_and_types)
        end = "\n\n" if args.verbose else "\n"
        print(f"Type: {types[0] if len(types) == 1 else types}", end=end)
        for what, infos in (
            ("Publisher", node.get_publishers_info_by_topic(name)),
            ("Subscription", node.get_subscriptions_info_by_topic(name)),
        ):
            print(f"{what} count: {len(infos)}", end=end)
            for info in infos if args.verbose else ():
                print(info, end=end)


def run_type(args: argparse.Namespace) -> None:
    """Print the types of a topic."""
    with graph_node(args) as node:
        name = full_name(node, args.topic_name)
        print(*types_of(node, "topic", name, node.get_topic_names_and_types), sep="\n")


def run_find(args: argparse.Namespace) -> None:
    """Print the topics of a type."""
    with graph_node(args) as node:
        topics = visible(node.get_topic_names_and_types(), args.include_hidden_topics)
    found = [name for name, types in topics if args.topic_type in types]
    print(len(found) if args.count_topics else "\n".join(found), end="\n" if found else "")
