# SPDX-License-Identifier: Apache-2.0
"""Writes the source of a serialising function."""

from __future__ import annotations

from .cdr_generator import Generator, flat_layout, uniform_format
from .spec import STRINGS, FieldType


class Writer(Generator):
    """Emits code that appends to the bytearray ``out``."""

    empty = "0"

    def flush(self) -> None:
        if self.group:
            name = self.struct_name(self.group_format)
            self.emit(f"out += {name}.pack({', '.join(self.group)})")
        self.group, self.group_format = [], ""

    def emit_skip(self, size: int) -> None:
        self.emit(f"out += PAD[{size}]")

    def emit_align(self, size: int) -> None:
        offset = "4 - len(out)" if size == 8 else "-len(out)"
        self.emit(f"out += PAD[({offset}) & {size - 1}]")

    def element(self, ftype: FieldType, target: str) -> None:
        if ftype.is_message:
            spec = self.specs(ftype.base)
            holder = self.name("m")
            self.emit(f"{holder} = {target}")
            self.message(spec, holder)
        elif ftype.base in STRINGS:
            text, wide = self.name("s"), ftype.base == "wstring"
            if wide:
                # UTF-16 code units, but each in the four bytes of a wchar_t: what ROS 2 sends.
                self.emit(f"{text} = memoryview({target}.encode('utf-16-le')).cast('H')")
            else:
                self.emit(f"{text} = {target}.encode()")
            self.primitive("uint32", f"len({text})" if wide else f"len({text}) + 1")
            self.flush()
            if wide:
                self.emit(f"out += pack(f'{self.endian}{{len({text})}}I', *{text})")
            else:
                self.emit(f"out += {text}")
                self.emit("out += b'\\0'")
            self.forget(1)
        else:
            self.primitive(ftype.base, target)

    def collection(self, ftype: FieldType, target: str) -> None:
        items, count = self.name("q"), self.name("n")
        self.emit(f"{items} = {target}")
        if ftype.kind == "sequence":
            self.emit(f"{count} = len({items})")
            self.primitive("uint32", count)
        self.flush()
        leaves = None
        if ftype.is_message:
            leaves = flat_layout(self.specs(ftype.base), self.specs)
        elif ftype.base not in STRINGS:
            leaves = [("", ftype.base)]
        layout = uniform_format(leaves) if leaves else None
        if leaves is None or layout is None:
            item = self.name("e")
            self.loop(f"for {item} in {items}:", lambda: self.element(ftype.scalar, item))
            return
        code, stride, alignment = layout
        before = self.modulus
        if ftype.kind == "sequence":
            self.emit(f"if {count}:")
            self.depth += 1
        self.align(alignment)
        if ftype.is_numeric:
            self.emit(f"out += {items}.tobytes()")
        elif ftype.base == "byte":
            self.emit(f"out += b''.join({items})")
        else:
            repeats = count if ftype.kind == "sequence" else str(ftype.size)
            if len(set(code)) == 1:
                form = f"f'{self.endian}{{{len(code)} * {repeats}}}{code[0]}'"
            else:
                form = f"'{self.endian}' + '{code}' * {repeats}"
            if leaves == [("", ftype.base)]:
                values = items
            else:
                paths = ", ".join("e" + path for path, _ in leaves)
                values = f"[v for e in {items} for v in ({paths},)]"
            self.emit(f"out += pack({form}, *{values})")
        if ftype.kind == "sequence":
            self.depth -= 1
            self.forget(min(alignment, 4, before))
        else:
            self.residue = (self.residue + stride * ftype.size) % self.modulus
