# SPDX-License-Identifier: Apache-2.0
"""Interface types by name, and messages filled with values that a person typed as YAML."""

from __future__ import annotations

import copy
import re
import sys
from collections.abc import Callable, Iterator
from typing import Any

import yaml

from ccr_ros.cli.ros.graph import unknown
from ccr_ros.model.errors import CcrError, InvalidValue, UnknownKey

_KINDS = {"msg": "message", "srv": "service", "action": "action"}
_TYPE_NAME = re.compile(r"[a-z][a-z0-9_]*/(?:(?:msg|srv|action)/)?[A-Za-z][A-Za-z0-9_]*")


def message_type(name: str) -> Any:
    """Return the class of a message: ``std_msgs/msg/String``, or ``std_msgs/String``.

    Raises:
        CcrError: there is no such message type.
    """
    return _interface("message", name, "msg")


def service_type(name: str) -> Any:
    """Return the class of a service.

    Raises:
        CcrError: there is no such service type.
    """
    return _interface("service", name, "srv")


def action_type(name: str) -> Any:
    """Return the class of an action.

    Raises:
        CcrError: there is no such action type.
    """
    return _interface("action", name, "action")


def interface_type(name: str) -> Any:
    """Return the class of a message, service or action, by its name in three parts.

    Raises:
        CcrError: there is no such type.
    """
    folder = name.split("/")[1] if name.count("/") == 2 else ""
    if folder not in _KINDS:
        raise InvalidValue("type", name, "written as package/msg/Name (or srv, action)")
    return _interface(_KINDS[folder], name, folder)


def _interface(kind: str, name: str, folder: str) -> Any:
    import rosidl_runtime_py
    from rosidl_runtime_py import utilities

    if not _TYPE_NAME.fullmatch(name) or name.split("/")[1:-1] not in ([], [folder]):
        raise InvalidValue(f"{kind} type", name, f"written as package/{folder}/Name")
    try:
        return getattr(utilities, f"get_{kind}")(name)
    except (AttributeError, ImportError, LookupError, ValueError) as error:
        listed = getattr(rosidl_runtime_py, f"get_{kind}_interfaces")()
        package, _, short = full_type_name(name, folder).split("/")
        if package not in listed:
            raise unknown("package", package, listed, f" with {kind} types") from error
        names = [one.rpartition("/")[2] for one in listed[package]]
        raise unknown(f"{kind} type", short, names, f" in {package}") from error


def full_type_name(name: str, folder: str) -> str:
    """Return ``package/folder/Name`` of a type that may be written without the folder."""
    package, *_, short = name.split("/")
    return f"{package}/{folder}/{short}"


def read_values(text: str, from_stdin: bool = False) -> dict[str, Any]:
    """Return the mapping that a YAML text holds.

    Args:
        text: The text; an empty one gives an empty mapping.
        from_stdin: Whether to read standard input instead.

    Raises:
        CcrError: it is no YAML, or not a mapping.
    """
    text = sys.stdin.read() if from_stdin else text
    values = read_yaml(text)
    if values is None:
        return {}
    if not isinstance(values, dict):
        raise InvalidValue("values", text, "a YAML mapping of fields, as '{data: 1}'")
    return values


def read_yaml(text: str) -> Any:
    """Return what a YAML text holds.

    Raises:
        CcrError: it is no YAML.
    """
    try:
        values = yaml.safe_load(text)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        place = f" at line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        reason = getattr(error, "problem", None) or str(error).splitlines()[0]
        raise CcrError(f"not YAML{place}: {reason}: {' '.join(text.split())[:80]!r}") from error
    for part in _texts(values):
        try:
            part.encode()
        except UnicodeEncodeError as error:
            raise CcrError(f"{part!r} is not Unicode text: {error.reason}") from error
    return values


def _texts(values: Any) -> Iterator[str]:
    """Give every text in nested lists and mappings; YAML anchors can make them endless."""
    waiting, seen = [values], set()
    while waiting:
        value = waiting.pop()
        if isinstance(value, str):
            yield value
        elif isinstance(value, (dict, list)) and id(value) not in seen:
            seen.add(id(value))
            waiting += [*value, *value.values()] if isinstance(value, dict) else value


def fill(message: Any, values: dict[str, Any], **expand: bool) -> list[Callable[[Any], None]]:
    """Set fields of a message, in place.

    Args:
        message: The message.
        values: Fields and their values, nested as the message is.
        expand: ``expand_header_auto`` and ``expand_time_now`` of
            ``rosidl_runtime_py.set_message_fields``.

    Returns:
        Functions that set the time fields which were given as ``auto`` or ``now``.

    Raises:
        UnknownKey: the message has no such field.
        InvalidValue: the value does not fit its field.
    """
    from rosidl_runtime_py import set_message_fields

    _check(message, values, "", expand)
    return set_message_fields(message, values, **expand)


def _check(message: Any, values: dict[str, Any], place: str, expand: dict[str, bool]) -> None:
    """Find the first field that cannot be set, and raise the error that names it."""
    from rosidl_runtime_py import set_message_fields

    fields = message.get_fields_and_field_types()
    for key, value in values.items():
        where = f"{place}.{key}" if place else str(key)
        if key not in fields:
            raise UnknownKey(where, value, ", ".join(fields) or "none")
        part, element = getattr(message, key), _message_of_sequence(fields[key])
        if isinstance(value, dict) and hasattr(part, "get_fields_and_field_types"):
            _check(part, value, where, expand)
        elif isinstance(value, list) and element:
            for index, item in enumerate(value):
                if not isinstance(item, dict):
                    raise InvalidValue(f"{where}[{index}]", item, f"a mapping ({fields[key]})")
                _check(element(), item, f"{where}[{index}]", expand)
        if not _fits(part, value):
            raise InvalidValue(where, value, fields[key])
        try:
            # A copy, as rosidl_runtime_py puts messages into the lists that it is given.
            set_message_fields(type(message)(), {key: copy.deepcopy(value)}, **expand)
        except Exception as error:  # what is raised differs from field to field
            raise InvalidValue(where, value, fields[key]) from error


def _fits(part: Any, value: Any) -> bool:
    """Tell whether a value is of a field's kind, where rosidl_runtime_py would convert any.

    It would make True of every text, cut numbers, and take texts apart and other things for text.
    """
    if isinstance(part, bool):
        return value in (True, False)
    if isinstance(part, str):
        return value is not None and not isinstance(value, (dict, list))
    if isinstance(part, list):
        return not isinstance(value, str)
    return not (type(part) is int and isinstance(value, float) and not value.is_integer())


def _message_of_sequence(field_type: str) -> Any:
    """Return the class of the messages that an array or sequence field holds, or None."""
    found = re.fullmatch(r"(?:sequence<)?(\w+/\w+)(?:, \d+)?(?:>|\[\d+\])", field_type)
    return message_type(found[1]) if found else None
