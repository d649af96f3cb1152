# SPDX-License-Identifier: Apache-2.0
"""Run a node, as `ros2 run ccr_ros NODE` does, with or without ROS 2.

Everything after NODE goes to the node: `ccr run solver_node --ros-args -p name:=value`.
"""

from __future__ import annotations

import argparse
import sys
from importlib.metadata import EntryPoint, PackageNotFoundError, distribution

from ccr_ros.model.errors import CcrError, UnknownName

OWN_FLAGS: tuple[str, ...] = ()
NODES_MODULE = "ccr_ros.nodes."


def node_entry_points() -> dict[str, EntryPoint]:
    """Return the console-script entry points that are nodes, by name.

    Raises:
        CcrError: the package is not installed, so that its entry points are not known.
    """
    try:
        scripts = distribution("ccr_ros").entry_points.select(group="console_scripts")
    except PackageNotFoundError:
        raise CcrError("ccr_ros is not installed; use ./ccr, or pip install -e .") from None
    return {entry.name: entry for entry in scripts if entry.value.startswith(NODES_MODULE)}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments; what follows NODE is not parsed here."""
    parser.usage = "ccr run [-h] NODE [ARG ...]"
    parser.epilog = f"nodes: {', '.join(sorted(node_entry_points()))}"


def run(args: argparse.Namespace) -> int:
    """Run the node in this process and return its exit code."""
    nodes = node_entry_points()
    if not args.rest:
        args.usage_error(f"which node? valid: {', '.join(sorted(nodes))}")
    name, *node_args = args.rest
    if name not in nodes:
        raise UnknownName("node", name, sorted(nodes))
    sys.argv = [name, *node_args]
    result = nodes[name].load()()
    return result if isinstance(result, int) else 0
