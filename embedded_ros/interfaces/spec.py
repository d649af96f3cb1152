# SPDX-License-Identifier: Apache-2.0
"""What a ROS message definition says, as plain data; type names are always the full three-part
ones (``geometry_msgs/msg/Point``).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

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
PRIMITIVES = frozenset(CODES)
#: primitive -> type of the elements of a numpy array
NUMPY_TYPES: dict[str, Any] = {
    name: np.dtype("uint8" if name == "char" else name).type
    for name in CODES
    if name not in ("bool", "byte")
}
STRINGS = frozenset(("string", "wstring"))

#: primitive -> bytes on the wire, which is also its alignment
SIZES = {
    name: {"?": 1, "c": 1, "b": 1, "h": 2, "i": 4, "q": 8, "f": 4, "d": 8}[code.lower()]
    for name, code in CODES.items()
}


class DefinitionError(ValueError):
    """An interface definition cannot be used; the message names file and line."""


def int_range(base: str) -> tuple[int, int]:
    """Smallest and largest value of an integer type."""
    bits = 8 * SIZES[base]
    if base.startswith("int"):
        return -(2 ** (bits - 1)), 2 ** (bits - 1) - 1
    return 0, 2**bits - 1


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

    def text(self, package: str) -> str:
        """The type as a definition of `package` writes it, e.g. ``float64[<=3]``."""
        owner, _, name = self.base.rpartition("/msg/")
        text = name if owner == package else f"{owner}/{name}".lstrip("/")
        if self.string_bound:
            text += f"<={self.string_bound}"
        if self.kind == "array":
            return f"{text}[{self.size}]"
        if self.kind == "sequence":
            return f"{text}[<={self.size}]" if self.size else f"{text}[]"
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
    type: FieldType
    value: Any


@dataclass(frozen=True)
class MessageSpec:
    """One message: full name, members in wire order, constants."""

    name: str
    fields: tuple[Field, ...]
    constants: tuple[Constant, ...] = ()

    @property
    def package(self) -> str:
        return self.name.split("/")[0]

    def text(self) -> str:
        """A definition that says the same, constants first."""
        lines = [
            f"{constant.type.text(self.package)} {constant.name}={_literal(constant.value)}"
            for constant in self.constants
        ]
        for member in self.fields:
            default = "" if member.default is None else " " + _literal(member.default)
            lines.append(f"{member.type.text(self.package)} {member.name}{default}")
        return "".join(line + "\n" for line in lines)


#: what a quoted string cannot hold as it is: # begins a comment, = makes a constant
_ESCAPES = str.maketrans(
    {"\\": r"\\", '"': r"\"", "#": r"\x23", "=": r"\x3d", "\n": r"\n", "\r": r"\r", "\t": r"\t"}
)


def _literal(value: Any) -> str:
    """A constant or default value as a definition writes it."""
    if isinstance(value, list):
        return f"[{', '.join(_literal(item) for item in value)}]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, bytes):
        return str(value[0])
    return f'"{value.translate(_ESCAPES)}"' if isinstance(value, str) else str(value)
