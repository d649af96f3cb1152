# SPDX-License-Identifier: Apache-2.0
"""The ecosystem's own gripper action, where control_msgs is there."""

from pathlib import Path

import pytest
from action_msgs.msg import GoalStatus
from gripper_stack import BALL, Goal
from rclpy.action import ActionClient

from ccr_ros.runtime import real_ros

if not real_ros():
    import embedded_ros

    embedded_ros.enable([Path(__file__).parent / "interfaces"])

GripperCommand = pytest.importorskip("control_msgs.action").GripperCommand


@pytest.fixture
def command(stack):
    """Return a function that sends a command, and the nodes of a gripper."""
    stack = stack().ready()
    client = ActionClient(stack.probe.node, GripperCommand, "gripper_cmd")
    stack.probe.until(client.server_is_ready, "gripper_cmd")

    def send(position, max_effort=0.0):
        goal = GripperCommand.Goal()
        goal.command.position, goal.command.max_effort = position, max_effort
        return Goal(stack, client, goal)

    return stack, send


def test_to_a_position_and_back(command):
    stack, send = command
    goal = send(0.07)
    result = goal.result()
    assert goal.status == GoalStatus.STATUS_SUCCEEDED
    assert (result.reached_goal, result.stalled) == (True, False)
    assert result.position == pytest.approx(0.07, abs=0.005)
    assert stack.now.state == "ready"
    result = send(0.08).result()
    assert result.reached_goal
    assert result.position == pytest.approx(0.08, abs=0.005)


@pytest.mark.long
def test_on_an_object_with_an_effort(command):
    stack, send = command
    stack.show(BALL)
    goal = send(0.0, 0.2)
    result = goal.result()
    assert goal.status == GoalStatus.STATUS_SUCCEEDED
    assert (result.reached_goal, result.stalled) == (False, True)
    assert result.effort == pytest.approx(0.2, abs=0.021)
    assert 0.04 < result.position < 0.06
    assert stack.now.state == "holding"
    # More than the gripper may press is no reason to refuse: max_effort is a limit.
    result = send(0.0, 50.0).result()
    assert result.effort == pytest.approx(0.5, abs=0.021)
    assert send(1.0).result().reached_goal
    stack.until_state("ready")


def test_bad_commands(command):
    stack, send = command
    assert not send(-0.1).accepted
    stack.probe.until(lambda: "position: -0.1" in stack.now.refusal, "the reason")
    assert not send(0.05, float("nan")).accepted
    stack.probe.until(lambda: "max_effort: nan" in stack.now.refusal, "the reason")
