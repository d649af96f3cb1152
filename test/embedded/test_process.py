# SPDX-License-Identifier: Apache-2.0
"""How processes end, and how they find each other."""

import signal
import time

import pytest
from std_msgs.msg import String

import embedded_ros

EMBEDDED = embedded_ros.enable()
embedded_only = pytest.mark.skipif(not EMBEDDED, reason="a promise of the embedded runtime")


@pytest.mark.parametrize(
    ("number", "mode", "endings"),
    [
        (signal.SIGINT, "single", ("KeyboardInterrupt", "ExternalShutdownException")),
        (signal.SIGTERM, "single", ("ExternalShutdownException", "returned", "cut short")),
        (signal.SIGTERM, "multi", ("returned", "cut short")),
    ],
)
def test_signals_end_a_spinning_process_cleanly(program, number, mode, endings):
    talker = program("talker.py", mode)
    talker.wait_for_line("ready")
    talker.process.send_signal(number)
    code, out, err = talker.finish()
    assert code == 0, err
    assert any(f"ended: {how}" in out for how in endings), out
    assert "Traceback" not in err


def test_an_unknown_ros_argument_ends_the_process_with_a_message(program):
    code, _, err = program("talker.py", "--ros-args", "--bogus").finish()
    assert code != 0
    assert "--bogus" in err


@pytest.mark.processes
@pytest.mark.parametrize(
    "setting", [{"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}, {"ROS_LOCALHOST_ONLY": "1"}]
)
def test_loopback_settings_reach_each_other(node, spin, program, setting):
    program("talker.py", **setting)
    got = []
    node.create_subscription(String, "chatter", got.append, 10)
    assert spin(lambda: got, node)


@pytest.mark.processes
def test_discovery_switched_off_isolates_a_process(node, spin, program):
    hidden = program("talker.py", ROS_AUTOMATIC_DISCOVERY_RANGE="OFF")
    hidden.wait_for_line("ready")
    open_one = program("talker.py", "--ros-args", "-r", "__node:=open")
    got = []
    node.create_subscription(String, "chatter", got.append, 10)
    assert spin(lambda: "open" in node.get_node_names() and len(got) > 5, node)
    assert "talker" not in node.get_node_names()
    open_one.process.send_signal(signal.SIGINT)
    assert open_one.finish()[0] == 0


@embedded_only  # with real rclpy each of them hangs or dies with an error now and then
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("how", ["future", "message", "sleep", "service", "rate", "call"])
def test_signals_end_whatever_waits(program, how, number):
    waiting = program("waiting.py", how)
    waiting.wait_for_line("ready")
    waiting.process.send_signal(number)
    code, _, err = waiting.finish()
    assert code == 0, err
    assert "Traceback" not in err


@embedded_only  # real rclpy leaves a second signal to chance
@pytest.mark.parametrize("pause", [0.0, 0.03])
@pytest.mark.parametrize("numbers", [(signal.SIGINT,) * 2, (signal.SIGTERM, signal.SIGINT)])
def test_a_second_signal_while_ending_changes_nothing(program, numbers, pause):
    talker = program("talker.py")
    talker.wait_for_line("ready")
    for number in numbers:
        talker.process.send_signal(number)
        time.sleep(pause)
    code, _, err = talker.finish()
    assert code == 0, err
    assert "Traceback" not in err


@pytest.mark.processes
def test_a_killed_process_is_forgotten_and_can_come_back(node, spin, program):
    limit = 8 if EMBEDDED else 30  # s; real ROS 2 forgets after ten and more
    got = []
    node.create_subscription(String, "chatter", got.append, 10)
    for _ in range(2):
        talker = program("talker.py")
        seen = len(got)
        assert spin(lambda: "talker" in node.get_node_names() and len(got) > seen, node)  # noqa: B023
        talker.process.kill()
        assert spin(lambda: "talker" not in node.get_node_names(), node, limit=limit)
        assert node.count_publishers("chatter") == 0


@pytest.mark.processes
@pytest.mark.not_fast_dds("a lost participant is not back after 15 s")
def test_a_process_that_stood_still_comes_back(node, spin, program):
    got = []
    node.create_subscription(String, "chatter", got.append, 10)
    talker = program("talker.py")
    assert spin(lambda: got, node)
    talker.process.send_signal(signal.SIGSTOP)
    assert spin(lambda: "talker" not in node.get_node_names(), node)
    seen = len(got)
    talker.process.send_signal(signal.SIGCONT)
    assert spin(lambda: "talker" in node.get_node_names() and len(got) > seen, node)


NEGATIVE = pytest.param("-1", marks=embedded_only)  # real ROS 2 takes it for the default


@pytest.mark.parametrize("bad", ["abc", NEGATIVE, "233"])
def test_a_bad_domain_is_named(program, bad):
    code, _, err = program("talker.py", ROS_DOMAIN_ID=bad).finish()
    assert code != 0
    assert not EMBEDDED or f"ROS_DOMAIN_ID is '{bad}'" in err


@embedded_only  # real ROS 2 warns and takes LOCALHOST
def test_a_bad_discovery_range_is_named(program):
    code, _, err = program("talker.py", ROS_AUTOMATIC_DISCOVERY_RANGE="NEAR").finish()
    assert code != 0
    assert "ROS_AUTOMATIC_DISCOVERY_RANGE is 'NEAR'; it must be one of OFF, LOCALHOST" in err


@pytest.mark.processes
@pytest.mark.not_fast_dds("reads no CYCLONEDDS_URI")
def test_settings_the_middleware_refuses_end_init(program):
    code, _, err = program("talker.py", CYCLONEDDS_URI="file:///no/such/file.xml").finish()
    assert code != 0
    assert "no/such/file" in err
