# SPDX-License-Identifier: Apache-2.0
"""Parameter files and values: YAML as rcl reads it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml  # type: ignore[import-untyped]

_TRUE = frozenset(["Y", "y", "yes", "Yes", "YES", "true", "True", "TRUE", "on", "On", "ON"])
_FALSE = frozenset(["N", "n", "no", "No", "NO", "false", "False", "FALSE", "off", "Off", "OFF"])
_INTEGER = re.compile(r"[-+]?(0x[0-9a-f]+|0[0-7]*|[1-9][0-9]*)", re.IGNORECASE)
_FLOAT = re.compile(
    r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?|[-+]?(inf|infinity|nan)|[-+]?\.inf|\.nan",
    re.IGNORECASE | re.ASCII,
)


class _Loader(yaml.SafeLoader):
    """YAML whose plain scalars are read as rcl reads them: as C does, with no nulls and dates."""


_Loader.yaml_implicit_resolvers = {None: [("!plain", re.compile(""))]}


def _construct_plain(loader: _Loader, node: Any) -> bool | int | float | str:
    text: str = node.value
    if not text:
        raise ValueError(f"line {node.start_mark.line + 1}: a parameter must have a value")
    if text in _TRUE or text in _FALSE:
        return text in _TRUE
    if _INTEGER.fullmatch(text):
        octal = re.match("[-+]?0[0-7]", text)
        value = int(text, 8 if octal else 0)
        if -(2**63) <= value < 2**63:
            return value
    if _FLOAT.fullmatch(text):
        return float(re.sub(r"\.(?=[a-z])", "", text, flags=re.IGNORECASE))
    return text


_Loader.add_constructor("!plain", _construct_plain)


@dataclass(frozen=True)
class ParameterBlock:
    """Parameters for the nodes whose full name fits a pattern (``*``: one part, ``**``: any number
    of parts).
    """

    pattern: str
    values: dict[str, Any]

    def concerns(self, full_node_name: str) -> bool:
        """Whether the block is for that node."""
        expression = ""
        for part in self.pattern.strip("/").split("/"):
            if part == "**":
                expression += r"(/[^/]+)*"
            else:
                expression += "/" + re.escape(part).replace(r"\*", "[^/]+")
        return re.fullmatch(expression, full_node_name) is not None


def _value(loader: _Loader, node: Any, where: str) -> Any:
    """The value of a YAML node, if it is one that parameters can hold.

    :raises ValueError: it is not; the message says where.
    """
    try:
        value = loader.construct_object(node, deep=True)
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from error
    if isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, list):
        kinds = {type(item) for item in value}
        if len(kinds) <= 1 and kinds <= {bool, int, float, str}:
            return value
        raise ValueError(f"{where}: the values of a list must all be of one type, found {value!r}")
    raise ValueError(f"{where}: {value!r} is no parameter value")


def parse_value(text: str) -> Any:
    """A value from the command line.

    :raises ValueError: it cannot be read.
    """
    loader = _Loader(text)
    try:
        node = loader.get_single_node()
        if node is None:
            raise ValueError("a parameter must have a value")
        return _value(loader, node, "value")
    except yaml.YAMLError as error:
        raise ValueError(f"no YAML value: {error}") from error
    finally:
        loader.dispose()


def _flatten(loader: _Loader, tree: Any, where: str, prefix: str = "") -> dict[str, Any]:
    """Nested parameters as one dictionary with dotted names."""
    values: dict[str, Any] = {}
    for key, value in tree.value:
        name = prefix + key.value
        if isinstance(value, yaml.MappingNode):
            values.update(_flatten(loader, value, where, name + "."))
        else:
            values[name] = _value(loader, value, f"{where}: {name}")
    return values


def read_parameter_file(path: str) -> list[ParameterBlock]:
    """Read a parameter file: node names, or namespaces holding them, over ``ros__parameters``.

    A key may stand several times; every one of them counts.

    :raises OSError: the file cannot be read.
    :raises ValueError: it is no parameter file.
    """
    loader = _Loader(Path(path).read_text(encoding="utf-8"))
    blocks: list[ParameterBlock] = []

    def walk(branch: Any, name: str) -> None:
        where = f"{path}, line {branch.start_mark.line + 1}: {name or 'file'}"
        if not isinstance(branch, yaml.MappingNode):
            raise ValueError(f"{where}: expected node names over ros__parameters")
        for key_node, value in branch.value:
            key = str(key_node.value)
            if key != "ros__parameters":
                walk(value, f"{name}/{key.strip('/')}")
                continue
            if not name:
                raise ValueError(f"{where}: ros__parameters stands outside of any node name")
            if not isinstance(value, yaml.MappingNode):
                raise ValueError(f"{where}: ros__parameters must be a mapping")
            blocks.append(ParameterBlock(name, _flatten(loader, value, where)))

    try:
        root = loader.get_single_node()
        if root is not None:
            walk(root, "")
    except yaml.YAMLError as error:
        raise ValueError(f"{path}: {error}") from error
    finally:
        loader.dispose()
    return blocks
