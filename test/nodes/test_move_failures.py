# SPDX-License-Identifier: Apache-2.0
"""What may go wrong while an object is moved, through the topics: it stays where it is, held."""

import math

import numpy as np
import pytest
from action_msgs.msg import GoalStatus
from cube_stack import CABLES, SHUT, vector
from gripper_stack import Goal

SLOW = {"speed": 2e-5}  # m/s of pulls; a motion that is stopped on its way


def going(stack):
    """Begin a long, slow turn."""
    goal = stack.rotate(0.25, **SLOW)
    stack.probe.until(
        lambda: goal.feedback and goal.feedback[-1].motion.fraction > 0.02, "a motion"
    )
    assert stack.now.state == "moving" and stack.now.phase == "go"
    return goal


def still(stack):
    """Tell whether the fingers stay where they are, and what they hold with them."""
    at = {name: pulls.copy() for name, pulls in stack.bridge.wanted.items()}
    stack.probe.spin_for(0.4)
    return all(np.abs(stack.bridge.wanted[name] - at[name]).max() < 3e-5 for name in CABLES)


@pytest.mark.long
def test_cancelled_stopped_and_taken_over(cube):
    stack = cube().holding()
    goal = going(stack)
    assert goal.cancel()
    result = goal.result()
    assert goal.status == GoalStatus.STATUS_CANCELED and result.state == "holding"
    assert 0.0 < result.motion.fraction < 0.9 and not result.reached
    assert still(stack) and stack.thing.held

    first = going(stack)
    second = stack.rotate(-0.05)
    assert second.result().reached
    assert first.result().message == "a newer motion took its place"

    goal = going(stack)
    assert stack.call("hold").success
    assert goal.result().state == "holding" and goal.status == GoalStatus.STATUS_ABORTED

    goal = going(stack)
    assert stack.call("stop").success
    assert goal.result().limiting == "stopped"
    assert stack.now.state == "stopped" and still(stack) and stack.thing.held
    assert not stack.rotate(0.1).accepted
    stack.probe.until(lambda: "the gripper is stopped" in stack.now.refusal, "the reason")
    assert stack.call("hold").success


@pytest.mark.long
def test_refused_with_the_constraint_named_or_as_far_as_is_possible(cube):
    ranges = {
        f"{name}.{key}_pulls": [pull + by for pull in pulls]
        for name, pulls in SHUT.items()
        for key, by in (("least", -1e-4), ("largest", 1e-4))
    }
    stack = cube(**ranges).holding()
    goal = stack.rotate(1.0)
    result = goal.result()
    assert goal.status == GoalStatus.STATUS_ABORTED and result.state == "holding"
    assert "pull of finger_" in result.limiting and "cannot be moved so" in result.message
    assert result.motion.fraction == 0.0 and abs(result.motion.turn.z) < 1e-3
    goal = stack.rotate(1.0, partial=True)
    result = goal.result()
    assert goal.status == GoalStatus.STATUS_SUCCEEDED and not result.reached, result.message
    assert "pull of finger_" in result.limiting and 0.05 < result.motion.turn.z < 0.9
    assert result.motion.fraction == 1.0 and stack.thing.held


@pytest.mark.long
def test_a_margin_that_falls_a_servo_that_is_stuck_and_a_fault(cube):
    stack = cube(move_stop_margin=0.3, stall_time=2.0).holding()
    goal = going(stack)
    stack.place(held=True, mass=0.018)
    result = goal.result()
    assert result.limiting.startswith("friction margin: ") and result.state == "holding"
    assert stack.thing.quality.margin < 0.3 and stack.thing.held and result.motion.fraction < 0.9
    assert not stack.rotate(0.1).accepted
    stack.probe.until(lambda: "friction margin" in stack.now.refusal, "the reason")
    stack.place(held=True)
    stack.probe.until(lambda: stack.thing.quality.margin > 0.3, "the margin")

    stack.bridge.stuck.update(CABLES)
    result = stack.rotate(0.4, speed=0.001).result()
    assert "does not follow" in result.limiting and result.state == "holding"
    assert stack.thing.held and stack.now.object_held
    stack.bridge.stuck.clear()

    goal = going(stack)
    stack.bridge.fault = "stall"
    result = goal.result()
    assert result.state == "fault" and "stall" in result.limiting
    assert still(stack) and stack.thing.held


@pytest.mark.long
def test_a_solver_that_falls_silent(cube):
    stack = cube(solver_timeout=1.5, bridge_timeout=15.0).holding()
    goal = going(stack)
    stack.end(stack.solver)
    result = goal.result()
    assert result.state == "fault" and result.limiting.startswith("solver: ")
    assert result.motion.fraction < 0.9 and still(stack)


BAD = {
    "target": {},
    "shift[1]": {"shift": (0, math.nan, 0)},
    "turn": {"turn": (3, 3, 0)},
    "margin: 1.5": {"turn": (0, 0, 0.1), "margin": 1.5},
    "duration: -1.0": {"turn": (0, 0, 0.1), "duration": -1.0},
    "speed: inf": {"turn": (0, 0, 0.1), "speed": math.inf},
    "0 where a duration is given": {"turn": (0, 0, 0.1), "duration": 1.0, "speed": 0.001},
}


@pytest.mark.long
def test_bad_goals_and_nothing_in_hand(cube):
    stack = cube().holding()
    for reason, values in BAD.items():
        assert not stack.move(**values).accepted, reason
        stack.probe.until(lambda r=reason: r in stack.now.refusal, reason)
    assert not stack.rotate(math.nan).accepted
    assert not stack.rotate(0.0).accepted
    stack.probe.until(lambda: "a shift or a turn that is not zero" in stack.now.refusal, "a reason")
    stack.place(held=False)
    stack.probe.until(lambda: not stack.thing.held, "it on the table")
    stack.probe.spin_for(0.1)
    assert not stack.rotate(0.1).accepted
    stack.probe.until(lambda: "the fingers do not carry 'cube'" in stack.now.refusal, "a reason")
    assert stack.now.state == "holding"


def test_a_solver_in_mode_fingers_tells_of_no_object(stack):
    from ccr_msgs.action import MoveObject
    from rclpy.action import ActionClient

    stack = stack().holding()
    client = ActionClient(stack.probe.node, MoveObject, "move_object")
    stack.probe.until(client.server_is_ready, "the action")
    assert not Goal(stack, client, MoveObject.Goal(turn=vector((0, 0, 0.1)))).accepted
    stack.probe.until(lambda: "it knows of no object in hand" in stack.now.refusal, "the reason")


@pytest.mark.long
def test_a_heavier_object_is_gripped_harder_and_a_lighter_one_as_before(cube):
    """hold_margin: the friction margin comes back when the weight changes."""
    stack = cube(hold_margin=0.5, max_force=0.5, margin_gain=0.3).holding()

    def settled(condition, what):
        stack.probe.until(lambda: stack.thing.held and condition(), what)

    before = stack.now.target_force
    stack.place(held=True, mass=0.012)
    settled(lambda: stack.thing.mass == 0.012 and stack.thing.quality.margin < 0.49, "the weight")
    settled(lambda: stack.thing.quality.margin >= 0.495, "the margin back")
    assert stack.now.target_force > before + 0.005
    stack.place(held=True, mass=0.01)
    settled(lambda: stack.now.target_force < before + 0.03, "the force as before")
    assert stack.now.state == "holding" and stack.now.object_held
