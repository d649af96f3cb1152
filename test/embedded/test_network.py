# SPDX-License-Identifier: Apache-2.0
"""Which machines and processes see each other, shown in network namespaces of the kernel."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from ccr_ros.stack.environment import free_domain

pytestmark = pytest.mark.processes
ROOT = Path(__file__).parents[2]
TALKER, LISTENER = (
    Path(__file__).parent / "programs" / f"{name}.py" for name in ("talker", "listener")
)
LONG, SHORT = "60", "2"  # s; how long a message is waited for, or not expected

# A talker in the background and a listener beside it, where there is nothing but a loopback.
ALONE = 'ip link set lo up && { "$0" "$1" >/dev/null & talker=$!; "$0" "$2" "$3"; kill $talker; }'


def run(*command, **environment):
    """Run a command and return what it printed."""
    path = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
    environment = {**os.environ, "PYTHONPATH": path, **environment}
    done = subprocess.run(
        list(map(str, command)), capture_output=True, text=True, env=environment, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def allowed(*command):
    """Whether a command is there and this user may run it."""
    if shutil.which(command[0]) is None or shutil.which("ip") is None:
        return False
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


@pytest.mark.parametrize("discovery", ["", "LOCALHOST", "SUBNET", "SYSTEM_DEFAULT"])
def test_a_machine_with_nothing_but_a_loopback(discovery):
    if not allowed("unshare", "-rn", "ip", "link", "set", "lo", "up"):
        pytest.skip("no network namespaces here (unshare -rn, ip)")
    command = ["unshare", "-rn", "sh", "-c", ALONE, sys.executable, TALKER, LISTENER, LONG]
    heard, *nodes = run(*command, ROS_AUTOMATIC_DISCOVERY_RANGE=discovery)
    assert heard == "heard"
    assert "talker" in nodes


@pytest.fixture(scope="module")
def hosts():
    """Commands that run a program on one of two machines, 10.77.0.1 and 10.77.0.2."""
    names = [f"ccr{os.getpid()}{letter}" for letter in "ab"]
    if not allowed("ip", "netns", "add", names[0]):
        pytest.skip("making network namespaces needs iproute2 and root")
    run("ip", "netns", "add", names[1])
    run("ip", "link", "add", names[0], "type", "veth", "peer", "name", names[1])
    for number, name in enumerate(names, 1):
        run("ip", "link", "set", name, "netns", name)
        run("ip", "-n", name, "addr", "add", f"10.77.0.{number}/24", "dev", name)
        run("ip", "-n", name, "link", "set", name, "up")
        run("ip", "-n", name, "link", "set", "lo", "up")
    yield [["ip", "netns", "exec", name] for name in names]
    for name in names:
        run("ip", "netns", "del", name)


@pytest.mark.long
@pytest.mark.parametrize(
    ("talking", "listening", "expected"),
    [
        ("SUBNET", {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, "heard"),
        ("LOCALHOST", {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}, "silence"),
        ("LOCALHOST", {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, "silence"),
        ("SUBNET", {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}, "silence"),
        ("SUBNET", {"ROS_LOCALHOST_ONLY": "1", "ROS_STATIC_PEERS": "10.77.0.1"}, "silence"),
        (
            "SUBNET",
            {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_STATIC_PEERS": "10.77.0.1"},
            "heard",
        ),
    ],
)
def test_two_machines(hosts, program, talking, listening, expected):
    talker = program("talker.py", prefix=hosts[0], ROS_AUTOMATIC_DISCOVERY_RANGE=talking)
    talker.wait_for_line("ready")
    limit = LONG if expected == "heard" else SHORT
    assert run(*hosts[1], sys.executable, LISTENER, limit, **listening)[0] == expected


@pytest.mark.parametrize(
    ("talking", "listening", "expected"),
    [
        ("LOCALHOST", "SUBNET", "heard"),
        ("SUBNET", "LOCALHOST", "heard"),
        ("OFF", "SUBNET", "silence"),
        ("SUBNET", "OFF", "silence"),
    ],
)
def test_ranges_on_one_machine(program, talking, listening, expected):
    talker = program("talker.py", ROS_AUTOMATIC_DISCOVERY_RANGE=talking)
    talker.wait_for_line("ready")
    limit = LONG if expected == "heard" else SHORT
    command = [sys.executable, LISTENER, limit]
    assert run(*command, ROS_AUTOMATIC_DISCOVERY_RANGE=listening)[0] == expected


def test_domains_are_apart(program):
    program("talker.py").wait_for_line("ready")
    other = str(free_domain())  # one that no other tests of this machine are in
    assert run(sys.executable, LISTENER, SHORT, ROS_DOMAIN_ID=other) == ["silence", "listener"]
