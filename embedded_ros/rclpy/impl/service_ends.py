# SPDX-License-Identifier: Apache-2.0
"""The two ends of a service: what clients and servers have in common.

A request or reply is a CDR payload with 16 bytes between its header and its body: the instance
handle of the client's writer and a sequence number, which the reply echoes. Both endpoints of a
client (server) announce the same ``clientid`` (``serviceid``) as user data, so that the other side
knows which belong together. This is what rmw_cyclonedds_cpp does.
"""

from __future__ import annotations

import secrets
import struct
from abc import ABC, abstractmethod
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from embedded_ros.interfaces.registry import registry
from embedded_ros.transport import Sample
from embedded_ros.transport.graph import dds_type_name, user_data_value

from ..qos import HistoryPolicy, QoSProfile
from ..service_introspection import Introspection, ServiceIntrospectionState
from .queued import QueuedEntity

if TYPE_CHECKING:
    from ..clock import Clock
    from ..node import Node


#: how many messages a reader and its queue hold at least, whatever the profile says: who called at
#: the same moment as others would wait for ever for an answer to what these pushed out
LEAST_QUEUE = 1000
#: how many a writer holds at least until they are acknowledged. What is written while the two sides
#: are still finding each other may have to be sent again.
LEAST_HISTORY = 100


class rmw_request_id_t(NamedTuple):
    """Who asked, and which of their requests it was."""

    writer_guid: int
    sequence_number: int


class rmw_service_info_t(NamedTuple):
    """Identity and times (ns) of a request or reply that was taken."""

    request_id: rmw_request_id_t
    source_timestamp: int
    received_timestamp: int
    #: the sample's writer, as this process knows it
    writer: int


def pack(payload: bytes, request_id: rmw_request_id_t) -> bytes:
    """Put an identity into an encoded message."""
    return payload[:4] + struct.pack("<Qq", *request_id) + payload[4:]


def unpack(payload: bytes) -> tuple[rmw_request_id_t, bytes]:
    """The identity in a payload, and the message without it.

    :raises ValueError: the payload is too short to hold one.
    """
    if len(payload) < 20:
        raise ValueError(f"{len(payload)} bytes, where an identity alone takes 20")
    order = "<" if payload[1] & 1 else ">"
    guid, number = struct.unpack_from(order + "Qq", payload, 4)
    return rmw_request_id_t(guid, number), payload[:4] + payload[20:]


class ServiceEnd(QueuedEntity, ABC):
    """A writer and a reader that belong together. `role` is ``client`` or ``service``."""

    def __init__(
        self, node: Node, srv_type: Any, srv_name: str, qos_profile: QoSProfile, role: str
    ) -> None:
        self._full_name = node._ros_full_name(srv_name, service=True)
        self._node = node
        self.srv_type = srv_type
        self.srv_name = srv_name
        self.qos_profile = qos_profile
        raw = qos_profile.avoid_ros_namespace_conventions
        request = ("" if raw else "rq") + self._full_name + "Request"
        reply = ("" if raw else "rr") + self._full_name + "Reply"
        ends = [(request.lstrip("/"), srv_type.Request), (reply.lstrip("/"), srv_type.Response)]
        (out_topic, out_type), (in_topic, in_type) = ends if role == "client" else ends[::-1]
        self._serialize = registry.serializer(out_type)
        self._deserialize = registry.deserializer(in_type)
        self._id = f"{role}id=" + ".".join(f"{byte:x}" for byte in secrets.token_bytes(16)) + ";"
        participant = node.context.participant
        arguments = self._arguments(out_topic, out_type, LEAST_HISTORY)
        self._writer = participant.create_writer(*arguments)
        arguments = self._arguments(in_topic, in_type, LEAST_QUEUE)
        reader = participant.create_reader(*arguments)
        keep_all = qos_profile.history == HistoryPolicy.KEEP_ALL
        super().__init__(reader, None if keep_all else max(qos_profile.depth, LEAST_QUEUE))
        self._introspection: Introspection | None = None
        node._ros_announce(writer=self._writer, reader=reader)

    def _arguments(self, topic: str, msg_type: Any, depth: int) -> tuple[Any, ...]:
        name = msg_type._spec_.name
        qos = self.qos_profile.decide()
        qos = replace(qos, depth=max(qos.depth, depth))
        return topic, dds_type_name(name), registry.type_hash(name), qos, self._id

    @property
    def service_name(self) -> str:
        """The full service name."""
        return self.handle._full_name

    def _peer_ids(self, peers: dict[int, bytes], key: str) -> set[str]:
        return {value for data in peers.values() if (value := user_data_value(data, key))}

    @abstractmethod
    def look_after(self) -> None:
        """See to what waits for others; executors call this every now and then."""

    def drain(self) -> None:
        """Fetch what has arrived."""
        samples = [sample for sample in self._endpoint.take(256) if self._is_mine(sample)]
        limit = self._queue.maxlen
        over = len(self._queue) + len(samples) - limit if limit is not None else 0
        self._queue.extend(samples)
        if over > 0:
            self._warn(f"'{{}}' keeps {limit} messages for a busy node: lost the oldest {over}")

    def _is_mine(self, sample: Sample) -> bool:
        return True

    def _warn(self, text: str) -> None:
        self._node.get_logger().warning(text.format(self._full_name))

    def _send(self, request_id: rmw_request_id_t, message: Any) -> None:
        self._writer.write(pack(self._serialize(message), request_id))

    def _read(self, sample: Sample) -> tuple[rmw_service_info_t, Any] | None:
        """Decode a sample; None when it is no message of this service."""
        try:
            request_id, payload = unpack(sample.payload)
            message = self._deserialize(payload)
        except Exception as error:
            # Whatever comes over the wire must not end the program.
            self._node.get_logger().error(
                f"dropped a message of service '{self._full_name}' that cannot be read: {error}"
            )
            return None
        times = sample.source_timestamp, sample.received_timestamp
        return rmw_service_info_t(request_id, *times, sample.writer), message

    def configure_introspection(
        self,
        clock: Clock,
        service_event_qos_profile: QoSProfile,
        introspection_state: ServiceIntrospectionState,
    ) -> None:
        """Publish what passes here on ``<service>/_service_event``: its metadata, its contents, or
        nothing any more.
        """
        if self._introspection is not None:
            self._introspection.close()
            self._introspection = None
        if introspection_state != ServiceIntrospectionState.OFF:
            contents = introspection_state == ServiceIntrospectionState.CONTENTS
            self._introspection = Introspection(
                self._node,
                self.srv_type.Event,
                self.handle._full_name,
                clock,
                service_event_qos_profile,
                contents,
            )

    def _tell(self, event_type: int, request_id: rmw_request_id_t, message: Any) -> None:
        if self._introspection is not None:
            self._introspection.publish(event_type, request_id, message)

    def destroy(self) -> None:
        """Leave the service; use the node's method for it."""
        if self._ros_destroyed:
            return
        if self._introspection is not None:
            self._introspection.close()
            self._introspection = None
        self._node._ros_announce(writer=self._writer, reader=self._endpoint, remove=True)
        self._writer.close()
        super().destroy()
