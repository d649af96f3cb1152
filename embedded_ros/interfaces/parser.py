# SPDX-License-Identifier: Apache-2.0
"""Reads the text of ``.msg``, ``.srv`` and ``.action`` files as rosidl reads it.

The form is that of https://docs.ros.org/en/jazzy/Concepts/Basic/About-Interfaces.html. A ``#``
begins a comment even inside quotes, as in rosidl.
"""

from __future__ import annotations

import keyword
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from .spec import (
    PRIMITIVES,
    STRINGS,
    Constant,
    DefinitionError,
    Field,
    FieldType,
    MessageSpec,
    int_range,
)

_TYPE = re.compile(
    r"(?P<base>[^\[<]+)(<=(?P<string_bound>[1-9]\d*))?"
    r"(\[(?P<array>(?P<upto><=)?(?P<size>[1-9]\d*)?)\])?"
)
_MESSAGE = re.compile(r"(?:(?P<package>[a-z](?:_?[a-z0-9])*)/)?(?P<name>[A-Z][A-Za-z0-9]*)")
_MEMBER = re.compile(r"[a-z](_?[a-z0-9])*")
_CONSTANT = re.compile(r"[A-Z](_?[A-Z0-9])*")
_ELEMENT = re.compile(r"""\s*(?:"((?:\\"|[^"])*)"|'((?:\\'|[^'])*)'|([^,"'\s][^,]*))\s*(?:,|$)""")


@dataclass(frozen=True)
class Section:
    """A message's part of a file: where it comes from, the number of its first line, its lines."""

    source: str
    first: int
    lines: list[str]


def split_sections(text: str, count: int, source: str) -> list[Section]:
    """Split the text of a message (1), service (2) or action (3) at its ``---`` lines.

    :param source: the file, or whatever else errors shall name.
    :raises DefinitionError: there are more or fewer.
    """
    sections = [Section(source, 1, [])]
    for number, line in enumerate(text.splitlines(), 1):
        if count > 1 and line.rstrip() == "---":
            sections.append(Section(source, number + 1, []))
        else:
            sections[-1].lines.append(line)
    if len(sections) != count:
        raise DefinitionError(
            f"{source}: {len(sections) - 1} lines '---' where {count - 1} are needed"
        )
    return sections


def parse_message(section: Section, name: str) -> MessageSpec:
    """Parse the definition of message `name` (``package/msg/Name``).

    :raises DefinitionError: a line cannot be read; the error names file, line number and text.
    """
    package = name.split("/")[0]
    members: dict[str, Field | Constant] = {}
    for number, raw in enumerate(section.lines, section.first):
        line = raw.replace("\t", " ").partition("#")[0].strip()
        if not line:
            continue
        try:
            member = _parse_line(line, package)
            if member.name in members:
                raise ValueError(f"there are two members {member.name!r}")
        except ValueError as error:
            raise DefinitionError(f"{section.source}:{number}: {raw.strip()!r}: {error}") from error
        members[member.name] = member
    return MessageSpec(
        name,
        tuple(member for member in members.values() if isinstance(member, Field)),
        tuple(member for member in members.values() if isinstance(member, Constant)),
    )


def _parse_line(line: str, package: str) -> Field | Constant:
    type_text, _, rest = line.partition(" ")
    ftype = _parse_type(type_text, package)
    name, equals, value = (part.strip() for part in rest.partition("="))
    if equals:
        if ftype.is_message or ftype.kind != "scalar" or ftype.string_bound:
            raise ValueError(f"a constant cannot be of type {type_text!r}")
        if not _CONSTANT.fullmatch(name):
            raise ValueError(f"{name!r} is no name for a constant, which is in CAPITALS")
        return Constant(name, ftype, _parse_value(value, ftype))
    name, _, value = (part.strip() for part in rest.strip().partition(" "))
    if not name:
        raise ValueError('expected "type name", "type name default" or "type NAME=value"')
    if not _MEMBER.fullmatch(name) or keyword.iskeyword(name):
        raise ValueError(
            f"{name!r} is no name for a member, which is in lower_case and no word of Python's"
        )
    return Field(name, ftype, _parse_value(value, ftype) if value else None)


