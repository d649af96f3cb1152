# SPDX-License-Identifier: Apache-2.0
"""The transport within one process, for machines that there is no Cyclone DDS for.

A write appends to the queues of the readers that match, and never waits for one.
"""

from __future__ import annotations

import itertools
import os
import threading
import time
import weakref
from typing import Any

from embedded_ros.interrupts import uninterrupted

from .base import (
    INFINITE,
    Endpoint,
    Participant,
    Qos,
    Reader,
    Sample,
    StatusChange,
    Waiter,
    Writer,
    user_data,
)
from .local_ports import Port, Stored, domains, lock, open_gate

_SLICE = 0.1  # s

_participants = itertools.count(1)


class _End:
    """What is handed out for a port; the port goes with it."""

    def __init__(self, port: Port) -> None:
        self._port = port
        self.guid = port.endpoint.guid
        self.handle = port.handle

    def matched(self) -> int:
        return len(self._port.peers)

    def peers(self) -> dict[int, bytes]:
        return {peer.handle: peer.endpoint.user_data for peer in self._port.peers}

    def status(self, kind: str) -> StatusChange:
        port = self._port
        with lock:
            if kind == "matched":
                return port.matched.tell(len(port.peers))
            if kind == "incompatible_qos":
                return port.incompatible.tell(port.policy)
            if kind == "deadline":
                port.deadline.count()
                return port.deadline.tell()
            if kind == "liveliness" and port.endpoint.is_reader:
                return port.liveliness_changed()
            # Of a writer: liveliness. Of a reader: messages lost, which does not happen here.
            port.alive()
            return port.lost.tell()

    def close(self) -> None:
        with uninterrupted(), lock:
            self._port.leave()

    def __del__(self) -> None:
        self.close()


class LocalWriter(_End, Writer):
    """Appends to readers' queues, and to a history for readers that come late."""

    def write(self, payload: bytes) -> None:
        port, now = self._port, time.time_ns()
        qos = port.endpoint.qos
        expires = now + qos.lifespan if qos.lifespan < INFINITE else INFINITE
        sample = Stored(payload, now, port.handle, expires)
        with lock:
            port.assert_liveliness()
            port.deadline.meet()
            if qos.transient_local:
                port.samples.append(sample)
            for reader in port.peers:
                reader.receive(sample)

    def wait_for_acked(self, timeout: int) -> bool:
        return True

    def assert_liveliness(self) -> None:
        with lock:
            self._port.assert_liveliness()


class LocalReader(_End, Reader):
    """Hands out what writers have put into its queue."""

    def take(self, limit: int) -> list[Sample]:
        samples = self._port.samples
        if not samples:
            return []
        now = time.time_ns()
        with lock:
            taken = [samples.popleft() for _ in range(min(limit, len(samples)))]
        return [Sample(s.payload, s.written, now, s.writer) for s in taken if now < s.expires]


class LocalWaiter(Waiter):
    """Waits at a gate, which is a lock that is taken on the way through.

    Waiting for a lock ends by itself for signals; and letting go of one takes no other lock, so
    that signal handlers may.
    """

    def __init__(self) -> None:
        self._gate = threading.Lock()
        self._gate.acquire()
        self._ports: dict[Reader, Port] = {}

    def set_readers(self, readers: set[Reader]) -> None:
        if readers == self._ports.keys():
            return
        ports: dict[Reader, Port] = {
            reader: reader._port for reader in readers if isinstance(reader, LocalReader)
        }
        with uninterrupted(), lock:
            for reader in self._ports.keys() - readers:
                port = self._ports[reader]
                port.gates = tuple(gate for gate in port.gates if gate is not self._gate)
            for reader in ports.keys() - self._ports.keys():
                ports[reader].gates += (self._gate,)
            self._ports = ports

    def wait(self, timeout: int | None) -> list[Reader]:
        woken = self._gate.acquire(blocking=False)
        ready = self._ready()
        if not woken and not ready:
            slice_ = _SLICE if timeout is None else min(max(timeout * 1e-9, 0), _SLICE)
            self._gate.acquire(timeout=slice_)
            ready = self._ready()
        return ready

    def _ready(self) -> list[Reader]:
        return [reader for reader, port in self._ports.items() if port.samples]

    def wake(self) -> None:
        open_gate(self._gate)

    def close(self) -> None:
        self.set_readers(set())

    def __del__(self) -> None:
        self.close()


class LocalParticipant(Participant):
    """One of those in a domain of this process."""

    def __init__(self, domain_id: int) -> None:
        self.domain_id = domain_id
        # As RTPS has it: twelve bytes for the participant, four for what is in it.
        self._prefix = os.urandom(8) + next(_participants).to_bytes(4, "big")
        self.guid = self._prefix + b"\x00\x00\x01\xc1"
        self._ends: weakref.WeakSet[_End] = weakref.WeakSet()
        self._numbers = itertools.count(1)
        self._closed = False

    def _make(
        self, kind: Any, topic: str, type_name: str, type_hash: str, qos: Qos, extra: str
    ) -> Any:
        is_reader = kind is LocalReader
        entity = next(self._numbers).to_bytes(3, "big") + (b"\x04" if is_reader else b"\x03")
        endpoint = Endpoint(
            guid=self._prefix + entity,
            participant=self.guid,
            topic=topic,
            type_name=type_name,
            is_reader=is_reader,
            qos=qos,
            user_data=user_data(type_hash, extra),
        )
        with uninterrupted(), lock:
            end = kind(Port(self.domain_id, type_hash, endpoint))
            self._ends.add(end)
            end._port.enter()
            return end

    def create_writer(
        self, topic: str, type_name: str, type_hash: str, qos: Qos, extra_user_data: str = ""
    ) -> Writer:
        return self._make(LocalWriter, topic, type_name, type_hash, qos, extra_user_data)

    def create_reader(
        self, topic: str, type_name: str, type_hash: str, qos: Qos, extra_user_data: str = ""
    ) -> Reader:
        return self._make(LocalReader, topic, type_name, type_hash, qos, extra_user_data)

    def create_waiter(self) -> Waiter:
        return LocalWaiter()

    def endpoints(self) -> list[Endpoint]:
        with lock:
            topics = {} if self._closed else domains.get(self.domain_id, {})
            return [p.endpoint for ports in list(topics.values()) for p in ports if not p.left]

    def close(self) -> None:
        with uninterrupted(), lock:
            self._closed = True
            for end in list(self._ends):
                end.close()
