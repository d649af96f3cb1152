# SPDX-License-Identifier: Apache-2.0
"""Service servers."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from service_msgs.msg import ServiceEventInfo

from embedded_ros.transport.graph import user_data_value

from .impl.queued import Work, await_or_execute
from .impl.service_ends import ServiceEnd, rmw_request_id_t, rmw_service_info_t
from .qos import QoSProfile

if TYPE_CHECKING:
    from .node import Node

#: how long a caller waits for the client to listen, s; as rmw_cyclonedds_cpp does
_CLIENT_LIMIT = 0.1
#: how long the response is kept for it after that, s: on a busy machine discovery takes its time
_LATE_LIMIT = 10.0


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
        #: responses to clients that do not listen yet, and until when that is borne
        self._late: deque[tuple[float, rmw_service_info_t, Any]] = deque()

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
        client = self.handle._endpoint.peers().get(sample.writer)
        # One that has gone, and is no peer any more, wanted something all the same.
        if client is not None and not user_data_value(client, "clientid"):
            # It puts its identity where it cannot be read from here.
            self._warn("a client of another middleware called '{}': that cannot be answered")
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
            if not self._client_listens(header.writer, _CLIENT_LIMIT):
                self._late.append((time.monotonic() + _LATE_LIMIT, header, response))
                return
        elif isinstance(header, rmw_request_id_t):
            request_id = header
        else:
            raise TypeError(f"Expected the header of a request, got {type(header)}")
        self._answer(request_id, response)

    service_send_response = send_response

    def _answer(self, request_id: rmw_request_id_t, response: Any) -> None:
        self.handle._send(request_id, response)
        self._tell(ServiceEventInfo.RESPONSE_SENT, request_id, response)

    def look_after(self) -> None:
        """Answer the clients that listen by now."""
        for _ in range(len(self._late)):
            try:
                end, header, response = self._late.popleft()
            except IndexError:  # the service was destroyed
                return
            client = self._endpoint.peers().get(header.writer)
            if self._client_listens(header.writer):
                self._answer(header.request_id, response)
            elif client is None:
                self._warn("a client of '{}' went away before it was answered")
            elif time.monotonic() > end:
                self._warn("a client called '{}' but does not listen; its response is dropped")
            else:
                self._late.append((end, header, response))

    def _client_listens(self, writer: int, limit: float = 0.0) -> bool:
        """Whether the client's reader is there, which may be found after its writer; wait a little
        for it.
        """
        end = time.monotonic() + limit
        while (client := self._endpoint.peers().get(writer)) is not None:
            if user_data_value(client, "clientid") in self._peer_ids(
                self._writer.peers(), "clientid"
            ):
                return True
            if time.monotonic() >= end:
                break
            time.sleep(0.002)
        return False

    def destroy(self) -> None:
        """Leave the service; use the node's method for it."""
        super().destroy()
        self._late.clear()
