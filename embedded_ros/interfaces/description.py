# SPDX-License-Identifier: Apache-2.0
"""Type descriptions and their hashes (REP-2016, REP-2011): how ROS 2 machines compare types."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from typing import Any

from .spec import Field, FieldType, MessageSpec

Specs = Callable[[str], MessageSpec]

#: base type -> the number that type_description_interfaces/msg/FieldType gives it
_TYPE_IDS = {
    "int8": 2,
    "uint8": 3,
    "char": 3,  # as rosidl translates it
    "int16": 4,
    "uint16": 5,
    "int32": 6,
    "uint32": 7,
    "int64": 8,
    "uint64": 9,
    "float32": 10,
    "float64": 11,
    "bool": 15,
    "byte": 16,
    "string": 17,
    "wstring": 18,
}
#: what is added for an array, a bounded and an unbounded sequence
_ARRAY, _BOUNDED, _UNBOUNDED = 48, 96, 144

_DUMMY = Field("structure_needs_at_least_one_member", FieldType("uint8"))


def _field_type(ftype: FieldType) -> dict[str, Any]:
    number = 1 if ftype.is_message else _TYPE_IDS[ftype.base]
    if ftype.string_bound:
        number += 4
    if ftype.kind == "array":
        number += _ARRAY
    elif ftype.kind == "sequence":
        number += _BOUNDED if ftype.size else _UNBOUNDED
    return {
        "type_id": number,
        "capacity": ftype.size,
        "string_capacity": ftype.string_bound,
        "nested_type_name": ftype.base if ftype.is_message else "",
    }


def _individual(spec: MessageSpec) -> dict[str, Any]:
    fields = [
        {"name": member.name, "type": _field_type(member.type)}
        for member in spec.fields or [_DUMMY]
    ]
    return {"type_name": spec.name, "fields": fields}


def describe(name: str, specs: Specs) -> dict[str, Any]:
    """What ``type_description_interfaces/msg/TypeDescription`` holds, default values left out.

    :param name: a message, service or action, or a part of one.
    :param specs: gives the specification of any of them.
    """
    spec = specs(name)
    referenced: dict[str, MessageSpec] = {}
    waiting = [spec]
    while waiting:
        for member in waiting.pop().fields:
            if member.type.is_message and member.type.base not in referenced:
                referenced[member.type.base] = specs(member.type.base)
                waiting.append(referenced[member.type.base])
    return {
        "type_description": _individual(spec),
        "referenced_type_descriptions": [
            _individual(referenced[key]) for key in sorted(referenced)
        ],
    }


def type_hash(name: str, specs: Specs) -> str:
    """The hash of a type, as ``RIHS01_<64 hex digits>``."""
    text = json.dumps(describe(name, specs))
    return "RIHS01_" + hashlib.sha256(text.encode()).hexdigest()
