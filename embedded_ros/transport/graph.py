# SPDX-License-Identifier: Apache-2.0
"""The ROS graph: who is there, in ROS's own terms.

Endpoints come from discovery; which node they belong to is told by the transient-local topic
``ros_discovery_info``, on which every participant lists its nodes and their writers and readers.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from ..interfaces.registry import registry
from .base import Endpoint, Participant, Qos

DISCOVERY_TYPE = "rmw_dds_common/msg/ParticipantEntitiesInfo"
_PREFIXES = {"rt": "topic", "rq": "request", "rr": "reply"}


def dds_type_name(name: str) -> str:
    """``std_msgs/msg/String`` -> ``std_msgs::msg::dds_::String_``."""
    package, kind, short = name.split("/")
    return f"{package}::{kind}::dds_::{short}_"


def ros_type_name(name: str) -> str:
    """The reverse of :func:`dds_type_name`; names of other shapes stay as they are."""
    parts = name.split("::")
    if len(parts) == 4 and parts[2] == "dds_" and parts[3].endswith("_"):
        return f"{parts[0]}/{parts[1]}/{parts[3][:-1]}"
    return name


def split_topic(topic: str) -> tuple[str, str]:
    """A DDS topic as (kind, ROS name); kind is ``topic``, ``request``, ``reply`` or ``other``."""
    prefix, slash, rest = topic.partition("/")
    kind = _PREFIXES.get(prefix)
    return (kind, "/" + rest) if kind and slash else ("other", topic)


def user_data_value(user_data: bytes, key: str) -> str:
    """One value of the ``key=value;`` list that endpoints announce, or an empty string."""
    for entry in user_data.decode("ascii", "replace").split(";"):
        name, _, value = entry.partition("=")
        if name == key:
            return value
    return ""


@dataclass
class NodeEntry:
    """A node and the guids of its endpoints."""

    namespace: str
    name: str
    readers: list[bytes] = field(default_factory=list)
    writers: list[bytes] = field(default_factory=list)

    @property
    def key(self) -> tuple[str, str]:
        return self.namespace, self.name


class Graph:
    """Announces this process's nodes and knows everybody's."""

    def __init__(self, participant: Participant) -> None:
        self._participant = participant
        self._lock = threading.RLock()
        self._nodes: list[NodeEntry] = []
        self._others: dict[bytes, list[NodeEntry]] = {}
        cls = registry.message_class(DISCOVERY_TYPE)
        type_hash = registry.type_hash(DISCOVERY_TYPE)
        self._info: Any = cls
        self._serialize = registry.serializer(cls)
        self._deserialize = registry.deserializer(cls)
        arguments = ("ros_discovery_info", dds_type_name(DISCOVERY_TYPE), type_hash)
        self._writer = participant.create_writer(*arguments, Qos(transient_local=True, depth=1))
        self._reader = participant.create_reader(
            *arguments, Qos(transient_local=True, keep_all=True)
        )

    def add_node(self, namespace: str, name: str) -> NodeEntry:
        """Announce a node."""
        with self._lock:
            entry = NodeEntry(namespace, name)
            self._nodes.append(entry)
            self.announce()
            return entry

    def remove_node(self, entry: NodeEntry) -> None:
        """Take a node back."""
        with self._lock:
            self._nodes = [node for node in self._nodes if node is not entry]
            self.announce()

    def announce(self) -> None:
        """Publish the present list of nodes; call it after changing an entry."""
        with self._lock:
            message = self._info()
            _set_gid(message.gid, self._participant.guid)
            node_type: Any = registry.message_class("rmw_dds_common/msg/NodeEntitiesInfo")
            for entry in self._nodes:
                node = node_type(node_namespace=entry.namespace, node_name=entry.name)
                node.reader_gid_seq = [_make_gid(guid) for guid in entry.readers]
                node.writer_gid_seq = [_make_gid(guid) for guid in entry.writers]
                message.node_entities_info_seq.append(node)
            self._writer.write(self._serialize(message))

    def _read_others(self) -> None:
        for sample in self._reader.take(1000):
            try:
                message = self._deserialize(sample.payload)
            except ValueError:
                continue
            entries = [
                NodeEntry(
                    node.node_namespace,
                    node.node_name,
                    [gid.data.tobytes() for gid in node.reader_gid_seq],
                    [gid.data.tobytes() for gid in node.writer_gid_seq],
                )
                for node in message.node_entities_info_seq
            ]
            self._others[message.gid.data.tobytes()] = entries

    def endpoints(self) -> list[Endpoint]:
        """All endpoints in the domain."""
        return self._participant.endpoints()

    def nodes(self) -> list[NodeEntry]:
        """All nodes whose participant is alive, this process's included."""
        with self._lock:
            alive = {endpoint.participant for endpoint in self.endpoints()}
            self._read_others()
            self._others = {guid: nodes for guid, nodes in self._others.items() if guid in alive}
            mine = self._participant.guid
            others = [n for guid, nodes in self._others.items() if guid != mine for n in nodes]
            return [*self._nodes, *others]

    def owner(self, guid: bytes, nodes: Iterable[NodeEntry]) -> NodeEntry | None:
        """The node that an endpoint belongs to."""
        return next((n for n in nodes if guid in n.readers or guid in n.writers), None)

    def close(self) -> None:
        """Stop announcing."""
        self._writer.close()
        self._reader.close()


def _set_gid(gid: Any, guid: bytes) -> None:
    gid.data = list(guid)


def _make_gid(guid: bytes) -> Any:
    gid: Any = registry.message_class("rmw_dds_common/msg/Gid")()
    _set_gid(gid, guid)
    return gid
