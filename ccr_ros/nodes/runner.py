# SPDX-License-Identifier: Apache-2.0
"""Runs one node in this process, from its making to its end in peace."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.exceptions import ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from ccr_ros.model import CcrError

NodeFactory = Callable[..., Node]
"""Makes a node from the options of `rclpy.node.Node`; a CcrError says why it cannot start."""


def run(make: NodeFactory, name: str, args: Sequence[str] | None = None) -> int:
    """Run a node until it is interrupted; return the exit code.

    Args:
        make: The node's class.
        name: What the message begins with that says why it cannot start.
        args: Command line with ROS arguments (default: ``sys.argv``).
    """
    try:
        try:
            rclpy.init(args=args)
        except Exception as error:  # bad --ros-args: rclpy has many kinds of error for them
            return _cannot_start(name, error)
        try:
            spin(make)
        except (CcrError, ParameterException) as error:
            return _cannot_start(name, error)
        return 0
    except KeyboardInterrupt:
        return 0
    finally:
        _shut_down()


def spin(make: NodeFactory, context: Context | None = None) -> None:
    """Run a node in a context (default: rclpy's own) until this ends.

    A node that has a method ``end`` is told when it has ended, by a signal or an error.

    Raises:
        CcrError, rclpy.exceptions.ParameterException: The node cannot start.
    """
    executor = None if context is None else SingleThreadedExecutor(context=context)
    node: Any = None
    try:
        node = make(context=context)
        rclpy.spin(node, executor)
    except (CcrError, ParameterException):
        raise
    except Exception:  # among them ExternalShutdownException
        # A signal takes the context down at once, and what is publishing just then fails.
        if rclpy.ok(context=context):
            raise
    finally:
        end = getattr(node, "end", None)
        if end is not None:
            end()
        # Here and now: what is left to the interpreter's end may outlive the middleware, which
        # then crashes (Fast DDS did so now and then).
        if node is not None:
            with suppress(Exception):  # the context may be down, or going down
                node.destroy_node()


def _shut_down() -> None:
    try:
        rclpy.try_shutdown()
    except Exception:
        # rclpy answers signals in a thread of its own, which may have come first by a hair.
        if rclpy.ok():
            raise


def _cannot_start(name: str, error: Exception) -> int:
    print(f"{name}: error: {' '.join(str(error).split())}", file=sys.stderr)
    return 1
