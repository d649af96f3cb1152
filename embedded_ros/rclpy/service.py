# SPDX-License-Identifier: Apache-2.0
"""Service servers."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from service_msgs.msg import ServiceEventInfo

from embedded_ros.transport.graph import user_data_value

from .impl.queued import Work, await_or_execute
from .impl.service_ends import ServiceEnd, rmw_request_id_t, rmw_service_info_t
from .qos import QoSProfile

if TYPE_CHECKING:
    from .node import Node

#: how long a reply waits for the client to listen, s; as rmw_cyclonedds_cpp does
_CLIENT_LIMIT = 0.1


class Service(ServiceEnd):
    """Answers requests. Made by :meth:`rclpy.node.Node.create_service`."""

    def __init__(
        self,
        node: Node,
        srv_type: Any,
        srv_name: str,
        callback: Callable[[Any, Any], Any],
        callback_group: Any,
        qos_profile: QoSProfile,
    ) -> None:
        super().__init__(node, srv_type, srv_name, qos_profile, "service")
        self.callback = callback
        self.callback_group = callback_group

    @property
    def name(self) -> str:
        """The full service name."""
        return self.service_name

    def service_take_request(self, request_type: Any = None) -> tuple[Any, Any]:
        """Take the oldest request and its header, or (None, None) when there is none."""
        self.drain()
        try:
            sample = self._queue.popleft()
        except IndexError:
            return None, None
        peers = self.handle._endpoint.peers()
        if not user_data_value(peers.get(sample.writer, b""), "clientid"):
            # A client of another middleware puts its identity where it cannot be read from here,
            # or the client has gone: there is nobody to answer.
            return None, None
        taken = self._read(sample)
        if taken is None:
            return None, None
        header, request = taken
        self._tell(ServiceEventInfo.REQUEST_RECEIVED, header.request_id, request)
        return request, header

    def take_work(self) -> Work | None:
        request, header = self.service_take_request()
        if header is None:
            return None

        async def run() -> None:
            response = await await_or_execute(self.callback, request, self.srv_type.Response())
            self.send_response(response, header)

        return run

    def send_response(self, response: Any, header: Any) -> None:
        """Answer the request that `header` came with.

        :raises TypeError: the response or the header is of another type.
        """
        if not isinstance(response, self.srv_type.Response):
            raise TypeError(f"Expected {self.srv_type.Response}, got {type(response)}")
        if isinstance(header, rmw_service_info_t):
            request_id = header.request_id
            if not self._client_listens(header.writer):
                return
        elif isinstance(header, rmw_request_id_t):
            request_id = header
        else:
            raise TypeError(f"Expected the header of a request, got {type(header)}")
        self.handle._send(request_id, response)
        self._tell(ServiceEventInfo.RESPONSE_SENT, request_id, response)

    service_send_response = send_response

    def _client_listens(self, writer: int) -> bool:
        """Wait a little for the client's reader: it may be found after its writer."""
        end = time.monotonic() + _CLIENT_LIMIT
        while True:
            client = self.handle._endpoint.peers().get(writer)
            if client is None:
                return False
            if user_data_value(client, "clientid") in self._peer_ids(
                self._writer.peers(), "clientid"
            ):
                return True
            if time.monotonic() >= end:
                self._node.get_logger().warning(
                    f"a client of service '{self._full_name}' asked but does not listen; "
                    "its response is dropped"
                )
                return False
            time.sleep(0.002)
