# SPDX-License-Identifier: Apache-2.0
"""The ROS graph: who is there, in ROS's own terms.

Endpoints come from discovery; which node they belong to is told by the transient-local topic
``ros_discovery_info``, on which every participant lists its nodes and their writers and readers.
"""

from __future__ import annotations

import struct
import threading
from collections.abc import Iterable
from dataclasses import dataclass, field

from ..interfaces.registry import registry
from .base import Endpoint, Participant, Qos

DISCOVERY_TYPE = "rmw_dds_common/msg/ParticipantEntitiesInfo"
#: announcements that are kept undecoded while nobody asks for the nodes
_MANY_NEWS = 100
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
        self._news: dict[int, bytes] = {}
        self._asked = False
        type_hash = registry.type_hash(DISCOVERY_TYPE)
        self._deserialize = registry.deserializer(registry.message_class(DISCOVERY_TYPE))
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
        """Publish the present list of nodes; call it after changing an entry.

        A process announces once for everything that it makes, so this is encoded by hand.
        """
        with self._lock:
            parts = [b"\0\1\0\0", self._participant.guid, struct.pack("<I", len(self._nodes))]
            for entry in self._nodes:
                parts += [_string(entry.namespace), _string(entry.name)]
                for guids in (entry.readers, entry.writers):
                    parts += [struct.pack("<I", len(guids)), *guids]
            self._writer.write(b"".join(parts))
            self.keep_up()

    def keep_up(self) -> None:
        """Take in what others announced, of which only the newest matters; else it piles up."""
        with self._lock:
            self._take_news()
            if self._asked:
                self._participant.endpoints()
            if len(self._news) > _MANY_NEWS:
                self.nodes()

    def _take_news(self) -> None:
        while samples := self._reader.take(256):
            self._news.update((sample.writer, sample.payload) for sample in samples)

    def _read_news(self) -> None:
        news, self._news = self._news, {}
        for payload in news.values():
            try:
                message = self._deserialize(payload)
            except ValueError:
                continue
            self._others[message.gid.data.tobytes()] = [
                NodeEntry(
                    node.node_namespace,
                    node.node_name,
                    [gid.data.tobytes() for gid in node.reader_gid_seq],
                    [gid.data.tobytes() for gid in node.writer_gid_seq],
                )
                for node in message.node_entities_info_seq
            ]

    def endpoints(self) -> list[Endpoint]:
        """All endpoints in the domain."""
        self._asked = True
        return self._participant.endpoints()

    def nodes(self) -> list[NodeEntry]:
        """All nodes whose participant is alive, this process's included."""
        with self._lock:
            self._take_news()
            # Asked for after the news: whose announcement came is known by then.
            alive = {endpoint.participant for endpoint in self.endpoints()}
            self._read_news()
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


def _string(text: str) -> bytes:
    data = text.encode() + b"\0"
    return struct.pack("<I", len(data)) + data + bytes(-len(data) % 4)
