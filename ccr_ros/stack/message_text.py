# SPDX-License-Identifier: Apache-2.0
"""The text of a message type, from its Python class: what files of recorded messages carry."""

from __future__ import annotations

import re
from importlib import import_module
from typing import Any

_SEPARATOR = "=" * 80
# IDL's names, which rosidl's classes give, as .msg files call them.
_PRIMITIVES = {"boolean": "bool", "octet": "byte", "float": "float32", "double": "float64"}


def definition(kind: type) -> str:
    """Return a type's fields, and those of all types in them, as `ros2msg` schemas have them.

    Each further type follows a line of 80 ``=`` and one that says ``MSG: package/Name``. Default
    values and constants are left out: a reader of serialized messages needs neither.

    Args:
        kind: The message class.
    """
    texts, waiting = [_fields(kind)], _inner(kind)
    seen = set(waiting)
    while waiting:
        name = waiting.pop(0)
        inner = message_class(name)
        texts.append(f"MSG: {name}\n{_fields(inner)}")
        further = [n for n in _inner(inner) if n not in seen]
        seen.update(further)
        waiting += further
    return f"{_SEPARATOR}\n".join(texts)


def type_name(kind: type) -> str:
    """Return a message class's name as topics have it: ``package/msg/Name``."""
    return f"{kind.__module__.split('.')[0]}/msg/{kind.__name__}"


def message_class(name: str) -> type:
    """Return the class of ``package/Name`` or ``package/msg/Name``."""
    parts = name.split("/")
    found: type = getattr(import_module(f"{parts[0]}.msg"), parts[-1])
    return found


def _types(kind: Any) -> dict[str, str]:
    return dict(kind.get_fields_and_field_types())


def _inner(kind: type) -> list[str]:
    """Names of the message types among a type's fields, each once."""
    elements = (_split(text)[0] for text in _types(kind).values())
    return list(dict.fromkeys(name for name in elements if "/" in name))


def _fields(kind: type) -> str:
    lines = []
    for field, text in _types(kind).items():
        element, array = _split(text)
        lines.append(f"{_element(element)}{array} {field}\n")
    # rosidl gives an empty message one member that is nobody's.
    return "".join(lines)


def _split(text: str) -> tuple[str, str]:
    """Return the element type of a field's type, and the array brackets in .msg's form."""
    if match := re.fullmatch(r"sequence<(.*?)(?:, (\d+))?>", text):
        return match[1], f"[<={match[2]}]" if match[2] else "[]"
    if match := re.fullmatch(r"(.*)\[(\d+)\]", text):
        return match[1], f"[{match[2]}]"
    return text, ""


def _element(text: str) -> str:
    if match := re.fullmatch(r"(w?string)<(\d+)>", text):
        return f"{match[1]}<={match[2]}"
    return _PRIMITIVES.get(text, text)
