# SPDX-License-Identifier: Apache-2.0
"""Nodes in processes of their own: started as their console scripts are, none left behind."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
WAIT = 90.0  # s; never reached when all is well


def command(node: str, *ros_args: str, script: str | None = None) -> list[str]:
    run = f"import sys; from ccr_ros.nodes.entry import {node}; sys.exit({node}())"
    return [sys.executable, "-c", script or run, "--ros-args", *ros_args]


def environment() -> dict[str, str]:
    paths = [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}


def launcher(node: str) -> Iterator[Callable[..., subprocess.Popen]]:
    """For a fixture: yields a function that starts the node (or a script instead of it)."""
    running = []

    def launch(*ros_args: str, script: str | None = None) -> subprocess.Popen:
        process = subprocess.Popen(
            command(node, *ros_args, script=script),
            env=environment(),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        running.append(process)
        return process

    yield launch
    for process in running:
        if process.poll() is None:
            process.kill()
        process.communicate()


def end(process: subprocess.Popen, how: int) -> int:
    """End a node by a signal; return its exit code."""
    process.send_signal(how)
    _, errors = process.communicate(timeout=WAIT)
    assert "Traceback" not in errors, errors
    return process.returncode


def failed_start(node: str, *ros_args: str) -> str:
    """Start a node that cannot start; return the one line that says why."""
    done = subprocess.run(
        command(node, *ros_args),
        env=environment(),
        capture_output=True,
        text=True,
        timeout=WAIT,
        check=False,
    )
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    *before, line = done.stderr.strip().splitlines()
    # Nodes and real ROS log of their own, and the transport within one process says what it is.
    own = ("[rcl]", "embedded_ros: ", f".{node}]: ", f"[{node}]: ")
    assert all(any(mark in one for mark in own) for one in before)
    assert line.startswith(f"{node}: error: ")
    return line
