# SPDX-License-Identifier: Apache-2.0
"""Parameter files and values: YAML as rcl reads it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml  # type: ignore[import-untyped]


class _Loader(yaml.SafeLoader):
    """YAML 1.1 with the numbers that rcl's parser accepts, such as ``1e-3``, and no dates."""


_Loader.yaml_implicit_resolvers = {
    first: [
        (tag, pattern)
        for tag, pattern in resolvers
        if not tag.endswith((":timestamp", ":float", ":int"))
    ]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(
        r"^[-+]?(\d+\.\d*([eE][-+]?\d+)?|\.\d+([eE][-+]?\d+)?|\d+[eE][-+]?\d+|\.(inf|Inf|INF|nan|NaN|NAN))$"
    ),
    list("-+0123456789."),
)
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:int", re.compile(r"^[-+]?(0x[0-9a-fA-F]+|\d+)$"), list("-+0123456789")
)


def _construct_int(loader: _Loader, node: Any) -> int:
    text = loader.construct_scalar(node)
    return int(text, 16 if "x" in text else 10)


_Loader.add_constructor("tag:yaml.org,2002:int", _construct_int)


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


def check_value(value: Any, where: str) -> Any:
    """Check that a YAML value is one that parameters can hold.

    :raises ValueError: it is not; the message says where.
    """
    if isinstance(value, (bool, int, float, str)):
        if isinstance(value, int) and not isinstance(value, bool) and not -(2**63) <= value < 2**63:
            raise ValueError(f"{where}: {value} does not fit 64 bits")
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
    try:
        value = yaml.load(text, _Loader) if text else ""
    except yaml.YAMLError as error:
        raise ValueError(f"no YAML value: {error}") from error
    if value is None and text:
        raise ValueError("a parameter must have a value")
    return check_value(value, "value")


def flatten(tree: dict[Any, Any], where: str, prefix: str = "") -> dict[str, Any]:
    """Nested parameters as one dictionary with dotted names.

    :raises ValueError: a value cannot be a parameter's.
    """
    values: dict[str, Any] = {}
    for key, value in tree.items():
        name = f"{prefix}{key}"
        if isinstance(value, dict):
            values.update(flatten(value, where, name + "."))
        else:
            values[name] = check_value(value, f"{where}: {name}")
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
            tree = loader.construct_object(value, deep=True)
            if not isinstance(tree, dict):
                raise ValueError(f"{where}: ros__parameters must be a mapping")
            blocks.append(ParameterBlock(name, flatten(tree, where)))

    try:
        root = loader.get_single_node()
        if root is None:
            raise ValueError(f"{path}: the file is empty")
        walk(root, "")
    except yaml.YAMLError as error:
        raise ValueError(f"{path}: {error}") from error
    finally:
        loader.dispose()
    return blocks
