# SPDX-License-Identifier: Apache-2.0
"""Service events: copies of requests and responses for whoever wants to watch a service."""

from __future__ import annotations

import struct
from enum import IntEnum
from typing import TYPE_CHECKING, Any

from service_msgs.msg import ServiceEventInfo

from embedded_ros.interfaces.registry import registry

if TYPE_CHECKING:
    from .clock import Clock
    from .impl.service_ends import rmw_request_id_t
    from .node import Node
    from .qos import QoSProfile


class ServiceIntrospectionState(IntEnum):
    """How much is published."""

    OFF = 0
    METADATA = 1
    CONTENTS = 2


class Introspection:
    """Publishes the events of one client or server."""

    def __init__(
        self,
        node: Node,
        event_type: Any,
        service: str,
        clock: Clock,
        qos_profile: QoSProfile,
        contents: bool,
    ) -> None:
        self._node = node
        self._clock = clock
        self._contents = contents
        self._type = event_type
        self._serialize = registry.serializer(event_type)
        # Not among the node's publishers, as in ROS.
        self._writer = node._ros_open(
            event_type, service + "/_service_event", qos_profile, writer=True
        )

    def publish(self, event_type: int, request_id: rmw_request_id_t, message: Any) -> None:
        """Tell of a request or response."""
        info = ServiceEventInfo(
            event_type=event_type,
            stamp=self._clock.now().to_msg(),
            client_gid=list(struct.pack("<Q8x", request_id.writer_guid)),
            sequence_number=request_id.sequence_number,
        )
        event = self._type(info=info)
        if self._contents:
            is_request = event_type in (
                ServiceEventInfo.REQUEST_SENT,
                ServiceEventInfo.REQUEST_RECEIVED,
            )
            setattr(event, "request" if is_request else "response", [message])
        self._writer.write(self._serialize(event))

    def close(self) -> None:
        """Publish no more."""
        self._node._ros_announce(writer=self._writer, remove=True)
        self._writer.close()
