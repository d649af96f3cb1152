# SPDX-License-Identifier: Apache-2.0
"""What a ROS message definition says, as plain data.

The text form is that of https://docs.ros.org/en/jazzy/Concepts/Basic/About-Interfaces.html; type
names are always the full three-part ones (``geometry_msgs/msg/Point``).
"""

from __future__ import annotations

import ast
import re
from dataclasses import dataclass, field
from typing import Any

PRIMITIVES = frozenset(
    [
        "bool",
        "byte",
        "char",
        "int8",
        "uint8",
        "int16",
        "uint16",
        "int32",
        "uint32",
        "int64",
        "uint64",
        "float32",
        "float64",
    ]
)
STRINGS = frozenset(("string", "wstring"))

#: primitive -> code shared by the struct and array modules
CODES = {
    "bool": "?",
    "byte": "c",
    "char": "B",
    "int8": "b",
    "uint8": "B",
    "int16": "h",
    "uint16": "H",
    "int32": "i",
    "uint32": "I",
    "int64": "q",
    "uint64": "Q",
    "float32": "f",
    "float64": "d",
}
#: primitive -> bytes on the wire, which is also its alignment
SIZES = {
    name: {"?": 1, "c": 1, "b": 1, "h": 2, "i": 4, "q": 8, "f": 4, "d": 8}[code.lower()]
    for name, code in CODES.items()
}


class DefinitionError(ValueError):
    """An interface definition cannot be used; the message names the interface and the line."""


@dataclass(frozen=True)
class FieldType:
    """Type of one member.

    ``base`` is a primitive, ``string``, ``wstring`` or a full message name; ``kind`` one of
    ``scalar``, ``array`` (``size`` elements) and ``sequence`` (at most ``size`` elements, 0: no
    bound); ``string_bound`` 0 means none.
    """

    base: str
    kind: str = "scalar"
    size: int = 0
    string_bound: int = 0

    @property
    def is_message(self) -> bool:
        return "/" in self.base

    @property
    def is_numeric(self) -> bool:
        """True for elements that rosidl keeps in array.array or numpy arrays."""
        return self.base in PRIMITIVES and self.base not in ("bool", "byte")

    @property
    def scalar(self) -> FieldType:
        """The element type."""
        return FieldType(self.base, string_bound=self.string_bound)

    def idl_name(self) -> str:
        """The name ``get_fields_and_field_types`` gives, e.g. ``sequence<double, 3>``."""
        if self.is_message:
            package, _, name = self.base.split("/")
            text = f"{package}/{name}"
        else:
            text = {
                "bool": "boolean",
                "byte": "octet",
                "char": "uint8",
                "float32": "float",
                "float64": "double",
            }.get(self.base, self.base)
            if self.string_bound:
                text += f"<{self.string_bound}>"
        if self.kind == "array":
            return f"{text}[{self.size}]"
        if self.kind == "sequence":
            return f"sequence<{text}, {self.size}>" if self.size else f"sequence<{text}>"
        return text


@dataclass(frozen=True)
class Field:
    """One member: name, type and the default value of the definition (None: the type's own)."""

    name: str
    type: FieldType
    default: Any = None


@dataclass(frozen=True)
class Constant:
    """A named value of the definition."""

    name: str
    base: str
    value: Any


@dataclass(frozen=True)
class MessageSpec:
    """One message: full name, members in wire order, constants."""

    name: str
    fields: tuple[Field, ...]
    constants: tuple[Constant, ...] = field(default=())

    @property
    def package(self) -> str:
        return self.name.split("/")[0]


_TYPE = re.compile(
    r"(?P<base>[A-Za-z][A-Za-z0-9_/]*)(<=(?P<strlen>\d+))?"
    r"(?P<array>\[(?P<upto><=)?(?P<size>\d*)\])?$"
)
_CONSTANT = re.compile(r"(\S+)\s+([A-Za-z][A-Za-z0-9_]*)\s*=\s*(.*)$")


