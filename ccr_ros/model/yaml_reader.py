# SPDX-License-Identifier: Apache-2.0
"""Reads one YAML mapping from a file; what is wrong with the text is said in one line."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from .errors import InvalidFile

_LARGEST = 2_000_000  # bytes; a finger of 1000 segments with 20 cables stays well below
_DEEPEST = 32  # levels of nesting


def read_mapping(path: str | Path) -> dict[Any, Any]:
    """Return the mapping that a YAML file holds.

    Raises:
        InvalidFile: The file cannot be read, is not YAML, or does not hold a mapping.
    """
    data = _parse(path, read_text(path, _LARGEST))
    if data is None:
        raise InvalidFile(path, "is empty; a mapping ('name: ...', one key per line) is wanted")
    if not isinstance(data, Mapping):
        kind = {list: "a list"}.get(type(data), "a single value")
        raise InvalidFile(
            path, f"holds {kind}; a mapping ('name: ...', one key per line) is wanted"
        )
    return dict(data)


def read_text(path: str | Path, largest: int) -> str:
    """Return the text of a UTF-8 file of at most ``largest`` bytes.

    Raises:
        InvalidFile: It cannot be read, is larger, or is not UTF-8 text.
    """
    try:
        with Path(path).open("rb") as file:
            data = file.read(largest + 1)
    except OSError as error:
        raise InvalidFile(path, f"cannot be read: {error.strerror}") from None
    except ValueError as error:  # a null byte in the path
        raise InvalidFile(path, f"cannot be read: {error}") from None
    if len(data) > largest:
        raise InvalidFile(path, f"cannot be read: larger than {largest / 1e6:g} MB")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise InvalidFile(path, f"cannot be read: not UTF-8 text (line {line})") from None


def _parse(path: str | Path, text: str) -> Any:
    try:
        return yaml.load(text, Loader=_Loader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        what = (error.problem or error.context or "").replace("character '\\t'", "a tab")
        reason = f"not valid YAML: {where}{what}"
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        reason = f"not valid YAML: line {line}: character #x{error.character:04x} is not allowed"
    except yaml.YAMLError as error:
        reason = f"not valid YAML: {error}"
    raise InvalidFile(path, " ".join(reason.split()))


class _Loader(yaml.SafeLoader):
    """A safe loader that reads scalars as YAML 1.2 does, and refuses a key given twice.

    YAML 1.1, PyYAML's own, reads 2.8e9 as text, ``no`` and ``on`` as truth values, 010 as eight and
    1:30 as ninety; and of a key given twice it silently keeps the last.
    """

    yaml_implicit_resolvers: dict[Any, Any] = {}
    _depth = 0

    def compose_node(self, parent: Any, index: Any) -> Any:
        """Compose a node; an absurd nesting is refused before it exhausts the stack."""
        self._depth += 1
        if self._depth > _DEEPEST:
            mark = self.peek_event().start_mark
            raise yaml.composer.ComposerError(None, None, "nested too deeply", mark)
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node

    def compose_mapping_node(self, anchor: Any) -> Any:
        """Compose a mapping; here, before merge keys (``<<``) are expanded, repetition shows."""
        node = super().compose_mapping_node(anchor)
        seen = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode):
                if (key.tag, key.value) in seen:
                    problem = f"the key {key.value!r} is given twice"
                    raise yaml.constructor.ConstructorError(None, None, problem, key.start_mark)
                seen.add((key.tag, key.value))
        return node

    def flatten_mapping(self, node: Any) -> None:
        """Expand merge keys, keeping one entry per key: merges of merges must not multiply."""
        super().flatten_mapping(node)
        kept = {}
        for key, value in node.value:
            known = (key.tag, key.value) if isinstance(key, yaml.ScalarNode) else id(key)
            kept[known] = (key, value)
        node.value = list(kept.values())

    def construct_object(self, node: Any, deep: bool = False) -> Any:
        """Construct a value; one that does not fit its explicit tag (``!!int abc``) is located."""
        try:
            return super().construct_object(node, deep=deep)
        except (ValueError, LookupError, AttributeError, TypeError) as error:
            problem = f"not a valid value: {str(error).partition(';')[0]}"
            raise yaml.constructor.ConstructorError(None, None, problem, node.start_mark) from None


for _tag, _pattern, _first in (
    ("bool", r"true|True|TRUE|false|False|FALSE", "tTfF"),
    ("int", r"[-+]?(0|[1-9][0-9]*)", "-+0123456789"),
    (
        "float",
        r"[-+]?(\.[0-9]+|(0|[1-9][0-9]*)(\.[0-9]*)?)([eE][-+]?[0-9]+)?"
        r"|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)",
        "-+.0123456789",
    ),
    ("null", r"~|null|Null|NULL|", ["~", "n", "N", ""]),
    ("merge", r"<<", "<"),
):
    _Loader.add_implicit_resolver(
        f"tag:yaml.org,2002:{_tag}", re.compile(rf"^(?:{_pattern})$"), list(_first)
    )
