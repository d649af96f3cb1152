# SPDX-License-Identifier: Apache-2.0
"""The CDR code of a message: plain XCDR1, the encoding every ROS 2 middleware speaks.

For each message one Python function per direction is written as text and compiled. Members whose
place is known are gathered into a single struct call; runs of equal elements are packed at once.
Functions work on
the complete payload, which starts with the four-byte encapsulation header, so alignment counts from
byte four.
The host must be little-endian (all hosts with a cyclonedds wheel are); payloads of either byte
order are read.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any

from .cdr_generator import CdrError, Specs, short
from .cdr_reader import Reader
from .cdr_writer import Writer
from .spec import MessageSpec

HEADER = b"\x00\x01\x00\x00"

__all__ = ["HEADER", "CdrError", "make_deserializer", "make_serializer"]


def make_serializer(
    spec: MessageSpec, specs: Specs, classes: Callable[[str], type]
) -> Callable[[Any], bytes]:
    """A function from a message to its payload, header included."""
    writer = Writer(specs, classes, "<")
    writer.scope["HEADER"] = HEADER
    writer.emit("out = bytearray(HEADER)")
    writer.message(spec, "m")
    writer.flush()
    return writer.compile("def run(m):", "return bytes(out)")


def make_deserializer(
    spec: MessageSpec, specs: Specs, classes: Callable[[str], type]
) -> Callable[[bytes], Any]:
    """A function from a payload in either byte order to a message.

    It raises CdrError when the payload is no encoding of the message.
    """

    def build(endian: str) -> Callable[[bytes, int], Any]:
        reader = Reader(specs, classes, endian)
        reader.emit(f"m = new({reader.class_name(spec.name)})")
        reader.message(spec, "m")
        reader.flush()
        return reader.compile("def run(data, have, pos=4):", "return m")

    functions: dict[int, Callable[[bytes, int], Any]] = {}

    def run(data: bytes) -> Any:
        if len(data) < 4:
            raise short(4, len(data))
        function = functions.get(data[1])
        if function is None:
            if data[1] > 1:
                raise CdrError(f"{spec.name}: encoding {data[1]} is not plain CDR (0 or 1)")
            function = functions[data[1]] = build("<" if data[1] else ">")
        try:
            return function(data, len(data))
        except (struct.error, UnicodeDecodeError, MemoryError, OverflowError) as error:
            raise CdrError(f"{spec.name}: {error}") from error

    return run
