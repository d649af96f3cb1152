# SPDX-License-Identifier: Apache-2.0
"""Service clients."""

from __future__ import annotations

import itertools
import threading
import time
from typing import TYPE_CHECKING, Any

from service_msgs.msg import ServiceEventInfo

from embedded_ros.transport import Sample

from .impl.queued import Work
from .impl.service_ends import ServiceEnd, rmw_request_id_t, unpack
from .qos import QoSProfile
from .task import Future

if TYPE_CHECKING:
    from .node import Node


def _requests(count: int) -> str:
    return "a request" if count == 1 else f"{count} requests"


class Client(ServiceEnd):
    """Calls a service. Made by :meth:`rclpy.node.Node.create_client`."""

    def __init__(
        self,
        node: Node,
        srv_type: Any,
        srv_name: str,
        qos_profile: QoSProfile,
        callback_group: Any,
    ) -> None:
        super().__init__(node, srv_type, srv_name, qos_profile, "client")
        self.context = node.context
        self.callback_group = callback_group
        self._pending_requests: dict[int, Future] = {}
        #: the servers that a pending request went to, while one of them is there
        self._asked: dict[int, frozenset[int]] = {}
        self._lost: set[int] = set()
        self._numbers = itertools.count(1)
        self._lock = threading.Lock()

    def call(self, request: Any, timeout_sec: float | None = None) -> Any:
        """Call the service and wait for the response, or for None after the timeout (or shutdown).

        Some other thread must spin the node.

        :raises TypeError: the request is of another type.
        """
        done = threading.Event()
        future = self.call_async(request)
        future.add_done_callback(lambda _: done.set())
        end = None if timeout_sec is None else time.monotonic() + timeout_sec
        # In slices, so that a shutdown ends the wait.
        while not done.is_set() and self.context.ok():
            left = 0.1 if end is None else min(end - time.monotonic(), 0.1)
            if left <= 0:
                break
            done.wait(left)
        if not future.done():
            self.remove_pending_request(future)
        return future.result()

    def call_async(self, request: Any) -> Future:
        """Call the service; the future gets the response.

        :raises TypeError: the request is of another type.
        """
        if not isinstance(request, self.srv_type.Request):
            raise TypeError(f"Expected {self.srv_type.Request}, got {type(request)}")
        return self._send_request(request, Future())

    def _send_request(self, request: Any, future: Future) -> Future:
        number = next(self._numbers)
        asked = frozenset(self.handle._writer.peers())
        with self._lock:
            self._pending_requests[number] = future
            self._asked[number] = asked
        future.add_done_callback(self.remove_pending_request)
        request_id = rmw_request_id_t(self._writer.handle, number)
        try:
            self.handle._send(request_id, request)
        except Exception:
            self.remove_pending_request(future)
            raise
        self._tell(ServiceEventInfo.REQUEST_SENT, request_id, request)
        return future

    def send_request(self, request: Any) -> int:
        """Call the service without a future: :meth:`take_response` gets what comes. The number of
        the request.
        """
        request_id = rmw_request_id_t(self._writer.handle, next(self._numbers))
        self.handle._send(request_id, request)
        return request_id.sequence_number

    def take_response(self, response_type: Any = None) -> tuple[Any, Any] | None:
        """Take the oldest response, with its header before it, or None when there is none."""
        self.drain()
        return self._read(self._queue.popleft()) if self._queue else None

    def get_pending_request(self, sequence_number: int) -> Future:
        """The future of a request that was not answered yet.

        :raises KeyError: there is none of that number.
        """
        with self._lock:
            return self._pending_requests[sequence_number]

    def remove_pending_request(self, future: Future) -> None:
        """Give a request up: its response will be dropped."""
        with self._lock:
            for number, known in self._pending_requests.items():
                if known is future:
                    del self._pending_requests[number]
                    self._asked.pop(number, None)
                    break

    def look_after(self) -> None:
        """Tell of requests that nobody is left to answer.

        A server that was killed seems to be there until its lease is over; whatever it is sent is
        lost, and no server that comes later will ever see it.
        """
        if not self._asked or self._ros_destroyed:
            return
        present = self._writer.peers().keys()
        with self._lock:
            lost = {number for number, asked in self._asked.items() if not asked & present}
            # One turn later, as an answer may be on its way still.
            told = lost & self._lost
            unheard = sum(not self._asked.pop(number) for number in told)
            self._lost = lost - told
        if unheard:
            self._warn(f"nobody served '{{}}' when it was called: {_requests(unheard)} lost")
        if gone := len(told) - unheard:
            self._warn(f"the server of '{{}}' went away with {_requests(gone)} unanswered")

    def service_is_ready(self) -> bool:
        """Whether a server listens to this client, and this client to it."""
        readers, writers = self.handle._writer.peers(), self._endpoint.peers()
        servers = self._peer_ids(readers, "serviceid")
        if not servers:
            # Servers of other middlewares announce no identity.
            return bool(readers and writers)
        return bool(servers & self._peer_ids(writers, "serviceid"))

    service_server_is_available = service_is_ready

    def wait_for_service(self, timeout_sec: float | None = None) -> bool:
        """Wait for a server; False when there is none in time."""
        end = None if timeout_sec is None else time.monotonic() + timeout_sec
        while not (ready := self.service_is_ready()) and self.context.ok():
            left = 0.01 if end is None else min(end - time.monotonic(), 0.01)
            if left <= 0:
                break
            time.sleep(left)
        return ready

    def _is_mine(self, sample: Sample) -> bool:
        try:  # the responses to other clients come too
            return unpack(sample.payload)[0].writer_guid == self._writer.handle
        except ValueError:
            return True  # whose it is cannot be told: reading it will say what is wrong

    def take_work(self) -> Work | None:
        taken = self._read(self._queue.popleft()) if self._queue else None
        if taken is None:
            return None
        header, response = taken
        self._tell(ServiceEventInfo.RESPONSE_RECEIVED, header.request_id, response)
        number = header.request_id.sequence_number
        with self._lock:
            self._asked.pop(number, None)
        try:
            future = self.get_pending_request(number)
        except KeyError:
            return None

        async def run() -> None:
            future._set_executor(self._node.executor)
            future.set_result(response)

        return run
