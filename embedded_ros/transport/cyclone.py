# SPDX-License-Identifier: Apache-2.0
"""The transport over Cyclone DDS, used as a carrier of already encoded messages.

Some habits of the Python binding shape this file. Its write holds the interpreter lock, with which
listeners deadlock and one stalled reader would stall every thread here: so there are no listeners,
and writes and waits call the library itself (by ctypes, which lets other threads run). Creating
entities and reading their QoS back is not thread-safe, so one lock guards both. And a blocking call
is deaf to signals, so waits are cut into slices of 100 ms.
"""

from __future__ import annotations

import contextlib
import ctypes
import threading
import time
from typing import Any

from cyclonedds._clayer import ddspy_take
from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import (
    DDSException,
    GuardCondition,
    InstanceState,
    ReadCondition,
    SampleState,
    ViewState,
    WaitSet,
)
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.pub import DataWriter, Publisher
from cyclonedds.qos import Policy
from cyclonedds.qos import Qos as CycloneQos
from cyclonedds.sub import DataReader, Subscriber
from cyclonedds.topic import Topic

from embedded_ros.interrupts import uninterrupted

from .base import (
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
from .cyclone_config import domain_xml, settings_in_use
from .cyclone_library import (
    Payload,
    dds_assert_liveliness,
    dds_wait_for_acks,
    dds_waitset_attach,
    dds_waitset_detach,
    dds_waitset_wait,
    dds_write,
)
from .cyclone_types import TypesOfDomain, from_cyclone, to_cyclone

SLICE = 100_000_000
#: the binding gives the same handle as a signed number here and as an unsigned one there
_UNSIGNED = 2**64 - 1
_MANY = 64
_ANY = SampleState.Any | ViewState.Any | InstanceState.Any

_lock = threading.RLock()
_domains: dict[int, tuple[str, Domain, TypesOfDomain]] = {}
_participants: dict[int, int] = {}


def _enter_domain(domain_id: int) -> TypesOfDomain:
    """Create the domain with our configuration, or join it.

    The Domain object outlives its participants: creating one anew costs a while and is only needed
    when the environment has changed.
    """
    config = domain_xml()
    known = _domains.get(domain_id)
    if known is not None and known[0] != config and not _participants.get(domain_id):
        del _domains[domain_id], known
        known = None
    if known is None:
        known = _domains[domain_id] = (config, Domain(domain_id, config), TypesOfDomain())
    return known[2]


# The binding's getter of each status, and the member of what it gives that is the detail.
_WRITER_STATUSES = {
    "matched": ("get_publication_matched_status", "current_count"),
    "incompatible_qos": ("get_offered_incompatible_qos_status", "last_policy_id"),
    "deadline": ("get_offered_deadline_missed_status", ""),
    "liveliness": ("get_liveliness_lost_status", ""),
}
_READER_STATUSES = {
    "matched": ("get_subscription_matched_status", "current_count"),
    "incompatible_qos": ("get_requested_incompatible_qos_status", "last_policy_id"),
    "deadline": ("get_requested_deadline_missed_status", ""),
    "liveliness": ("get_liveliness_changed_status", ""),
    "lost": ("get_sample_lost_status", ""),
}


def _status(end: Any, source: tuple[str, str]) -> StatusChange:
    """Read and reset a status of a writer or reader, which may be closed."""
    getter, detail = source
    if end is None:
        return StatusChange(0, 0)
    told = getattr(end, getter)()
    return StatusChange(
        told.total_count, told.total_count_change, getattr(told, detail) if detail else 0
    )


class _Peers:
    """User data of matched endpoints, read once each: reading it back is slow in the binding."""

    def __init__(self, handles: Any, data: Any) -> None:
        self._handles = handles
        self._data = data
        self._known: dict[int, bytes] = {}

    def read(self) -> dict[int, bytes]:
        handles = {handle & _UNSIGNED: handle for handle in self._handles()}
        for key in handles.keys() - self._known.keys():
            if (peer := self._data(handles[key])) is not None:
                self._known[key] = from_cyclone(peer.qos)[1]
        for key in self._known.keys() - handles.keys():
            del self._known[key]
        return dict(self._known)


class CycloneWriter(Writer):
    """A data writer. Statuses are read on demand."""

    def __init__(self, owner: CycloneParticipant, topic: Topic, qos: CycloneQos) -> None:
        self._owner = owner
        self._topic = topic
        self._writer: Any = DataWriter(owner.publisher, topic, qos=qos)
        self.guid = self._writer.guid.bytes
        self.handle = self._writer.get_instance_handle() & _UNSIGNED
        self._peers: Any = _Peers(
            self._writer.get_matched_subscriptions, self._writer.get_matched_subscription_data
        )

    def write(self, payload: bytes) -> None:
        writer = self._writer  # held until the end: others may close it meanwhile
        if writer is None:
            return
        if rest := len(payload) % 4:
            payload += bytes(4 - rest)
        result = dds_write(writer._ref, Payload(payload, len(payload)))
        if result == DDSException.DDS_RETCODE_TIMEOUT:
            raise TimeoutError("a reader takes nothing")
        if result < 0:
            raise DDSException(result, "while writing")

    def matched(self) -> int:
        with _lock:
            return len(self._writer.get_matched_subscriptions()) if self._writer else 0

    def peers(self) -> dict[int, bytes]:
        with uninterrupted(), _lock:
            return self._peers.read() if self._writer else {}

    def wait_for_acked(self, timeout: int) -> bool:
        until = time.monotonic_ns() + timeout
        while (writer := self._writer) is not None:
            left = min(max(until - time.monotonic_ns(), 0), SLICE)
            result = dds_wait_for_acks(writer._ref, left)
            if result not in (0, DDSException.DDS_RETCODE_TIMEOUT):
                raise DDSException(result, "while waiting for acknowledgements")
            if result == 0 or left < SLICE:
                return result == 0
        return False

    def assert_liveliness(self) -> None:
        writer = self._writer
        if writer is not None and (result := dds_assert_liveliness(writer._ref)) < 0:
            raise DDSException(result, "while asserting liveliness")

    def status(self, kind: str) -> StatusChange:
        return _status(self._writer, _WRITER_STATUSES[kind])

    def close(self) -> None:
        with uninterrupted(), _lock:
            self._writer = None
            self._peers = None


class CycloneReader(Reader):
    """A data reader with the condition that wakes waiters."""

    def __init__(self, owner: CycloneParticipant, topic: Topic, qos: CycloneQos) -> None:
        self._owner = owner
        self._topic = topic
        self._reader: Any = DataReader(owner.subscriber, topic, qos=qos)
        self.guid = self._reader.guid.bytes
        self.condition: Any = ReadCondition(self._reader, _ANY)
        self._peers: Any = _Peers(
            self._reader.get_matched_publications, self._reader.get_matched_publication_data
        )
        self._waiters: set[CycloneWaiter] = set()

    def take(self, limit: int) -> list[Sample]:
        reader = self._reader
        if reader is None:
            return []
        with uninterrupted():
            taken = ddspy_take(reader._ref, _ANY, limit)
        if isinstance(taken, int):
            raise DDSException(taken, "while taking samples")
        now = time.time_ns()
        return [
            Sample(payload, info.source_timestamp, now, info.publication_handle & _UNSIGNED)
            for payload, info in taken
            if info.valid_data
        ]

    def matched(self) -> int:
        with _lock:
            return len(self._reader.get_matched_publications()) if self._reader else 0

    def peers(self) -> dict[int, bytes]:
        with uninterrupted(), _lock:
            return self._peers.read() if self._reader else {}

    def status(self, kind: str) -> StatusChange:
        reader = self._reader
        if kind != "liveliness" or reader is None:
            return _status(reader, _READER_STATUSES[kind])
        told = reader.get_liveliness_changed_status()
        change = abs(told.alive_count_change) + abs(told.not_alive_count_change)
        return StatusChange(told.alive_count, change, told.not_alive_count)

    def close(self) -> None:
        with uninterrupted(), _lock:
            for waiter in list(self._waiters):
                waiter.detach(self)
            self.condition = None
            self._reader = None
            self._peers = None


class CycloneWaiter(Waiter):
    """A wait set with a guard condition."""

    def __init__(self, owner: CycloneParticipant) -> None:
        self._set: Any = WaitSet(owner.participant)
        self._guard: Any = GuardCondition(owner.participant)
        dds_waitset_attach(self._set._ref, self._guard._ref, 0)
        self._readers: dict[int, Reader] = {}  # by the handle of their condition

    def set_readers(self, readers: set[Reader]) -> None:
        present = set(self._readers.values())
        with _lock:
            for reader in present - readers:
                self.detach(reader)
            for reader in readers - present:
                if isinstance(reader, CycloneReader) and reader.condition is not None and self._set:
                    handle = reader.condition._ref
                    dds_waitset_attach(self._set._ref, handle, handle)
                    reader._waiters.add(self)
                    self._readers[handle] = reader

    def detach(self, reader: Reader) -> None:
        """Stop waiting for `reader`."""
        if isinstance(reader, CycloneReader) and reader.condition is not None:
            handle = reader.condition._ref
            if self._readers.pop(handle, None) is not None and self._set:
                dds_waitset_detach(self._set._ref, handle)
            reader._waiters.discard(self)

    def wait(self, timeout: int | None) -> list[Reader]:
        wait_set, guard = self._set, self._guard
        if wait_set is None:
            return []
        limit = SLICE if timeout is None else min(max(timeout, 0), SLICE)
        found = (ctypes.c_ssize_t * _MANY)()
        # A participant that was closed meanwhile takes its wait sets along and ends their waits:
        # the count is negative then.
        count = dds_waitset_wait(wait_set._ref, found, _MANY, limit)
        handles = found[: max(count, 0)]
        if 0 in handles or count > _MANY:
            with contextlib.suppress(DDSException):
                guard.take()
        readers = self._readers
        if count > _MANY:
            return list(readers.values())
        return [readers[handle] for handle in handles if handle in readers]

    def wake(self) -> None:
        guard = self._guard
        if guard is not None:
            with contextlib.suppress(DDSException):
                guard.set(True)

    def close(self) -> None:
        with uninterrupted(), _lock:
            for reader in list(self._readers.values()):
                self.detach(reader)
            self._set = None
            self._guard = None


class CycloneParticipant(Participant):
    """A domain participant, its topics, and the list of everybody's endpoints."""

    def __init__(self, domain_id: int) -> None:
        self.domain_id = domain_id
        with _lock:
            qos = CycloneQos(Policy.Userdata(b"enclave=/;"))
            try:
                self._types = _enter_domain(domain_id)
                self.participant: Any = DomainParticipant(domain_id, qos=qos)
            except DDSException as error:
                raise RuntimeError(
                    f"cannot enter DDS domain {domain_id}{settings_in_use()}: {error}"
                ) from error
            _participants[domain_id] = _participants.get(domain_id, 0) + 1
            self.guid = self.participant.guid.bytes
            self.publisher: Any = Publisher(self.participant)
            self.subscriber: Any = Subscriber(self.participant)
            self._topics: dict[tuple[str, str, str], Topic] = {}
            self._builtin: Any = None
            self._endpoints: dict[tuple[bool, bytes], Endpoint] = {}

    def _topic(self, name: str, type_name: str, type_hash: str) -> Topic:
        key = (name, type_name, type_hash)
        if key not in self._topics:
            self._topics[key] = self._types.create_topic(self.participant, *key)
        return self._topics[key]

    def create_writer(
        self, topic: str, type_name: str, type_hash: str, qos: Qos, extra_user_data: str = ""
    ) -> Writer:
        with _lock:
            policies = to_cyclone(qos, user_data(type_hash, extra_user_data), True)
            return CycloneWriter(self, self._topic(topic, type_name, type_hash), policies)

    def create_reader(
        self, topic: str, type_name: str, type_hash: str, qos: Qos, extra_user_data: str = ""
    ) -> Reader:
        with _lock:
            policies = to_cyclone(qos, user_data(type_hash, extra_user_data), False)
            return CycloneReader(self, self._topic(topic, type_name, type_hash), policies)

    def create_waiter(self) -> Waiter:
        with _lock:
            return CycloneWaiter(self)

    def endpoints(self) -> list[Endpoint]:
        with uninterrupted(), _lock:
            if self.participant is None:
                return []
            if self._builtin is None:
                self._builtin = [
                    (False, BuiltinDataReader(self.participant, BuiltinTopicDcpsPublication)),
                    (True, BuiltinDataReader(self.participant, BuiltinTopicDcpsSubscription)),
                ]
            for is_reader, reader in self._builtin:
                # Taking leaves only news for the next call; what was taken is kept here.
                while samples := reader.take(N=64):
                    for sample in samples:
                        self._note(is_reader, sample)
            return list(self._endpoints.values())

    def _note(self, is_reader: bool, sample: Any) -> None:
        key = (is_reader, sample.key.bytes)
        info = sample.sample_info
        if not info.valid_data or info.instance_state != InstanceState.Alive:
            self._endpoints.pop(key, None)
            return
        qos, announced = from_cyclone(sample.qos)
        self._endpoints[key] = Endpoint(
            guid=sample.key.bytes,
            participant=sample.participant_key.bytes,
            topic=sample.topic_name,
            type_name=sample.type_name,
            is_reader=is_reader,
            qos=qos,
            user_data=announced,
        )

    def close(self) -> None:
        with uninterrupted(), _lock:
            if self.participant is None:
                return
            self._builtin = None
            self._topics.clear()
            self.publisher = self.subscriber = None
            self.participant = None
            _participants[self.domain_id] -= 1
