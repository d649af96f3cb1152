# SPDX-License-Identifier: Apache-2.0
"""Messages as dictionaries, YAML and comma-separated values."""

from __future__ import annotations

import array
import sys
from collections import OrderedDict
from collections.abc import Iterable, Mapping
from functools import partial
from typing import Any

import numpy as np
import yaml
from rosidl_parser.definition import (
    AbstractNestedType,
    AbstractString,
    AbstractWString,
    Array,
    BasicType,
    BoundedSequence,
    NamespacedType,
)

_COLLECTIONS = (list, tuple, array.array, np.ndarray)


class _Dumper(yaml.Dumper):
    """Keeps the order of members."""


def _represent_members(dumper: _Dumper, members: OrderedDict) -> yaml.Node:
    # Without a style of its own the outermost mapping is written in block style always.
    pairs = [(dumper.represent_data(k), dumper.represent_data(v)) for k, v in members.items()]
    return yaml.MappingNode("tag:yaml.org,2002:map", pairs)


_Dumper.add_representer(OrderedDict, _represent_members)


def get_message_slot_types(msg: Any) -> OrderedDict[str, Any]:
    """Member names and their types (:mod:`rosidl_parser.definition`)."""
    return OrderedDict(zip(msg.get_fields_and_field_types(), msg.SLOT_TYPES, strict=True))


def _type_name(slot: Any) -> str:
    if isinstance(slot, BasicType):
        return slot.typename
    if isinstance(slot, AbstractString):
        return "string"
    if isinstance(slot, AbstractWString):
        return "wstring"
    return "/".join(slot.namespaced_name()) if isinstance(slot, NamespacedType) else slot.name


def _instead_of_values(value: Any, slot: AbstractNestedType) -> str:
    name = _type_name(slot.value_type)
    if isinstance(slot, Array):
        return f"<array type: {name}[{slot.size}]>"
    if isinstance(slot, BoundedSequence):
        name += f"[{slot.maximum_size}]"
    return f"<sequence type: {name}, length: {len(value)}>"


def _convert_value(
    value: Any,
    *,
    field_type: Any = None,
    truncate_length: int | None = None,
    no_arr: bool = False,
    no_str: bool = False,
) -> Any:
    """A member's value as plain Python: see :func:`message_to_ordereddict`."""
    convert = partial(_convert_value, truncate_length=truncate_length, no_arr=no_arr, no_str=no_str)
    if isinstance(value, (str, bytes)):
        if no_str and isinstance(value, str):
            return f"<string length: <{len(value)}>>"
        cut = truncate_length is not None and len(value) > truncate_length
        text = value[:truncate_length] if cut else value
        if isinstance(text, bytes):
            text = text.decode("latin-1")
        return text + "..." if cut else text
    if isinstance(value, _COLLECTIONS):
        if no_arr and field_type is not None:
            return _instead_of_values(value, field_type)
        cut = truncate_length is not None and len(value) > truncate_length
        items = [convert(item) for item in (value[:truncate_length] if cut else value)]
        if cut:
            items.append("...")
        return tuple(items) if isinstance(value, tuple) else items
    if isinstance(value, Mapping):
        return {_convert_value(key): convert(item) for key, item in value.items()}
    if isinstance(value, np.number):
        return value.item()
    if isinstance(value, (bool, int, float)):
        return value
    return message_to_ordereddict(
        value, truncate_length=truncate_length, no_arr=no_arr, no_str=no_str
    )


def message_to_ordereddict(
    msg: Any, *, truncate_length: int | None = None, no_arr: bool = False, no_str: bool = False
) -> OrderedDict[str, Any]:
    """A message as plain values, nested messages as dictionaries, bytes as text.

    :param truncate_length: how much of strings and arrays is kept; ``...`` follows what is cut.
    :param no_arr: say the type and length of arrays instead of their values.
    :param no_str: say the length of strings instead of their text.
    """
    limits: Any = {"truncate_length": truncate_length, "no_arr": no_arr, "no_str": no_str}
    return OrderedDict(
        (name, _convert_value(getattr(msg, name, None), field_type=slot, **limits))
        for name, slot in get_message_slot_types(msg).items()
    )


def message_to_yaml(
    msg: Any,
    *,
    truncate_length: int | None = None,
    no_arr: bool = False,
    no_str: bool = False,
    flow_style: bool = False,
) -> str:
    """A message as YAML text, as ``ros2 topic echo`` prints it.

    :param flow_style: write arrays in brackets on one line.

    The other parameters are those of :func:`message_to_ordereddict`.
    """
    members = message_to_ordereddict(
        msg, truncate_length=truncate_length, no_arr=no_arr, no_str=no_str
    )
    return yaml.dump(
        members,
        Dumper=_Dumper,
        allow_unicode=True,
        width=sys.maxsize,
        default_flow_style=flow_style,
    )


def message_to_csv(
    msg: Any, *, truncate_length: int | None = None, no_arr: bool = False, no_str: bool = False
) -> str:
    """All values of a message in one line, separated by commas.

    The parameters are those of :func:`message_to_ordereddict`.
    """

    def text(value: Any, slot: Any = None) -> str:
        if isinstance(value, _COLLECTIONS):
            if no_arr and slot is not None:
                return _instead_of_values(value, slot)
            cut = truncate_length is not None and len(value) > truncate_length
            items = [text(item) for item in (value[:truncate_length] if cut else value)]
            return _join([*items, "..."] if cut else items)
        if isinstance(value, (str, bytes)):
            if no_str and isinstance(value, str):
                return f"<string length: <{len(value)}>>"
            if truncate_length is not None and len(value) > truncate_length:
                dots: Any = b"..." if isinstance(value, bytes) else "..."
                value = value[:truncate_length] + dots
            return str(value)
        if isinstance(value, (bool, int, float, np.number)):
            return str(value)
        return message_to_csv(value, truncate_length=truncate_length, no_arr=no_arr, no_str=no_str)

    return _join(
        text(getattr(msg, name), slot) for name, slot in get_message_slot_types(msg).items()
    )


def _join(parts: Iterable[str]) -> str:
    """Join with commas as ROS 2 does: none follow an empty beginning."""
    line = ""
    for part in parts:
        line += f",{part}" if line else part
    return line
