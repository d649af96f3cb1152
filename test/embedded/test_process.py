# SPDX-License-Identifier: Apache-2.0
"""How processes end, and how they find each other."""

import signal

import pytest
from std_msgs.msg import String


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
