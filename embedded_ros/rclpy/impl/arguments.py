# SPDX-License-Identifier: Apache-2.0
"""The ``--ros-args`` command line: remapping rules, parameters, log levels."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from .._rclpy_pybind11 import RCLInvalidROSArgsError, UnknownROSArgsError
from ..expand_topic_name import expand_topic_name
from ..logging import get_logger
from ..validate_node_name import is_valid_node_name
from .parameter_files import ParameterBlock, parse_value, read_parameter_file

_TOKEN = "[A-Za-z_{][A-Za-z0-9_{}]*"
_NODE_RULES = ("__node", "__name")
_FLAGS = {
    f"--{onoff}-{what}-logs": (what, onoff == "enable")
    for onoff in ("enable", "disable")
    for what in ("rosout", "stdout", "external-lib")
}


@dataclass(frozen=True)
class RemapRule:
    """``[node:]match:=replacement``; `kind` is node, namespace, topic, service or both."""

    kind: str
    node: str
    match: str
    replacement: str


@dataclass
class RosArguments:
    """What one command line asks for."""

    rules: list[RemapRule] = field(default_factory=list)
    blocks: list[ParameterBlock] = field(default_factory=list)
    log_levels: list[tuple[str, str]] = field(default_factory=list)
    logs: dict[str, bool] = field(default_factory=dict)


def _invalid(argument: str, reason: str) -> RCLInvalidROSArgsError:
    return RCLInvalidROSArgsError(f"Failed to parse ROS arguments: {argument!r}: {reason}")


def parse_remap(text: str) -> RemapRule:
    """Read one remapping rule.

    :raises RCLInvalidROSArgsError: it is none.
    """
    left, separator, replacement = text.partition(":=")
    if not separator or not left or not replacement:
        raise _invalid(text, "a remapping rule has the form [node:]from:=to")
    kind, node = "both", ""
    scheme = re.match(r"(rostopic|rosservice)://", left)
    if scheme:
        kind = "topic" if scheme[1] == "rostopic" else "service"
        left = left[scheme.end() :]
    elif ":" in left:
        node, _, left = left.partition(":")
        if not is_valid_node_name(node):
            raise _invalid(text, f"{node!r} is no node name")
    if left in _NODE_RULES:
        if not is_valid_node_name(replacement):
            raise _invalid(text, f"{replacement!r} is no node name")
        kind = "node"
    elif left == "__ns":
        if not re.fullmatch(r"/|(/[A-Za-z_][A-Za-z0-9_]*)+", replacement):
            raise _invalid(text, f"{replacement!r} is no absolute namespace")
        kind = "namespace"
    else:
        for name in (left, replacement):
            if not re.fullmatch(f"~|(~?/)?{_TOKEN}(/{_TOKEN})*", name):
                raise _invalid(text, f"{name!r} is no topic or service name")
    return RemapRule(kind, node, left, replacement)


def _parse_parameter(text: str) -> ParameterBlock:
    left, separator, value = text.partition(":=")
    if not separator or not left:
        raise _invalid(text, "a parameter has the form [node:]name:=value")
    node, colon, name = left.partition(":")
    if not colon:
        node, name = "/**", left
    elif not node.startswith("/"):
        node = "/**/" + node
    if re.search(r"\s", name):
        raise _invalid(text, f"{name!r} is no parameter name")
    try:
        return ParameterBlock(node, {name: parse_value(value)})
    except ValueError as error:
        raise _invalid(text, str(error)) from error


def parse_arguments(args: Sequence[str]) -> tuple[RosArguments, list[str]]:
    """Split a command line into what ROS is asked for and the other arguments, in their order.

    :raises RCLInvalidROSArgsError: a ROS argument has a bad value.
    :raises UnknownROSArgsError: a ROS argument is unknown.
    """
    result, others = RosArguments(), []
    inside = False
    index = 0
    while index < len(args):
        argument = args[index]
        index += 1
        if not isinstance(argument, str):
            raise TypeError(f"command line arguments must be str, found {argument!r}")
        argument.encode("utf-8")  # surrogates, from bytes that are no UTF-8, raise here
        if not inside:
            if argument == "--ros-args":
                inside = True
            elif not _apply_bare_rule(result, argument):
                others.append(argument)
            continue
        if argument == "--":
            inside = False
        elif argument == "--ros-args":
            continue
        elif argument in _FLAGS:
            what, value = _FLAGS[argument]
            result.logs[what] = value
        elif argument in _WITH_VALUE:
            if index >= len(args):
                raise _invalid(argument, "its value is missing")
            _apply(result, argument, args[index])
            index += 1
        else:
            raise UnknownROSArgsError(f"Found unknown ROS arguments: [{argument!r}]")
    return result, others


_WITH_VALUE = frozenset(
    [
        "-r",
        "--remap",
        "-p",
        "--param",
        "--params-file",
        "--log-level",
        "-e",
        "--enclave",
        "--log-config-file",
        "--log-file-name",
    ]
)


def _apply_bare_rule(result: RosArguments, argument: str) -> bool:
    """Take a remapping rule that stands outside of --ros-args, as ROS 2 used to have it."""
    try:
        result.rules.append(parse_remap(argument))
    except RCLInvalidROSArgsError:
        return False
    get_logger("rcl").warning(
        f"Found remap rule {argument!r}. This syntax is deprecated. "
        f"Use '--ros-args --remap {argument}' instead."
    )
    return True


def _apply(result: RosArguments, argument: str, value: str) -> None:
    if argument in ("-r", "--remap"):
        result.rules.append(parse_remap(value))
    elif argument in ("-p", "--param"):
        result.blocks.append(_parse_parameter(value))
    elif argument == "--params-file":
        try:
            result.blocks += read_parameter_file(value)
        except (OSError, ValueError) as error:
            raise _invalid(f"{argument} {value}", str(error)) from error
    elif argument == "--log-level":
        name, separator, level = value.rpartition(":=")
        if level.lower() not in ("unset", "debug", "info", "warn", "error", "fatal"):
            raise _invalid(f"{argument} {value}", "levels are debug, info, warn, error and fatal")
        result.log_levels.append((name if separator else "", level.upper()))


class NodeArguments:
    """The arguments that concern one node: its own first, then those of the process."""

    def __init__(self, sources: Sequence[RosArguments]) -> None:
        self.sources = list(sources)

    def _rules(self, kinds: tuple[str, ...], node: str) -> list[RemapRule]:
        return [
            rule
            for source in self.sources
            for rule in source.rules
            if rule.kind in kinds and rule.node in ("", node)
        ]

    def names(self, node: str, namespace: str) -> tuple[str, str]:
        """Node name and namespace after remapping."""
        name = next((rule.replacement for rule in self._rules(("node",), node)), node)
        space = next((rule.replacement for rule in self._rules(("namespace",), node)), namespace)
        return name, space

    def remap(self, full_name: str, node: str, namespace: str, service: bool = False) -> str:
        """The full topic or service name after remapping; the first rule that fits wins."""
        for rule in self._rules(("both", "service" if service else "topic"), node):
            if expand_topic_name(rule.match, node, namespace) == full_name:
                return expand_topic_name(rule.replacement, node, namespace)
        return full_name

    def parameters(self, full_node_name: str) -> dict[str, Any]:
        """Initial parameter values by name.

        As in rcl, what is said of one node pattern is gathered where the pattern first appeared,
        process arguments before the node's own, and a pattern that appeared later is stronger.
        So ``-p`` (the pattern ``/**``) after a file that holds ``/**`` does not beat what the file
        says of the node by name.
        """
        gathered: dict[str, ParameterBlock] = {}
        for source in reversed(self.sources):
            for block in source.blocks:
                known = gathered.setdefault(block.pattern, ParameterBlock(block.pattern, {}))
                known.values.update(block.values)
        values: dict[str, Any] = {}
        for block in gathered.values():
            if block.concerns(full_node_name):
                values.update(block.values)
        return values

    def logs(self, what: str) -> bool:
        """Whether a log output (rosout, stdout, external-lib) is on."""
        return next((s.logs[what] for s in self.sources if what in s.logs), True)
