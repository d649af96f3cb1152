# SPDX-License-Identifier: Apache-2.0
"""Writes the source of a deserialising function."""

from __future__ import annotations

from typing import Any

import numpy as np

from .cdr_generator import Generator, flat_layout, uniform_format
from .spec import CODES, NUMPY_TYPES, SIZES, STRINGS, FieldType


class Reader(Generator):
    """Emits code that fills messages from ``data`` of ``have`` bytes, starting at ``pos``."""

    empty = "_"

    def flush(self) -> None:
        if self.group:
            name = self.struct_name(self.group_format)
            self.emit(f"{', '.join(self.group)}, = {name}.unpack_from(data, pos)")
            self.emit(f"pos += {self.scope[name].size}")
        self.group, self.group_format = [], ""

    def emit_skip(self, size: int) -> None:
        self.emit(f"pos += {size}")

    def emit_align(self, size: int) -> None:
        self.emit(
            "pos = ((pos + 3) & -8) + 4" if size == 8 else f"pos = (pos + {size - 1}) & -{size}"
        )

    def take(self, size: str) -> str:
        """Emit the bounds check for `size` bytes and return the name of the end position."""
        end = self.name("z")
        self.emit(f"{end} = pos + {size}")
        self.emit(f"if {end} > have: raise short({end}, have)")
        return end

    def element(self, ftype: FieldType, target: str) -> None:
        if ftype.is_message:
            holder = self.name("m")
            self.emit(f"{holder} = {target} = new({self.class_name(ftype.base)})")
            self.message(self.specs(ftype.base), holder)
        elif ftype.base in STRINGS:
            size = self.name("n")
            self.primitive("uint32", size)
            self.flush()
            if ftype.base == "wstring":
                end = self.take(f"4 * {size}")
                units = f"array('H', unpack_from(f'{self.endian}{{{size}}}I', data, pos))"
                self.emit(f"{target} = str({units}, 'utf-16-le', 'replace')")
            else:
                end = self.take(size)
                text = f"str(data[pos:{end} - 1], 'utf-8', 'replace')"
                self.emit(f"{target} = {text} if {size} else ''")
            self.emit(f"pos = {end}")
            self.forget(1)
        else:
            self.primitive(ftype.base, target)

    def collection(self, ftype: FieldType, target: str) -> None:
        count: str = str(ftype.size)
        if ftype.kind == "sequence":
            count = self.name("n")
            self.primitive("uint32", count)
        self.flush()
        leaves = None
        if ftype.is_message:
            leaves = flat_layout(self.specs(ftype.base), self.specs)
        elif ftype.base not in STRINGS:
            leaves = [("", ftype.base)]
        layout = uniform_format(leaves) if leaves else None
        if leaves is None or layout is None:
            self._loop_items(ftype, target, count)
            return
        code, stride, alignment = layout
        before = self.modulus
        if ftype.kind == "sequence":
            empty = f"array('{CODES[ftype.base]}')" if ftype.is_numeric else "[]"
            self.emit(f"if not {count}: {target} = {empty}")
            self.emit("else:")
            self.depth += 1
        self.align(alignment)
        end = self.take(f"{stride} * {count}")
        self._bulk_items(ftype, target, count, end, code, leaves)
        self.emit(f"pos = {end}")
        if ftype.kind == "sequence":
            self.depth -= 1
            self.forget(min(alignment, 4, before))
        else:
            self.residue = (self.residue + stride * ftype.size) % self.modulus

    def _loop_items(self, ftype: FieldType, target: str, count: str) -> None:
        items, item = self.name("q"), self.name("e")
        # Every element takes at least one byte: refuse a length that cannot be before looping over
        # it.
        self.emit(f"if {count} > have - pos: raise short(pos + {count}, have)")
        self.emit(f"{items} = {target} = []")

        def body() -> None:
            self.element(ftype.scalar, item)
            self.flush()
            self.emit(f"{items}.append({item})")

        self.loop(f"for _ in range({count}):", body)

    def _bulk_items(
        self, ftype: FieldType, target: str, count: str, end: str, code: str, leaves: list
    ) -> None:
        if ftype.is_numeric and ftype.kind == "array":
            native: Any = np.dtype(NUMPY_TYPES[ftype.base])
            name = native.name
            self.scope[f"N_{name}"] = native
            self.scope[f"T_{name}"] = native.newbyteorder(self.endian)
            self.emit(f"{target} = np.frombuffer(data, T_{name}, {count}, pos).astype(N_{name})")
        elif ftype.is_numeric:
            values = self.name("a")
            self.emit(f"{values} = {target} = array('{code}')")
            self.emit(f"{values}.frombytes(data[pos:{end}])")
            if self.endian == ">" and len(code) == 1 and SIZES[ftype.base] > 1:
                self.emit(f"{values}.byteswap()")
        elif ftype.base == "byte":
            self.emit(f"{target} = [data[i:i + 1] for i in range(pos, {end})]")
        elif ftype.base == "bool":
            self.emit(f"{target} = list(unpack_from(f'{{{count}}}?', data, pos))")
        else:
            items = self.name("q")
            names = [f"v{i}" for i in range(len(leaves))]
            self.emit(f"{items} = {target} = []")
            self.emit(
                f"for {', '.join(names)}, in iter_unpack('{self.endian}{code}', data[pos:{end}]):"
            )
            self.depth += 1
            self._assemble(ftype.base, "e", iter(names))
            self.emit(f"{items}.append(e)")
            self.depth -= 1

    def _assemble(self, message: str, holder: str, values: Any) -> None:
        """Emit the building of a fixed-size message from already unpacked values."""
        self.emit(f"{holder} = new({self.class_name(message)})")
        for member in self.specs(message).fields:
            target = f"{holder}._{member.name}"
            if member.type.is_message:
                inner = self.name("m")
                self._assemble(member.type.base, inner, values)
                self.emit(f"{target} = {inner}")
            else:
                self.emit(f"{target} = {next(values)}")
