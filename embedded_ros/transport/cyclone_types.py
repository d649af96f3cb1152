# SPDX-License-Identifier: Apache-2.0
"""QoS, data types and topics between this package and Cyclone DDS."""

from __future__ import annotations

import ctypes
from typing import Any

from cyclonedds.core import Entity
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import make_idl_struct, types
from cyclonedds.qos import Policy
from cyclonedds.qos import Qos as CycloneQos
from cyclonedds.topic import Topic

from .base import INFINITE, Qos
from .cyclone_library import dds_create_topic_sertype, dds_get_entity_sertype, ddsi_sertype_ref

#: how long a write may wait for a stalled reader of a keep-all writer, ns
MAX_BLOCKING = 500_000_000


def to_cyclone(qos: Qos, user_data: bytes, writer: bool) -> CycloneQos:
    """Cyclone's policies for a writer or reader that announces `user_data`."""
    history = Policy.History.KeepAll if qos.keep_all else Policy.History.KeepLast(max(qos.depth, 1))
    liveliness = (
        Policy.Liveliness.ManualByTopic if qos.manual_liveliness else Policy.Liveliness.Automatic
    )
    policies: list[Any] = [
        history,
        Policy.Reliability.Reliable(MAX_BLOCKING)
        if qos.reliable
        else Policy.Reliability.BestEffort,
        liveliness(qos.liveliness_lease),
        Policy.Deadline(qos.deadline),
        Policy.DataRepresentation(use_cdrv0_representation=True),
        Policy.Userdata(user_data),
    ]
    if qos.transient_local:
        policies.append(Policy.Durability.TransientLocal)
        policies.append(Policy.DurabilityService(0, history, -1, -1, -1))
    else:
        policies.append(Policy.Durability.Volatile)
    if writer:
        policies.append(Policy.Lifespan(qos.lifespan))
        policies.append(Policy.WriterDataLifecycle(autodispose=False))
    return CycloneQos(*policies)


def from_cyclone(qos: CycloneQos) -> tuple[Qos, bytes]:
    """The policies that discovery carries, and the user data."""
    history = qos[Policy.History]
    liveliness = qos[Policy.Liveliness]
    lifespan = qos[Policy.Lifespan]
    deadline = qos[Policy.Deadline]
    user_data = qos[Policy.Userdata]
    result = Qos(
        reliable=isinstance(qos[Policy.Reliability], Policy.Reliability.Reliable),
        transient_local=qos[Policy.Durability] not in (None, Policy.Durability.Volatile),
        keep_all=history == Policy.History.KeepAll,
        depth=getattr(history, "depth", 0),
        deadline=deadline.deadline if deadline else INFINITE,
        lifespan=lifespan.lifespan if lifespan else INFINITE,
        manual_liveliness=isinstance(liveliness, Policy.Liveliness.ManualByTopic),
        liveliness_lease=liveliness.lease_duration if liveliness else INFINITE,
    )
    return result, user_data.data if user_data else b""


_carriers: dict[tuple[str, str], Any] = {}


def carrier(type_name: str, type_hash: str) -> Any:
    """A DDS type of the given name whose samples are bytes.

    Between peers that both announce type information Cyclone matches by structure and not by name,
    so the one member is named after the type hash: only equal types match.
    """
    key = (type_name, type_hash)
    if key not in _carriers:
        member = "h" + type_hash.rpartition("_")[2][:16]
        short = type_name.rpartition("::")[2]
        cls: Any = make_idl_struct(
            short, type_name.replace("::", "."), {member: types.uint8}, dataclassify=False
        )

        def construct(self: Any, payload: bytes) -> None:
            self.payload = payload

        cls.__init__ = construct
        cls.serialize = lambda self, *args, **kwargs: self.payload
        cls.deserialize = classmethod(lambda cls_, data, *args, **kwargs: cls_(data))
        cls.deserialize_key = classmethod(lambda cls_, data, *args, **kwargs: cls_(data))
        _carriers[key] = cls
    return _carriers[key]


class TypesOfDomain:
    """The data types that a domain knows; each stays for as long as the domain.

    The binding would free a type with its last topic, though the library goes on reading it with
    the samples of other topics; and with each further topic of a type it would set that type up
    anew, while other threads use it. Both have crashed programs.
    """

    def __init__(self) -> None:
        self._known: dict[tuple[str, str], int] = {}

    def create_topic(
        self, participant: DomainParticipant, name: str, type_name: str, type_hash: str
    ) -> Topic[Any]:
        """Make a topic. The caller sees to it that no other thread does."""
        key = (type_name, type_hash)
        if key in self._known:
            return _FurtherTopic(participant, name, carrier(*key), self._known[key])
        topic: Topic[Any] = Topic(participant, name, carrier(*key))
        known = ctypes.c_void_p()
        dds_get_entity_sertype(topic._ref, known)
        ddsi_sertype_ref(known)
        assert known.value is not None
        self._known[key] = known.value
        return topic


class _FurtherTopic(Topic[Any]):
    """A topic of a type that the domain knows."""

    def __init__(
        self, participant: DomainParticipant, name: str, data_type: Any, known: int
    ) -> None:
        self.data_type = data_type
        self._keepalive_entities = [participant]
        ddsi_sertype_ref(known)  # for the topic, which takes over this reference
        Entity.__init__(
            self,
            dds_create_topic_sertype(
                participant._ref, name.encode(), ctypes.c_void_p(known), None, None, None
            ),
        )
