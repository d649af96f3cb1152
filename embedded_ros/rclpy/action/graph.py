# SPDX-License-Identifier: Apache-2.0
"""Which actions there are. An action is known by its feedback topic, as in rcl_action."""

from __future__ import annotations

from ..node import Node
from ..node_graph import NamesAndTypes

_TOPIC, _TYPE = "/_action/feedback", "_FeedbackMessage"


def _actions(topics: NamesAndTypes) -> NamesAndTypes:
    return [
        (topic.removesuffix(_TOPIC), [name.removesuffix(_TYPE) for name in types])
        for topic, types in topics
        if topic.endswith(_TOPIC)
    ]


def get_action_client_names_and_types_by_node(
    node: Node, remote_node_name: str, remote_node_namespace: str
) -> NamesAndTypes:
    """The actions that a node has clients of.

    :raises NodeNameNonExistentError: no such node is known.
    """
    found = node.get_subscriber_names_and_types_by_node(remote_node_name, remote_node_namespace)
    return _actions(found)


def get_action_server_names_and_types_by_node(
    node: Node, remote_node_name: str, remote_node_namespace: str
) -> NamesAndTypes:
    """The actions that a node serves.

    :raises NodeNameNonExistentError: no such node is known.
    """
    found = node.get_publisher_names_and_types_by_node(remote_node_name, remote_node_namespace)
    return _actions(found)


def get_action_names_and_types(node: Node) -> NamesAndTypes:
    """All actions and their types."""
    return _actions(node.get_topic_names_and_types())
