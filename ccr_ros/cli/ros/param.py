# SPDX-License-Identifier: Apache-2.0
"""Look at the parameters of nodes, and change them, as `ros2 param` does.

  ccr param list /solver_node
  ccr param set /solver_node rate 50.0
  ccr param dump /solver_node > solver.yaml

`ccr param VERB --help` tells more.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import yaml

from ccr_ros.cli.ros.graph import find_node, graph_node, node_names, unknown
from ccr_ros.cli.ros.types import read_yaml
from ccr_ros.cli.ros.verbs import Run, Verbs, positive_float
from ccr_ros.cli.ros.verbs import run_verb as run
from ccr_ros.model.errors import CcrError, InvalidFile, InvalidValue

__all__ = ["add_arguments", "run"]

EXIT_REFUSED = 1
_ANSWER_LIMIT = 5.0  # s; nodes answer in milliseconds while they spin
_ALLOWED = "a boolean, number or string, or a list of one of these"

#: ParameterType: its word in lists, and what ``get`` prints before the value
_TYPES = (
    ("not set", "Parameter not set."),
    ("boolean", "Boolean value is:"),
    ("integer", "Integer value is:"),
    ("double", "Double value is:"),
    ("string", "String value is:"),
    ("byte array", "Byte values are:"),
    ("boolean array", "Boolean values are:"),
    ("integer array", "Integer values are:"),
    ("double array", "Double values are:"),
    ("string array", "String values are:"),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verbs and their arguments."""
    verbs = Verbs(parser)
    one = verbs.add("list", run_list, "list the parameters of one node or of all")
    one.add_argument("node_name", nargs="?", help="full name of the node; default: all nodes")
    one.add_argument("--include-hidden-nodes", action="store_true", help="of hidden nodes as well")
    one.add_argument("--filter", metavar="REGEX", help="only those whose name matches")
    one.add_argument(
        "--param-prefixes", nargs="+", default=[], metavar="PREFIX", help="only those below these"
    )
    one.add_argument("--param-type", action="store_true", help="with their types")

    one = _add(verbs, "get", run_get, "print the value of a parameter")
    one.add_argument("parameter_name", help="name of the parameter")
    one.add_argument("--hide-type", action="store_true", help="print the value alone")

    one = _add(verbs, "set", run_set, "set a parameter (exit code 1 if the node refuses)")
    one.add_argument("parameter_name", help="name of the parameter")
    one.add_argument("value", help="its new value, as YAML")

    one = _add(verbs, "describe", run_describe, "tell what parameters are for, and their limits")
    one.add_argument("parameter_names", nargs="+", help="names of parameters")

    _add(verbs, "dump", run_dump, "print all parameters of a node as a parameter file")

    one = _add(verbs, "load", run_load, "set the parameters of a parameter file")
    one.add_argument("parameter_file", help="YAML file")
    one.add_argument("--no-use-wildcard", action="store_true", help="without those of '/**'")

    one = _add(verbs, "delete", run_delete, "delete a parameter")
    one.add_argument("parameter_name", help="name of the parameter")


def _add(verbs: Verbs, name: str, do: Run, summary: str) -> argparse.ArgumentParser:
    one = verbs.add(name, do, summary)
    one.add_argument("node_name", help="full name of the node, as /talker")
    # Hidden nodes are found by their names anyway; scripts written for ros2 may say it.
    one.add_argument("--include-hidden-nodes", action="store_true", help=argparse.SUPPRESS)
    one.add_argument(
        "--timeout",
        metavar="N",
        type=positive_float,
        default=1.0,
        help="seconds to wait for the node to come up (default: 1)",
    )
    return one


class _Parameters:
    """The parameter services of one node."""

    def __init__(self, node: Any, name: str) -> None:
        from rclpy.parameter_client import AsyncParameterClient

        self.name = name
        self._node = node
        self._client = AsyncParameterClient(node, name)
        if not self._client.wait_for_services(timeout_sec=_ANSWER_LIMIT):
            raise CcrError(f"node {name!r} has no parameter services")

    def _call(self, method: str, *args: Any) -> Any:
        import rclpy

        future = getattr(self._client, method)(*args)
        rclpy.spin_until_future_complete(self._node, future, timeout_sec=_ANSWER_LIMIT)
        if not future.done():
            raise CcrError(f"node {self.name!r} does not answer; does it spin?")
        return future.result()

    def names(self, prefixes: list[str] | None = None) -> list[str]:
        return sorted(self._call("list_parameters", prefixes or []).result.names)

    def values(self, names: list[str]) -> list[Any]:
        return self._call("get_parameters", names).values if names else []

    def descriptors(self, names: list[str]) -> list[Any]:
        return self._call("describe_parameters", names).descriptors if names else []

    def set(self, parameters: list[Any]) -> list[Any]:
        return self._call("set_parameters", parameters).results

    def unknown(self, name: str) -> CcrError:
        return unknown("parameter", name, self.names(), f" of node {self.name!r}")

    def require(self, names: list[str]) -> None:
        known = self.names()
        for name in names:
            if name not in known:
                raise self.unknown(name)


def _on_node(args: argparse.Namespace, do: Callable[[_Parameters], int | None]) -> int:
    with graph_node(args, settle=False) as node:
        return do(_Parameters(node, find_node(node, args.node_name, args.timeout))) or 0


