# SPDX-License-Identifier: Apache-2.0
"""The transport within one process, for machines that there is no Cyclone DDS for.

A write appends to the queues of the readers that match, and never waits for one. One re-entrant
lock guards all: it is held for moments only, nothing else is locked within it, and signal handlers
and the garbage collector may come on top of its holder. Missed deadlines and lost liveliness are
counted when somebody asks.
"""

from __future__ import annotations

import itertools
import os
import threading
import time
import weakref
from collections import deque
from typing import NamedTuple

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

_SLICE = 0.1  # s

#: DDS policy ids
_DURABILITY, _DEADLINE, _LIVELINESS, _RELIABILITY, _TYPE = 2, 4, 8, 11, 24

_lock = threading.RLock()
_domains: dict[int, dict[str, list[_Port]]] = {}
_participants = itertools.count(1)
_handles = itertools.count(1)


class _Stored(NamedTuple):
    """What was written when and by whom, and until when it counts (ns since 1970)."""

    payload: bytes
    written: int
    writer: int
    expires: int


class _Events:
    """How often something happened, and how much of that was told."""

    def __init__(self) -> None:
        self.total = self._told = 0

    def tell(self, detail: int = 0) -> StatusChange:
        change, self._told = self.total - self._told, self.total
        return StatusChange(self.total, change, detail)


class _Deadline(_Events):
    """Counts the periods that passed without a message since the first one."""

    def __init__(self, period: int) -> None:
        super().__init__()
        self._period = period
        self._since: int | None = None

    def count(self) -> None:
        if self._since is not None:
            missed = (time.monotonic_ns() - self._since) // self._period
            self.total += missed
            self._since += missed * self._period

    def meet(self) -> None:
        if self._period < INFINITE:
            self.count()
            self._since = time.monotonic_ns()

    def stop(self) -> None:
        self.count()
        self._since = None


class _Port:
    """A writer or reader as its peers see it, whether or not anybody still holds its handle."""

    def __init__(self, domain_id: int, type_hash: str, endpoint: Endpoint) -> None:
        qos = endpoint.qos
        self.topics = _domains.setdefault(domain_id, {})
        self.type = endpoint.type_name, type_hash
        self.endpoint = endpoint
        self.handle = next(_handles)
        self.left = False
        self.peers: tuple[_Port, ...] = ()
        #: of a reader: not taken yet; of a writer: its history
        self.samples: deque[_Stored] = deque(maxlen=None if qos.keep_all else max(qos.depth, 1))
        self.gates: tuple[threading.Lock, ...] = ()  # of those who wait for this reader
        self.matched, self.incompatible, self.lost = _Events(), _Events(), _Events()
        self.policy = 0  # the last incompatible one
        self.deadline = _Deadline(qos.deadline)
        self._lease = qos.liveliness_lease if qos.manual_liveliness else INFINITE
        self._asserted = time.monotonic_ns()
        self._alive = True
        self._told = (0, 0)  # writers alive and not alive

    def enter(self) -> None:
        """Meet all others of the topic."""
        others = self.topics.setdefault(self.endpoint.topic, [])
        for other in tuple(others):
            if not other.left and other.endpoint.is_reader != self.endpoint.is_reader:
                _meet(*((other, self) if self.endpoint.is_reader else (self, other)))
        others.append(self)

    def leave(self) -> None:
        """Part from all others; calling it again is harmless."""
        if self.left:
            return
        self.left = True
        others = self.topics[self.endpoint.topic]
        others.remove(self)
        if not others:
            del self.topics[self.endpoint.topic]
        for peer in self.peers:
            peer.peers = tuple(other for other in peer.peers if other is not self)
            if not peer.peers and peer.endpoint.is_reader:
                peer.deadline.stop()
        self.peers = self.gates = ()
        self.deadline.stop()
        self.samples.clear()

    def receive(self, sample: _Stored) -> None:
        self.samples.append(sample)
        self.deadline.meet()
        for gate in self.gates:
            _open(gate)

    def alive(self) -> bool:
        """Whether this writer has shown itself within its lease."""
        alive = self._lease == INFINITE or time.monotonic_ns() - self._asserted <= self._lease
        self.lost.total += self._alive and not alive
        self._alive = alive
        return alive

    def assert_liveliness(self) -> None:
        if self._lease < INFINITE:
            self.alive()
            self._asserted, self._alive = time.monotonic_ns(), True

    def liveliness_changed(self) -> StatusChange:
        alive = sum(writer.alive() for writer in self.peers)
        before, self._told = self._told, (alive, len(self.peers) - alive)
        change = sum(abs(new - old) for new, old in zip(self._told, before, strict=True))
        return StatusChange(alive, change, self._told[1])


