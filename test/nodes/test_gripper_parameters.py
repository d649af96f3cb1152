# SPDX-License-Identifier: Apache-2.0
"""Parameters of the coordinator, and the node as a process."""

import signal

import pytest
from ccr_msgs.msg import GripperState
from node_processes import end, failed_start, launcher
from rclpy.exceptions import ParameterException

from ccr_ros.model import CcrError
from ccr_ros.resources import config_dir


@pytest.fixture
def launch():
    """Return a function that starts a coordinator in a process; none is left behind."""
    yield from launcher("gripper_coordinator_node")


def test_every_parameter_is_described_and_fixed(start_coordinator, probe):
    node = start_coordinator()
    own = {p.name for p in node.get_parameters_by_prefix("").values()}
    own -= {p.name for p in probe.node.get_parameters_by_prefix("").values()}
    for descriptor in node.describe_parameters(sorted(own)):
        assert len(descriptor.description) > 20, descriptor.name
        assert descriptor.read_only, descriptor.name


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("close_speed", 0.0),
        ("max_force", -1.0),
        ("control_rate", 1e6),
        ("force_gain", "high"),
        ("finger_1__force_share", 0.0),
    ],
)
def test_out_of_range(start_coordinator, name, value):
    with pytest.raises(ParameterException, match=name.replace("__", ".")):
        start_coordinator(**{name: value})


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"gripper_file": "no_such"}, "gripper_sphere"),
        ({"default_force": 0.6}, "default_force: 0.6"),
        ({"finger_1__closed_pulls": [0.001, 0.002]}, "finger_1.closed_pulls.*2 pulls|got 2"),
        ({"finger_2__closed_pulls": [9.0]}, "finger_2.closed_pulls.main"),
        ({"finger_2__open_pulls": [float("nan")]}, "finger_2.open_pulls.main"),
        ({"finger_3__open_pulls": [0.006188]}, "finger_3.closed_pulls"),
    ],
)
def test_not_valid(start_coordinator, values, text):
    with pytest.raises(CcrError, match=text):
        start_coordinator(**values)


def test_a_finger_of_several_cables_wants_its_closed_pulls(start_coordinator, small_gripper):
    with pytest.raises(CcrError, match=r"thumb\.closed_pulls"):
        start_coordinator(gripper_file=small_gripper)
    node = start_coordinator(gripper_file=small_gripper, thumb__closed_pulls=[0.004, 0.003])
    assert list(node.get_parameter("thumb.open_pulls").value) == [0.0, 0.0]


@pytest.mark.processes
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM], ids=["SIGINT", "SIGTERM"])
def test_as_a_process(probe, launch, how):
    file = config_dir() / "nodes" / "gripper_sphere.yaml"
    process = launch("-r", "__ns:=/gripper", "--params-file", str(file))
    states = probe.listen(GripperState, "gripper_state")
    state = probe.until(lambda: states and states[-1], "the state")
    assert state.state == GripperState.IDLE
    assert "not known yet" in state.message
    assert [finger.finger for finger in state.fingers] == ["finger_1", "finger_2", "finger_3"]
    assert end(process, how) == 0


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("-p", "gripper_file:=no_such_gripper"), "gripper_sphere"),
        (("-p", "close_speed:=0.0"), "close_speed"),
        (("-p", "finger_1.closed_pulls:=[9.0]"), "finger_1.closed_pulls"),
    ],
)
def test_what_cannot_start_says_why_in_one_line(words, text):
    assert text in failed_start("gripper_coordinator_node", *words)