def run_list(args: argparse.Namespace) -> None:
    """Print the names of parameters."""
    try:
        matches = re.compile(args.filter or "").match
    except re.error as error:
        raise CcrError(f"--filter {args.filter!r} is no regular expression: {error}") from error
    with graph_node(args) as node:
        if args.node_name:
            nodes = [find_node(node, args.node_name)]
        else:
            serving = dict(node.get_service_names_and_types())
            nodes = [
                name
                for name in dict.fromkeys(node_names(node, args.include_hidden_nodes))
                if f"{name}/list_parameters" in serving
            ]
        for name in nodes:
            try:
                _print_names(_Parameters(node, name), args, matches)
            except CcrError as error:
                if args.node_name:
                    raise
                print(f"ccr: warning: {error}", file=sys.stderr)


def _print_names(
    parameters: _Parameters, args: argparse.Namespace, matches: Callable[[str], object]
) -> None:
    names = [name for name in parameters.names(args.param_prefixes) if matches(name)]
    if names and not args.node_name:
        print(f"{parameters.name}:")
    types = {}
    if args.param_type:
        types = {one.name: _TYPES[one.type][0] for one in parameters.descriptors(names)}
    for name in names:
        print(f"  {name} (type: {types[name]})" if args.param_type else f"  {name}")


def run_get(args: argparse.Namespace) -> int:
    """Print the value of a parameter."""

    def get(parameters: _Parameters) -> None:
        from rclpy.parameter import parameter_value_to_python

        values = parameters.values([args.parameter_name])
        if not values:
            parameters.require([args.parameter_name])
        label = _TYPES[values[0].type if values else 0][1]
        value = parameter_value_to_python(values[0]) if values else None
        if args.hide_type:
            print(value)
        else:
            print(label if value is None else f"{label} {value}")

    return _on_node(args, get)


def run_set(args: argparse.Namespace) -> int:
    """Set a parameter."""
    if isinstance(read_yaml(args.value), dict):
        raise InvalidValue("value", args.value, _ALLOWED)

    def put(parameters: _Parameters) -> int:
        from rcl_interfaces.msg import Parameter
        from rclpy.parameter import get_parameter_value

        try:
            value = get_parameter_value(args.value)
        except Exception as error:  # what is raised differs from value to value
            raise InvalidValue("value", args.value, _ALLOWED) from error
        (result,) = parameters.set([Parameter(name=args.parameter_name, value=value)])
        return _tell("Set parameter successful", "Setting parameter failed", result)

    return _on_node(args, put)


def _tell(success: str, failure: str, result: Any) -> int:
    """Print the result of setting a parameter; return the exit code."""
    reason = f": {result.reason}" if result.reason else ""
    if result.successful:
        print(f"{success}{reason}")
        return 0
    print(f"{failure}{reason}", file=sys.stderr)
    return EXIT_REFUSED


def run_delete(args: argparse.Namespace) -> int:
    """Delete a parameter."""

    def delete(parameters: _Parameters) -> int:
        from rcl_interfaces.msg import Parameter

        parameters.require([args.parameter_name])
        (result,) = parameters.set([Parameter(name=args.parameter_name)])
        return _tell("Deleted parameter successfully", "Deleting parameter failed", result)

    return _on_node(args, delete)


def run_describe(args: argparse.Namespace) -> int:
    """Print descriptors of parameters."""

    def describe(parameters: _Parameters) -> None:
        parameters.require(args.parameter_names)
        for one in parameters.descriptors(args.parameter_names):
            print(f"Parameter name: {one.name}")
            print(f"  Type: {_TYPES[one.type][0]}")
            if one.description:
                print(f"  Description: {one.description}")
            print("  Constraints:")
            if one.read_only:
                print("    Read only: true")
            for limits in [*one.floating_point_range, *one.integer_range]:
                print(f"    Min value: {limits.from_value}")
                print(f"    Max value: {limits.to_value}")
                if limits.step:
                    print(f"    Step: {limits.step}")
            if one.additional_constraints:
                print(f"    Additional constraints: {one.additional_constraints}")

    return _on_node(args, describe)


def run_dump(args: argparse.Namespace) -> int:
    """Print all parameters of a node as a parameter file."""

    def dump(parameters: _Parameters) -> None:
        from rclpy.parameter import parameter_value_to_python

        names = parameters.names()
        tree: dict[str, Any] = {}
        for name, value in zip(names, parameters.values(names), strict=True):
            *groups, last = name.split(".")
            branch = tree
            for group in groups:
                branch = branch.setdefault(group, {})
            branch[last] = parameter_value_to_python(value)
        whole = {parameters.name: {"ros__parameters": tree}}
        print(yaml.dump(whole, default_flow_style=False))

    return _on_node(args, dump)


def run_load(args: argparse.Namespace) -> int:
    """Set the parameters of a file."""
    path = Path(args.parameter_file)
    try:
        read_yaml(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidFile(path, getattr(error, "strerror", None) or str(error)) from error

    def load(parameters: _Parameters) -> int:
        from rclpy.parameter import parameter_dict_from_yaml_file

        try:
            found = parameter_dict_from_yaml_file(str(path), not args.no_use_wildcard)
        except (RuntimeError, TypeError, ValueError, AttributeError) as error:
            raise InvalidFile(path, str(error)) from error
        results = parameters.set(list(found.values()))
        codes = [
            _tell(f"Set parameter {name} successful", f"Set parameter {name} failed", result)
            for name, result in zip(found, results, strict=True)
        ]
        return max(codes, default=0)

    return _on_node(args, load)
