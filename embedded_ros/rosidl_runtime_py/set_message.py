# SPDX-License-Identifier: Apache-2.0
"""Values from dictionaries into messages."""

from __future__ import annotations

import array
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from rosidl_parser.definition import AbstractNestedType, BasicType, NamespacedType
from std_msgs.msg import Header

from .convert import get_message_slot_types
from .import_message import import_message_from_namespaced_type


def set_message_fields(
    msg: Any,
    values: dict[str, Any],
    expand_header_auto: bool = False,
    expand_time_now: bool = False,
) -> list[Callable[[Any], None]]:
    """Set members of a message from a dictionary, such as YAML gives.

    :param expand_header_auto: a Header given as ``auto`` is left to be stamped.
    :param expand_time_now: a Time given as ``now`` is left to be set.
    :return: functions that take a Time and set it where ``auto`` and ``now`` stood.
    :raises AttributeError: the message has no member of that name.
    :raises TypeError: a message is wanted where no dictionary is given.
    :raises ValueError: a value does not convert to the member's type.
    :raises AssertionError: a value is out of the member's range.
    """
    stamps: list[Callable[[Any], None]] = []

    def fill(target: Any, given: Any) -> Any:
        if not hasattr(given, "items"):
            raise TypeError(
                f"Value '{given}' is expected to be a dictionary but is a {type(given).__name__}"
            )
        slots = get_message_slot_types(target)
        for name, value in given.items():
            current = getattr(target, name)
            if expand_header_auto and value == "auto" and isinstance(current, Header):
                stamps.append(partial(setattr, current, "stamp"))
            elif expand_time_now and value == "now" and isinstance(current, Time):
                stamps.append(partial(setattr, target, name))
            else:
                setattr(target, name, elements(slots[name], like(current, value)))
        return target

    def like(current: Any, value: Any) -> Any:
        """The value as what the member holds now."""
        kind = type(current)
        if kind is array.array:
            return array.array(current.typecode, value)
        if kind is np.ndarray:
            return np.array(value, dtype=current.dtype)
        if type(value) is kind:
            return value
        if kind is bytes:
            return _octet(value)
        try:
            return kind(value)
        except TypeError:
            return fill(kind(), value)

    def elements(slot: Any, value: Any) -> Any:
        """The value with dictionaries in lists of messages made messages."""
        if isinstance(slot, AbstractNestedType):
            if isinstance(slot.value_type, NamespacedType):
                cls = import_message_from_namespaced_type(slot.value_type)
                return [fill(cls(), item) for item in value]
            if slot.value_type == BasicType("octet"):
                return [_octet(item) for item in value]
        return value

    fill(msg, values)
    return stamps


def _octet(value: Any) -> Any:
    """A byte given as a number, or as the character that message_to_yaml writes for it."""
    if isinstance(value, int) and 0 <= value <= 255:
        return bytes([value])
    return value.encode("latin-1") if isinstance(value, str) else value
