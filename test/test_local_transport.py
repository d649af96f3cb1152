# SPDX-License-Identifier: Apache-2.0
"""Machines without cyclonedds: the transport that is chosen, what it says, and nodes on it."""

import os
import signal
import subprocess
import sys
from importlib.metadata import distribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from ccr_ros.runtime import real_ros
from embedded_ros import transport

pytestmark = pytest.mark.skipif(real_ros(), reason="ROS 2 has transports of its own")

ROOT = Path(__file__).resolve().parents[1]
WAIT = 60.0  # s; never reached when all is well

HIDE = """
import sys

class Hidden:
    @staticmethod
    def find_spec(name, path=None, target=None):
        if name.partition(".")[0] == "cyclonedds":
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Hidden)
"""

TWO_NODES = """
from ccr_ros.runtime import enable_ros
enable_ros()
import rclpy
from std_msgs.msg import String

rclpy.init()
one, two = rclpy.create_node("one"), rclpy.create_node("two")
publisher = one.create_publisher(String, "words", 10)
heard = []
two.create_subscription(String, "words", heard.append, 10)
publisher.publish(String(data="hello"))
rclpy.spin_once(two)
print(heard[0].data, rclpy.get_rmw_implementation_identifier())
rclpy.shutdown()
"""


@pytest.fixture
def environment(tmp_path):
    """Return a function that makes the environment of a process, with cyclonedds hidden or not."""

    def make(transport="", hidden=False):
        paths = [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
        if hidden:
            (tmp_path / "sitecustomize.py").write_text(HIDE)
            paths.insert(0, str(tmp_path))
        env = {name: value for name, value in os.environ.items() if "XDIST" not in name}
        return {**env, "PYTHONPATH": os.pathsep.join(paths), "EMBEDDED_ROS_TRANSPORT": transport}

    return make


def run(*command, **options):
    return subprocess.run(
        [sys.executable, *command], capture_output=True, text=True, timeout=WAIT, **options
    )


def test_without_cyclonedds_nodes_of_one_process_talk_and_it_is_said(environment):
    done = run("-c", TWO_NODES, env=environment(hidden=True))
    assert done.stdout == "hello embedded_local\n", done.stderr
    (line,) = done.stderr.splitlines()
    assert line.startswith("embedded_ros: nodes reach each other within this process only, as ")
    assert "cyclonedds" in line


def test_the_in_process_transport_can_be_asked_for(environment):
    done = run("-c", TWO_NODES, env=environment("local"))
    assert done.stdout == "hello embedded_local\n", done.stderr
    (line,) = done.stderr.splitlines()
    assert line.endswith("as EMBEDDED_ROS_TRANSPORT is 'local'")


@pytest.mark.parametrize(
    ("transport", "hidden", "words"),
    [
        ("udp", False, "EMBEDDED_ROS_TRANSPORT is 'udp'; it must be one of cyclone, local"),
        ("cyclone", True, "EMBEDDED_ROS_TRANSPORT is 'cyclone', but "),
    ],
)
@pytest.mark.parametrize("command", [("run", "solver_node"), ("demo",)])
def test_a_transport_that_is_not_there_is_refused_in_one_line(
    environment, tmp_path, transport, hidden, words, command
):
    env = environment(transport, hidden)
    done = run("-P", "-m", "ccr_ros.cli", *command, env=env, cwd=tmp_path)
    assert done.returncode in (1, 2)
    (line,) = done.stderr.splitlines()
    assert "error: " + words in line


@pytest.mark.parametrize(
    ("version", "machine", "system", "has_wheel"),
    [
        ("3.11", "x86_64", "linux", True),
        ("3.13", "arm64", "darwin", True),
        ("3.13", "AMD64", "win32", True),
        ("3.12", "aarch64", "linux", False),
        ("3.12", "ARM64", "win32", False),
        ("3.14", "x86_64", "linux", False),
        ("3.14", "arm64", "darwin", False),
    ],
)
def test_cyclonedds_is_asked_for_where_it_has_a_wheel(
    monkeypatch, version, machine, system, has_wheel
):
    requirements = map(Requirement, distribution("ccr_ros").requires or [])
    (cyclone,) = (one for one in requirements if one.name == "cyclonedds")
    cpython = {"platform_python_implementation": "CPython", "extra": "embedded"}
    machine_ = {"python_version": version, "platform_machine": machine, "sys_platform": system}
    assert cyclone.marker.evaluate({**cpython, **machine_}) is has_wheel
    assert cyclone.specifier == Requirement(transport.CYCLONE_REQUIREMENT).specifier

    monkeypatch.setattr(transport.sys, "platform", system)
    monkeypatch.setattr(transport.platform, "machine", lambda: machine)
    monkeypatch.setattr(transport.platform, "python_version_tuple", lambda: version.split("."))
    advice = transport._how_to_get_cyclone()
    assert ("-m pip install 'cyclonedds" in advice) is has_wheel
    assert (f"no wheel of cyclonedds for CPython {version} on" in advice) is not has_wheel


def test_a_node_runs_alone_and_ends_well(environment):
    command = [sys.executable, "-P", "-m", "ccr_ros.cli", "run", "solver_node"]
    with subprocess.Popen(
        command, env=environment("local"), stderr=subprocess.PIPE, text=True
    ) as process:
        lines = []
        for line in process.stderr:
            lines.append(line)
            if "gripper" in line:
                break
        process.send_signal(signal.SIGINT)
        lines += process.stderr.read().splitlines()
    assert process.returncode == 0, lines
    assert lines[0].startswith("embedded_ros: nodes reach each other within this process only")


@pytest.mark.long
@pytest.mark.timeout(600)
@pytest.mark.parametrize(
    ("folder", "chosen"),
    [
        ("embedded", "not internal"),
        # What is said and heard; what fingers do does not depend on what carries it.
        (
            "nodes",
            "test_solver_node or test_solver_process or test_servo_lifecycle"
            " or test_grasp_hold_and_timed_release",
        ),
        ("ros_cli", "test_cli_node_service or test_cli_param or test_cli_topic_pub"),
    ],
)
def test_the_same_tests_hold_within_one_process(environment, folder, chosen):
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-m", "not long"]
    done = subprocess.run(
        [*command, "-k", chosen, f"test/{folder}"],
        env=environment("local"),
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout[-5000:] + done.stderr[-1000:]
    assert "nodes of other processes are not reached" in done.stdout  # and so it was the right one
