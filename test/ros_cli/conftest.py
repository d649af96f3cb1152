# SPDX-License-Identifier: Apache-2.0
"""A node for the commands to look at, and ways to run them."""

import gc
import io
import subprocess
import sys
import threading
from collections import namedtuple
from pathlib import Path

import pytest
import rclpy
from rclpy.executors import MultiThreadedExecutor

from ccr_ros.cli.main import main

ROOT = Path(__file__).resolve().parents[2]
Done = namedtuple("Done", "code out err")


# Real rclpy on Fast DDS often finds nothing from the second participant of a process on, within
# the time that a command takes.
IN_THIS_PROCESS = "fastrtps" not in rclpy.get_rmw_implementation_identifier()


@pytest.fixture
def ccr(capsys):
    """Run a command, in this process if that works; gives exit code, output and errors."""

    def run(*words):
        if not IN_THIS_PROCESS:
            given = sys.stdin.getvalue() if isinstance(sys.stdin, io.StringIO) else ""
            command = [sys.executable, "-m", "ccr_ros.cli", *words]
            done = subprocess.run(
                command, input=given, capture_output=True, text=True, cwd=ROOT, check=False
            )
            return Done(done.returncode, done.stdout, done.stderr)
        capsys.readouterr()
        try:
            code = main(list(words))
        except SystemExit as end:
            code = end.code
        return Done(code, *capsys.readouterr())

    return run


@pytest.fixture
def make_peer():
    """Make nodes that run in a thread until the test ends."""
    gc.collect()  # before that, rclpy leaves lifecycle nodes of other tests in the graph
    context = rclpy.Context()
    rclpy.init(args=[], context=context)
    executor = MultiThreadedExecutor(4, context=context)
    nodes, stopping = [], threading.Event()

    def make(name, kind=rclpy.create_node, **options):
        node = kind(name, context=context, **options)
        executor.add_node(node)
        nodes.append(node)
        return node

    def spin():
        while not stopping.is_set():
            executor.spin_once(timeout_sec=0.1)

    thread = threading.Thread(target=spin)
    thread.start()
    yield make
    stopping.set()
    thread.join()
    executor.shutdown()
    for node in nodes:
        node.destroy_node()
    context.try_shutdown()


@pytest.fixture
def peer(make_peer):
    """One such node: /ns/peer."""
    return make_peer("peer", namespace="/ns")


@pytest.fixture
def start_ccr():
    """Start a command as a process of its own, which is killed with the test."""
    started = []

    def start(*words, **options):
        options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, **options}
        command = [sys.executable, "-P", "-m", "ccr_ros.cli", *words]
        started.append(subprocess.Popen(command, cwd=ROOT, **options))
        return started[-1]

    yield start
    for process in started:
        process.kill()
        process.communicate()
