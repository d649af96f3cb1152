# SPDX-License-Identifier: Apache-2.0
"""The servo bridge as a process of its own: it ends in peace, dies, and finds its place again."""

import signal

import pytest
from ccr_msgs.msg import ServoState
from node_processes import WAIT, end, failed_start, launcher

SPRING = ("-p", "loopback.spring:=400.0")


@pytest.fixture
def launch():
    """Return a function that starts a servo bridge in a process; none is left behind."""
    yield from launcher("servo_bridge_node")


def arguments(tmp_path):
    state, zeros = tmp_path / "rack.yaml", tmp_path / "zeros.yaml"
    files = ("-p", f"loopback.state_file:={state}", "-p", f"calibration_file:={zeros}")
    return ("-r", "__ns:=/gripper", *SPRING, *files)


def held(servos):
    """Return the pull once the bridge leads, and a second message has told the same."""
    servos.states.clear()
    servos.in_state(ServoState.ACTIVE)
    return servos.joint("finger_1_main").pull


@pytest.mark.long
@pytest.mark.processes
def test_however_it_ends_the_servos_hold_and_are_found_again(servos, launch, tmp_path):
    pull = 0.0
    for how, code in (
        (signal.SIGKILL, -signal.SIGKILL),
        (signal.SIGINT, 0),
        (signal.SIGTERM, 0),
    ):
        process = launch(*arguments(tmp_path))
        assert held(servos) == pytest.approx(pull, abs=2e-4)
        assert servos.joint("finger_1_main").tension == pytest.approx(400 * pull, abs=0.1)
        assert servos.still("finger_1") < 2e-4
        pull += 0.003
        servos.lead_to("finger_1", pull)  # and it is led on from there
        assert end(process, how) == code
    launch(*arguments(tmp_path))
    assert held(servos) == pytest.approx(pull, abs=2e-4)


def test_ends_well_in_the_middle_of_a_cycle(launch, tmp_path):
    interrupted = """
import os, signal, sys, time
from ccr_ros.runtime import enable_ros
enable_ros()
from ccr_ros.actuation.bridge import ServoBridge
cycle, cycles = ServoBridge.cycle, []
def interrupted(*args):
    cycles.append(1)
    if len(cycles) == 5:
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(0.5)  # rclpy answers signals in a thread of its own
    return cycle(*args)
ServoBridge.cycle = interrupted
from ccr_ros.nodes.entry import servo_bridge_node
sys.exit(servo_bridge_node())
"""
    process = launch(*arguments(tmp_path), script=interrupted)
    _, errors = process.communicate(timeout=WAIT)
    assert "Traceback" not in errors
    assert process.returncode == 0
    assert (tmp_path / "rack.yaml").exists()


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_a_rack_that_is_never_heard_of_does_not_keep_it(launch, tmp_path, how):
    process = launch(*arguments(tmp_path), "-p", "driver:=ros2_control", "-p", "rate:=200.0")
    line = ""
    while "to be calibrated" not in line:  # it is configured, and waits for joint states
        line = process.stderr.readline()
        assert line, "the node ended"
    assert end(process, how) == 0


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("-p", "servo_file:=no_such_file"), "servos_sphere"),
        (("-p", "rate:=0.0"), "rate"),
        (("-p", "driver:=dynamixel", "-p", "dynamixel.port:=/dev/no_such"), "/dev/no_such"),
        (("-p", "calibration_file:=/dev/null"), "is empty"),
    ],
)
def test_what_cannot_start_says_why_in_one_line(words, text, monkeypatch, tmp_path):
    monkeypatch.setenv("ROS_HOME", str(tmp_path))
    assert text in failed_start("servo_bridge_node", *words)