def _parse_type(text: str, package: str) -> FieldType:
    match = _TYPE.fullmatch(text)
    if match is None:
        raise ValueError(f"cannot read the type {text!r}")
    base = match["base"]
    if match["string_bound"] and base not in STRINGS:
        raise ValueError(f"only strings have a bound: {text!r}")
    if base not in PRIMITIVES and base not in STRINGS:
        parts = _MESSAGE.fullmatch(base)
        if parts is None:
            raise ValueError(f"{base!r} is neither a built-in type nor a message's name")
        base = f"{parts['package'] or package}/msg/{parts['name']}"
    kind, size = "scalar", 0
    if match["array"] is not None:
        if match["upto"] and not match["size"]:
            raise ValueError(f"{text!r} lacks its bound")
        size = int(match["size"] or 0)
        kind = "array" if size and not match["upto"] else "sequence"
    return FieldType(base, kind, size, int(match["string_bound"] or 0))


def _parse_value(text: str, ftype: FieldType) -> Any:
    """Read a constant or default value written for `ftype`."""
    if ftype.is_message:
        raise ValueError("a member that is a message has no default")
    if ftype.kind == "scalar":
        if ftype.base in STRINGS:
            return _bounded(_unescaped(_unquoted(text)), ftype)
        return _parse_number(text, ftype.base)
    if text[0] != "[" or text[-1] != "]":
        raise ValueError(f"expected [values], got {text}")
    body = text[1:-1]
    values: list[Any]
    if ftype.base in STRINGS:
        values = [_bounded(item, ftype) for item in _string_items(body)]
    else:
        values = [_parse_number(item.strip(), ftype.base) for item in body.split(",") if body]
    fits = len(values) == ftype.size if ftype.kind == "array" else len(values) <= ftype.size
    if ftype.size and not fits:
        raise ValueError(f"{len(values)} values for {ftype.text('')}")
    return values


def _parse_number(text: str, base: str) -> Any:
    if base == "bool":
        if text.lower() not in ("true", "false", "0", "1"):
            raise ValueError(f"{text!r} is no boolean (true, false, 1 or 0)")
        return text.lower() in ("true", "1")
    if base.startswith("float"):
        return float(text)
    try:
        number = int(text)
    except ValueError:
        number = int(text, 0)
    low, high = int_range(base)
    if not low <= number <= high:
        raise ValueError(f"{number} is no {base}: {low} to {high}")
    return bytes([number]) if base == "byte" else number


def _unquoted(text: str) -> str:
    quote = text[:1]
    if quote not in ("'", '"') or not text.endswith(quote) or len(text) < 2:
        return text
    if re.search(rf"(?<!\\){quote}", text[1:-1]):
        raise ValueError(f"a {quote} inside {quote} quotes needs a backslash: {text}")
    return text[1:-1].replace("\\" + quote, quote)


def _unescaped(text: str) -> str:
    """Text with its escape sequences read, such as ``\\t`` and ``\\x41``."""
    return text.encode().decode("unicode_escape").encode("latin-1").decode()


def _bounded(text: str, ftype: FieldType) -> str:
    if ftype.string_bound and len(text) > ftype.string_bound:
        raise ValueError(f"{text!r} is longer than {ftype.string_bound}")
    return text


def _string_items(body: str) -> Iterator[str]:
    """The elements of an array of strings, quoted or not; a comma may follow the last."""
    start = 0
    while body[start:].strip():
        match = _ELEMENT.match(body, start)
        if match is None:
            raise ValueError(f"expected strings and commas: [{body}]")
        double, single, plain = match.groups()
        if double is not None:
            plain = double.replace('\\"', '"')
        elif single is not None:
            plain = single.replace("\\'", "'")
        yield _unescaped(_unquoted(plain.strip()))
        start = match.end()
