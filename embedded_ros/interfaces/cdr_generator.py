# SPDX-License-Identifier: Apache-2.0
"""What the writing and the reading side of the CDR code generator share: layout, alignment,
grouping.
"""

from __future__ import annotations

import array
import struct
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any

import numpy as np

from .spec import CODES, SIZES, STRINGS, FieldType, MessageSpec

_PAD = tuple(bytes(n) for n in range(8))


class CdrError(ValueError):
    """Bytes are not a valid encoding of the message, or a message holds what cannot be encoded."""


def short(need: int, have: int) -> CdrError:
    """Make the error for a payload of `have` bytes where `need` were called for."""
    return CdrError(f"the payload ends early: byte {need} is needed, it has {have}")


Specs = Callable[[str], MessageSpec]


def flat_layout(spec: MessageSpec, specs: Specs, path: str = "") -> list[tuple[str, str]] | None:
    """``(attribute path, primitive)`` of every leaf, or None when the size depends on content."""
    leaves: list[tuple[str, str]] = []
    if not spec.fields:
        return None
    for member in spec.fields:
        ftype = member.type
        if ftype.kind != "scalar" or ftype.base in STRINGS:
            return None
        here = f"{path}._{member.name}"
        if ftype.is_message:
            inner = flat_layout(specs(ftype.base), specs, here)
            if inner is None:
                return None
            leaves += inner
        else:
            leaves.append((here, ftype.base))
    return leaves


def uniform_format(leaves: list[tuple[str, str]]) -> tuple[str, int, int] | None:
    """Struct format, size and alignment of a layout that repeats without a change of padding, else
    None.
    """
    first = SIZES[leaves[0][1]]
    position, text = 0, ""
    for _, base in leaves:
        size = SIZES[base]
        if size > first:
            return None
        pad = -position % size
        text += "x" * pad + CODES[base]
        position += pad + size
    return (text, position, first) if position % first == 0 else None


class Generator(ABC):
    """State shared by both directions: lines, names, the open struct group, what is known of the
    position.
    """

    def __init__(self, specs: Specs, classes: Callable[[str], type], endian: str) -> None:
        self.specs = specs
        self.classes = classes
        self.endian = endian
        self.lines: list[str] = []
        self.depth = 1
        self.scope: dict[str, Any] = {"new": object.__new__, "np": np, "PAD": _PAD, "short": short}
        self.scope.update(pack=struct.pack, unpack_from=struct.unpack_from, array=array.array)
        self.scope.update(iter_unpack=struct.iter_unpack)
        self.modulus, self.residue = 8, 0
        self.group: list[str] = []
        self.group_format = ""
        self.count = 0

    def name(self, stem: str) -> str:
        self.count += 1
        return f"{stem}{self.count}"

    def emit(self, line: str) -> None:
        self.lines.append("    " * self.depth + line)

    def class_name(self, message: str) -> str:
        name = "C_" + message.replace("/", "_")
        self.scope[name] = self.classes(message)
        return name

    def struct_name(self, layout: str) -> str:
        name = self.name("S")
        self.scope[name] = struct.Struct(self.endian + layout)
        return name

    def primitive(self, base: str, expression: str) -> None:
        size = SIZES[base]
        if size > self.modulus:
            self.flush()
            self.align(size)
        pad = -self.residue % size
        self.group_format += "x" * pad + CODES[base]
        self.group.append(expression)
        self.residue = (self.residue + pad + size) % self.modulus

    def align(self, size: int) -> None:
        """Bring the position to a multiple of `size`; nothing may be pending."""
        if size <= self.modulus:
            pad = -self.residue % size
            if pad:
                self.emit_skip(pad)
            self.residue = (self.residue + pad) % self.modulus
        else:
            self.emit_align(size)
            self.modulus, self.residue = size, 0

    def forget(self, modulus: int) -> None:
        """After content of unknown size only this much is known of the position."""
        self.modulus, self.residue = modulus, 0

    def loop(self, head: str, body: Callable[[], None]) -> None:
        """Emit a loop whose body starts at an unknown position."""
        self.forget(1)
        self.emit(head)
        self.depth += 1
        body()
        self.flush()
        self.depth -= 1
        self.forget(1)

    def message(self, spec: MessageSpec, holder: str) -> None:
        if not spec.fields:
            self.primitive("uint8", self.empty)
        for member in spec.fields:
            self.member(member.type, f"{holder}._{member.name}")

    def member(self, ftype: FieldType, target: str) -> None:
        if ftype.kind == "scalar":
            self.element(ftype, target)
        else:
            self.collection(ftype, target)

    empty = ""

    @abstractmethod
    def flush(self) -> None: ...

    @abstractmethod
    def emit_skip(self, size: int) -> None: ...

    @abstractmethod
    def emit_align(self, size: int) -> None: ...

    @abstractmethod
    def element(self, ftype: FieldType, target: str) -> None: ...

    @abstractmethod
    def collection(self, ftype: FieldType, target: str) -> None: ...

    def compile(self, head: str, tail: str) -> Callable[..., Any]:
        self.flush()
        source = "\n".join([head, *self.lines, "    " + tail])
        exec(compile(source, f"<cdr {head}>", "exec"), self.scope)
        return self.scope["run"]