def _strip_comment(line: str) -> str:
    """Remove a trailing comment; a ``#`` inside quotes stays."""
    quote = ""
    for index, char in enumerate(line):
        if quote:
            if char == quote and line[index - 1] != "\\":
                quote = ""
        elif char in "'\"":
            quote = char
        elif char == "#":
            return line[:index]
    return line


def parse_type(text: str, package: str) -> FieldType:
    """Read a member type such as ``float64[<=3]`` as written in a definition of `package`."""
    match = _TYPE.match(text)
    if match is None:
        raise DefinitionError(f"cannot read the type {text!r}")
    base = match["base"]
    if base not in PRIMITIVES and base not in STRINGS:
        parts = base.split("/")
        if len(parts) == 1:
            parts = [package, "msg", base]
        elif len(parts) == 2:
            parts = [parts[0], "msg", parts[1]]
        base = "/".join(parts)
    if match["array"] is None:
        kind, size = "scalar", 0
    elif match["upto"] or not match["size"]:
        kind, size = "sequence", int(match["size"] or 0)
    else:
        kind, size = "array", int(match["size"])
    return FieldType(base, kind, size, int(match["strlen"] or 0))


def _parse_value(text: str, ftype: FieldType) -> Any:
    """Read a constant or default value written for `ftype`."""
    text = text.strip()
    if ftype.kind != "scalar":
        body = text.strip("[]").strip()
        if ftype.base in STRINGS:
            return list(ast.literal_eval(f"[{body}]"))
        return [_parse_value(part, ftype.scalar) for part in body.split(",") if part.strip()]
    if ftype.base in STRINGS:
        if len(text) > 1 and text[0] == text[-1] and text[0] in "'\"":
            return text[1:-1].replace("\\" + text[0], text[0])
        return text
    if ftype.base == "bool":
        if text.lower() not in ("true", "false", "0", "1"):
            raise ValueError(f"{text!r} is no boolean")
        return text.lower() in ("true", "1")
    if ftype.base.startswith("float"):
        return float(text)
    number = int(text, 0)
    return bytes([number]) if ftype.base == "byte" else number


def parse_message(text: str, name: str) -> MessageSpec:
    """Parse a ``.msg`` text into the specification of message `name` (``package/msg/Name``).

    :raises DefinitionError: a line cannot be read; the error names message, line number and text.
    """
    package = name.split("/")[0]
    fields: list[Field] = []
    constants: list[Constant] = []
    for number, raw in enumerate(text.splitlines(), 1):
        line = _strip_comment(raw).strip()
        if not line or line.startswith("@"):
            continue
        try:
            type_text, _, rest = line.partition(" ")
            member = _CONSTANT.match(line)
            is_constant = member is not None and "<=" not in member[2] and "'" not in member[2]
            if is_constant and member is not None:
                ftype = parse_type(member[1], package)
                value = _parse_value(member[3], ftype)
                constants.append(Constant(member[2], ftype.base, value))
                continue
            words = rest.strip().split(None, 1)
            if not words or not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", words[0]):
                raise DefinitionError('expected "type name [default]" or "type NAME=value"')
            ftype = parse_type(type_text, package)
            default = _parse_value(words[1], ftype) if len(words) > 1 else None
            fields.append(Field(words[0], ftype, default))
        except (ValueError, SyntaxError) as error:
            raise DefinitionError(f"{name}, line {number}: {raw.strip()!r}: {error}") from error
    return MessageSpec(name, tuple(fields), tuple(constants))


def split_sections(text: str, count: int, name: str) -> list[str]:
    """Split a ``.srv`` (2) or ``.action`` (3) text at its ``---`` lines."""
    sections = re.split(r"^---[ \t]*\r?$", text, flags=re.MULTILINE)
    if len(sections) != count:
        raise DefinitionError(f"{name}: expected {count} sections, found {len(sections)}")
    return sections
