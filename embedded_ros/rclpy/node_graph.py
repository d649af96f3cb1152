# SPDX-License-Identifier: Apache-2.0
"""The part of a node that looks at the ROS graph."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from embedded_ros.transport import Endpoint
from embedded_ros.transport.graph import NodeEntry, ros_type_name, split_topic, user_data_value

from ._rclpy_pybind11 import NodeNameNonExistentError
from .exceptions import NameValidationException
from .qos import QoSProfile
from .topic_endpoint_info import TopicEndpointInfo, TopicEndpointTypeEnum
from .type_hash import TypeHash

if TYPE_CHECKING:
    from .context import Context

NamesAndTypes = list[tuple[str, list[str]]]


def _collect(pairs: list[tuple[str, str]]) -> NamesAndTypes:
    result: dict[str, set[str]] = {}
    for name, type_name in pairs:
        result.setdefault(name, set()).add(type_name)
    return [(name, sorted(types)) for name, types in sorted(result.items())]


def _service_pair(endpoint: Endpoint, kind: str) -> tuple[str, str] | None:
    """Service name and type of a request or reply endpoint."""
    found, name = split_topic(endpoint.topic)
    suffix = "Request" if kind == "request" else "Reply"
    if found != kind or not name.endswith(suffix):
        return None
    type_name = ros_type_name(endpoint.type_name)
    for part in ("_Request", "_Response"):
        type_name = type_name.removesuffix(part)
    return name.removesuffix(suffix), type_name


class GraphViewer:
    """Queries on nodes, topics and services. They show what discovery has found so far."""

    _context: Context

    def resolve_topic_name(self, topic: str, *, only_expand: bool = False) -> str:
        raise NotImplementedError

    def resolve_service_name(self, service: str, *, only_expand: bool = False) -> str:
        raise NotImplementedError

    def _ros_endpoints(self) -> list[Endpoint]:
        return self._context.graph.endpoints()

    def get_topic_names_and_types(self, no_demangle: bool = False) -> NamesAndTypes:
        """All topics and their types; ``no_demangle`` gives the middleware's names."""
        pairs = []
        for endpoint in self._ros_endpoints():
            kind, name = split_topic(endpoint.topic)
            if no_demangle:
                if not endpoint.topic.startswith("DCPS"):
                    pairs.append((endpoint.topic, endpoint.type_name))
            elif kind == "topic":
                pairs.append((name, ros_type_name(endpoint.type_name)))
        return _collect(pairs)

    def get_service_names_and_types(self) -> NamesAndTypes:
        """All services and their types."""
        pairs = [_service_pair(e, "request") for e in self._ros_endpoints()]
        return _collect([pair for pair in pairs if pair])

    def _ros_of_node(self, node_name: str, node_namespace: str) -> list[Endpoint]:
        entries = [
            n for n in self._context.graph.nodes() if n.key == (node_namespace or "/", node_name)
        ]
        if not entries:
            raise NodeNameNonExistentError(
                f"cannot get topic names and types for nonexistent node: "
                f"{node_namespace}/{node_name}"
            )
        guids = {guid for entry in entries for guid in [*entry.readers, *entry.writers]}
        return [endpoint for endpoint in self._ros_endpoints() if endpoint.guid in guids]

    def _ros_topics_of_node(
        self, node_name: str, node_namespace: str, readers: bool, raw: bool
    ) -> NamesAndTypes:
        pairs = []
        for endpoint in self._ros_of_node(node_name, node_namespace):
            kind, name = split_topic(endpoint.topic)
            if endpoint.is_reader == readers and (raw or kind == "topic"):
                named = (endpoint.topic, endpoint.type_name)
                pairs.append(named if raw else (name, ros_type_name(endpoint.type_name)))
        return _collect(pairs)

    def get_publisher_names_and_types_by_node(
        self, node_name: str, node_namespace: str, no_demangle: bool = False
    ) -> NamesAndTypes:
        """What a node publishes.

        :raises NodeNameNonExistentError: no such node is known.
        """
        return self._ros_topics_of_node(node_name, node_namespace, False, no_demangle)

    def get_subscriber_names_and_types_by_node(
        self, node_name: str, node_namespace: str, no_demangle: bool = False
    ) -> NamesAndTypes:
        """What a node subscribes to.

        :raises NodeNameNonExistentError: no such node is known.
        """
        return self._ros_topics_of_node(node_name, node_namespace, True, no_demangle)

    def get_service_names_and_types_by_node(
        self, node_name: str, node_namespace: str
    ) -> NamesAndTypes:
        """What a node serves.

        :raises NodeNameNonExistentError: no such node is known.
        """
        readers = [e for e in self._ros_of_node(node_name, node_namespace) if e.is_reader]
        return _collect([pair for pair in (_service_pair(e, "request") for e in readers) if pair])

    def get_client_names_and_types_by_node(
        self, node_name: str, node_namespace: str
    ) -> NamesAndTypes:
        """Which services a node calls.

        :raises NodeNameNonExistentError: no such node is known.
        """
        readers = [e for e in self._ros_of_node(node_name, node_namespace) if e.is_reader]
        return _collect([pair for pair in (_service_pair(e, "reply") for e in readers) if pair])

    def get_node_names_and_namespaces(self) -> list[tuple[str, str]]:
        """Names and namespaces of all nodes."""
        return [(entry.name, entry.namespace) for entry in self._context.graph.nodes()]

    def get_node_names_and_namespaces_with_enclaves(self) -> list[tuple[str, str, str]]:
        """Names, namespaces and security enclaves of all nodes."""
        return [(name, namespace, "/") for name, namespace in self.get_node_names_and_namespaces()]

    def get_node_names(self) -> list[str]:
        """Names of all nodes."""
        return [name for name, _ in self.get_node_names_and_namespaces()]

    def get_fully_qualified_node_names(self) -> list[str]:
        """Full names of all nodes."""
        pairs = self.get_node_names_and_namespaces()
        return [f"{namespace.rstrip('/')}/{name}" for name, namespace in pairs]

    def _ros_matching(self, topic: str, readers: bool) -> list[Endpoint]:
        return [e for e in self._ros_endpoints() if e.is_reader == readers and e.topic == topic]

    def _ros_queried(self, name: str, service: bool = False, remap: bool = False) -> str:
        resolve = self.resolve_service_name if service else self.resolve_topic_name
        try:
            return resolve(name, only_expand=not remap)
        except NameValidationException as error:
            kind = "service" if service else "topic"
            raise ValueError(f"{kind} name {name!r} is invalid: {error}") from error

    def count_publishers(self, topic_name: str) -> int:
        """How many publishers a topic has; its name is expanded but not remapped."""
        return len(self._ros_matching("rt" + self._ros_queried(topic_name), False))

    def count_subscribers(self, topic_name: str) -> int:
        """How many subscriptions a topic has; its name is expanded but not remapped."""
        return len(self._ros_matching("rt" + self._ros_queried(topic_name), True))

    def _ros_count_readers(self, service_name: str, kind: str) -> int:
        full = self._ros_queried(service_name, service=True)
        pairs = [_service_pair(e, kind) for e in self._ros_endpoints() if e.is_reader]
        return sum(pair is not None and pair[0] == full for pair in pairs)

    def count_clients(self, service_name: str) -> int:
        """How many clients a service has; its name is expanded but not remapped."""
        return self._ros_count_readers(service_name, "reply")

    def count_services(self, service_name: str) -> int:
        """How many servers a service has; its name is expanded but not remapped."""
        return self._ros_count_readers(service_name, "request")

    def _ros_infos(
        self, topic_name: str, no_mangle: bool, readers: bool
    ) -> list[TopicEndpointInfo]:
        topic = topic_name if no_mangle else "rt" + self._ros_queried(topic_name, remap=True)
        graph = self._context.graph
        nodes = graph.nodes()
        return [
            self._ros_info(e, graph.owner(e.guid, nodes))
            for e in self._ros_matching(topic, readers)
        ]

    @staticmethod
    def _ros_info(endpoint: Endpoint, owner: NodeEntry | None) -> TopicEndpointInfo:
        kind = (
            TopicEndpointTypeEnum.SUBSCRIPTION
            if endpoint.is_reader
            else TopicEndpointTypeEnum.PUBLISHER
        )
        return TopicEndpointInfo(
            node_name=owner.name if owner else "_NODE_NAME_UNKNOWN_",
            node_namespace=owner.namespace if owner else "_NODE_NAMESPACE_UNKNOWN_",
            topic_type=ros_type_name(endpoint.type_name),
            topic_type_hash=TypeHash.parse(user_data_value(endpoint.user_data, "typehash")),
            endpoint_type=kind,
            endpoint_gid=list(endpoint.guid),
            qos_profile=QoSProfile.of(endpoint.qos),
        )

    def get_publishers_info_by_topic(
        self, topic_name: str, no_mangle: bool = False
    ) -> list[TopicEndpointInfo]:
        """What is known of a topic's publishers; ``no_mangle``: by the middleware's name."""
        return self._ros_infos(topic_name, no_mangle, False)

    def get_subscriptions_info_by_topic(
        self, topic_name: str, no_mangle: bool = False
    ) -> list[TopicEndpointInfo]:
        """What is known of a topic's subscriptions; ``no_mangle`` takes the middleware's topic
        name.
        """
        return self._ros_infos(topic_name, no_mangle, True)

    def wait_for_node(self, fully_qualified_node_name: str, timeout: float) -> bool:
        """Wait until a node is in the graph; False after ``timeout`` seconds."""
        wanted = "/" + fully_qualified_node_name.lstrip("/")
        end = time.monotonic() + timeout
        while self._context.ok():
            if wanted in self.get_fully_qualified_node_names():
                return True
            left: Any = end - time.monotonic()
            if left <= 0:
                return False
            time.sleep(min(0.05, left))
        return False
