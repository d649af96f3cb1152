# SPDX-License-Identifier: Apache-2.0
"""Writers and readers of one process as they see each other: who matches, what waits to be taken,
what was missed.

One re-entrant lock guards all: it is held for moments only, nothing else is locked within it, and
signal handlers and the garbage collector may come on top of its holder. Missed deadlines and lost
liveliness are counted when somebody asks.
"""

from __future__ import annotations

import itertools
import threading
import time
from collections import deque
from typing import NamedTuple

from .base import INFINITE, Endpoint, StatusChange

#: DDS policy ids
_DURABILITY, _DEADLINE, _LIVELINESS, _RELIABILITY, _TYPE = 2, 4, 8, 11, 24

lock = threading.RLock()
#: by domain and topic
domains: dict[int, dict[str, list[Port]]] = {}
_handles = itertools.count(1)


class Stored(NamedTuple):
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


class Port:
    """A writer or reader as its peers see it, whether or not anybody still holds its handle."""

    def __init__(self, domain_id: int, type_hash: str, endpoint: Endpoint) -> None:
        qos = endpoint.qos
        self.topics = domains.setdefault(domain_id, {})
        self.type = endpoint.type_name, type_hash
        self.endpoint = endpoint
        self.handle = next(_handles)
        self.left = False
        self.peers: tuple[Port, ...] = ()
        #: of a reader: not taken yet; of a writer: its history
        self.samples: deque[Stored] = deque(maxlen=None if qos.keep_all else max(qos.depth, 1))
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
        others = self._present()
        self.topics[self.endpoint.topic] = [*others, self]
        for other in others:
            if not other.left and other.endpoint.is_reader != self.endpoint.is_reader:
                _meet(*((other, self) if self.endpoint.is_reader else (self, other)))

    def leave(self) -> None:
        """Part from all others; calling it again is harmless."""
        if self.left:
            return
        self.left = True
        if present := self._present():
            self.topics[self.endpoint.topic] = present
        else:
            self.topics.pop(self.endpoint.topic, None)
        for peer in self.peers:
            peer.peers = tuple(other for other in peer.peers if other is not self)
            if not peer.peers and peer.endpoint.is_reader:
                peer.deadline.stop()
        self.peers = self.gates = ()
        self.deadline.stop()
        self.samples.clear()

    def _present(self) -> list[Port]:
        """Those in the topic. The lists are replaced, not changed: a collected handle may have its
        port leave at any moment.
        """
        return [port for port in self.topics.get(self.endpoint.topic, ()) if not port.left]

    def receive(self, sample: Stored) -> None:
        self.samples.append(sample)
        self.deadline.meet()
        for gate in self.gates:
            open_gate(gate)

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


def _incompatible(writer: Port, reader: Port) -> int:
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


def _meet(writer: Port, reader: Port) -> None:
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


def open_gate(gate: threading.Lock) -> None:
    """Let who waits at a gate through, or who comes next."""
    # No lock of ours and no test before: signal handlers come here at any moment.
    try:  # noqa: SIM105 - in the path of every message
        gate.release()
    except RuntimeError:
        pass  # open already