def _incompatible(writer: _Port, reader: _Port) -> int:
    """The policy that keeps the two apart, or 0."""
    offered, wanted = writer.endpoint.qos, reader.endpoint.qos
    if writer.type != reader.type:
        return _TYPE
    if wanted.reliable and not offered.reliable:
        return _RELIABILITY
    if wanted.transient_local and not offered.transient_local:
        return _DURABILITY
    if offered.deadline > wanted.deadline:
        return _DEADLINE
    if (wanted.manual_liveliness and not offered.manual_liveliness) or (
        offered.liveliness_lease > wanted.liveliness_lease
    ):
        return _LIVELINESS
    return 0


def _meet(writer: _Port, reader: _Port) -> None:
    policy = _incompatible(writer, reader)
    for one, other in ((writer, reader), (reader, writer)):
        if policy:
            one.incompatible.total += 1
            one.policy = policy
        else:
            one.matched.total += 1
            one.peers += (other,)
    if not policy and reader.endpoint.qos.transient_local:
        for sample in tuple(writer.samples):
            reader.receive(sample)


def _open(gate: threading.Lock) -> None:
    # No lock of ours and no test before: signal handlers come here at any moment.
    try:  # noqa: SIM105 - in the path of every message
        gate.release()
    except RuntimeError:
        pass  # open already


class _End:
    """What is handed out for a port; the port goes with it."""

    def __init__(self, port: _Port) -> None:
        self._port = port
        self.guid = port.endpoint.guid
        self.handle = port.handle

    def matched(self) -> int:
        return len(self._port.peers)

    def peers(self) -> dict[int, bytes]:
        return {peer.handle: peer.endpoint.user_data for peer in self._port.peers}

    def status(self, kind: str) -> StatusChange:
        port = self._port
        with _lock:
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
        with uninterrupted(), _lock:
            self._port.leave()

    def __del__(self) -> None:
        self.close()


class LocalWriter(_End, Writer):
    """Appends to readers' queues, and to a history for readers that come late."""

    def write(self, payload: bytes) -> None:
        port, now = self._port, time.time_ns()
        qos = port.endpoint.qos
        expires = now + qos.lifespan if qos.lifespan < INFINITE else INFINITE
        sample = _Stored(payload, now, port.handle, expires)
        with _lock:
            port.assert_liveliness()
            port.deadline.meet()
            if qos.transient_local:
                port.samples.append(sample)
            for reader in port.peers:
                reader.receive(sample)

    def wait_for_acked(self, timeout: int) -> bool:
        return True

    def assert_liveliness(self) -> None:
        with _lock:
            self._port.assert_liveliness()


class LocalReader(_End, Reader):
    """Hands out what writers have put into its queue."""

    def take(self, limit: int) -> list[Sample]:
        samples = self._port.samples
        if not samples:
            return []
        now = time.time_ns()
        with _lock:
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
        self._ports: dict[Reader, _Port] = {}

    def set_readers(self, readers: set[Reader]) -> None:
        if readers == self._ports.keys():
            return
        ports: dict[Reader, _Port] = {
            reader: reader._port for reader in readers if isinstance(reader, LocalReader)
        }
        with uninterrupted(), _lock:
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
        _open(self._gate)

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

    def _port(
        self, topic: str, type_name: str, type_hash: str, is_reader: bool, qos: Qos, extra: str
    ) -> _Port:
        entity = next(self._numbers).to_bytes(3, "big") + (b"\x04" if is_reader else b"\x03")
        return _Port(
            self.domain_id,
            type_hash,
            Endpoint(
                guid=self._prefix + entity,
                participant=self.guid,
                topic=topic,
                type_name=type_name,
                is_reader=is_reader,
                qos=qos,
                user_data=user_data(type_hash, extra),
            ),
        )

    def _add(self, end: _End) -> None:
        self._ends.add(end)
        end._port.enter()

    def create_writer(
        self, topic: str, type_name: str, type_hash: str, qos: Qos, extra_user_data: str = ""
    ) -> Writer:
        with uninterrupted(), _lock:
            writer = LocalWriter(
                self._port(topic, type_name, type_hash, False, qos, extra_user_data)
            )
            self._add(writer)
            return writer

    def create_reader(
        self, topic: str, type_name: str, type_hash: str, qos: Qos, extra_user_data: str = ""
    ) -> Reader:
        with uninterrupted(), _lock:
            reader = LocalReader(
                self._port(topic, type_name, type_hash, True, qos, extra_user_data)
            )
            self._add(reader)
            return reader

    def create_waiter(self) -> Waiter:
        return LocalWaiter()

    def endpoints(self) -> list[Endpoint]:
        with _lock:
            topics = {} if self._closed else _domains.get(self.domain_id, {})
            return [port.endpoint for ports in list(topics.values()) for port in tuple(ports)]

    def close(self) -> None:
        with uninterrupted(), _lock:
            self._closed = True
            for end in list(self._ends):
                end.close()
