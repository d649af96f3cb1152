# SPDX-License-Identifier: Apache-2.0
"""Console scripts of the nodes: make rclpy importable first, import and run the node only then."""

from __future__ import annotations

import os
import signal
import sys
from importlib import import_module

from ccr_ros.blas import use_one_thread

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


def end_on_signals() -> None:
    """Have a signal end the process at once and in peace, as long as it only loads libraries.

    Not by an exception: one within an import can lose the exit code.
    """
    for number in _SIGNALS:
        signal.signal(number, lambda *_: os._exit(0))


def solver_node() -> int:
    """Run the solver node; arguments are in ``sys.argv``. Returns the exit code."""
    return _run("solver_node", "SolverNode")


def servo_bridge_node() -> int:
    """Run the servo bridge; arguments are in ``sys.argv``. Returns the exit code."""
    return _run("servo_bridge_node", "ServoBridgeNode")


def gripper_coordinator_node() -> int:
    """Run the coordinator; arguments are in ``sys.argv``. Returns the exit code."""
    return _run("gripper_coordinator_node", "GripperCoordinatorNode")


def _run(module: str, node: str) -> int:
    """Run the node of a class in a module of this package; both are imported here."""
    end_on_signals()
    use_one_thread()
    from ccr_ros.model.errors import CcrError
    from ccr_ros.runtime import enable_ros

    try:
        enable_ros()
        make = getattr(import_module(f"ccr_ros.nodes.{module}"), node)
        from ccr_ros.nodes.runner import run

        for number in _SIGNALS:
            signal.signal(number, signal.default_int_handler)  # until rclpy.init brings its own
        return run(make, module)
    except KeyboardInterrupt:
        return 0
    except CcrError as error:
        print(f"{module}: error: {error}", file=sys.stderr)
        return 1
    finally:
        # A terminal and a launcher may both send one. Nothing is left to be ended, and Python,
        # while it ends, would let a late one have the process and its exit code.
        for number in _SIGNALS:
            signal.signal(number, signal.SIG_IGN)
