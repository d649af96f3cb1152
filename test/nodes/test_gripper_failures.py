# SPDX-License-Identifier: Apache-2.0
"""What fails around a grasp, through topics: each row of the table in docs/grasping.md."""

import pytest
from action_msgs.msg import GoalStatus
from diagnostic_msgs.msg import DiagnosticStatus
from gripper_stack import BALL, FINGERS, OPEN
from probe import sphere

HOLDING = [
    pytest.param(False, id="closing"),
    pytest.param(True, id="holding", marks=pytest.mark.long),
]


def aborted(goal, text):
    """Wait for the goal to be aborted with this text; return the result."""
    result = goal.result()
    assert goal.status == GoalStatus.STATUS_ABORTED
    assert text in result.message
    assert not result.reached
    return result


def kept(stack, before):
    """Check that no finger lets go while some time passes."""
    stack.probe.spin_for(0.5)
    assert all(stack.bridge.at[name] > before[name] - 1e-4 for name in FINGERS)


def test_object_missing(stack):
    stack = stack().ready()
    goal = stack.grasp(object="ball", force=0.2)
    result = aborted(goal, "closed without touching 'ball'; the fingers open again")
    assert not result.stalled
    assert stack.until_state("ready", "closed without touching")
    assert all(abs(at - OPEN) < 3e-4 for at in stack.bridge.at.values())


def test_one_finger_never_touches(stack):
    stack = stack().ready()
    # A small ball, aside: out of reach of fingers 2 and 3.
    stack.show(sphere("ball", 0.03, (0.055, 0.0, 0.14)))
    result = aborted(stack.grasp(object="ball"), "finger_2, finger_3 found nothing: 'ball'")
    assert (result.state, result.stalled) == ("stopped", True)
    assert [finger.in_contact for finger in result.fingers] == [True, False, False]
    assert [finger.at_limit for finger in result.fingers] == [False, True, True]


def test_something_else_is_touched(stack):
    stack = stack().ready()
    stack.show(sphere("lamp", 0.056, (0.0, 0.0, 0.11)))
    result = aborted(stack.grasp(object="ball"), "touches 'lamp', not 'ball'")
    assert result.state == "stopped"


@pytest.mark.parametrize("holding", HOLDING)
def test_solver_silent(stack, holding):
    stack = stack(solver_timeout=3.0, close_speed=0.001)
    if holding:
        stack.holding()
    else:
        stack.ready()
        goal = stack.grasp()
        stack.probe.until(lambda: stack.now.phase == "approach")
    stack.end(stack.solver)
    before = dict(stack.bridge.at)
    stack.until_state("fault", "solver: no state of finger_")
    if not holding:
        assert aborted(goal, "solver: no state of finger_").state == "fault"
    kept(stack, before)
    # Without the solver one can let go.
    assert stack.call("reset").success
    stack.until_state("stopped")
    assert stack.release(fast=True).result().released


@pytest.mark.parametrize("holding", HOLDING)
def test_servo_fault(stack, holding):
    stack = stack()
    if holding:
        stack.holding()
    else:
        stack.ready().show(BALL)
        goal = stack.grasp(force=0.3)
        stack.probe.until(lambda: stack.now.phase == "press", "pressing")
    stack.bridge.fault = "over-tension at finger_2_main"
    stack.until_state("fault", "servo bridge: fault: over-tension at finger_2_main")
    if not holding:
        aborted(goal, "over-tension")
    kept(stack, dict(stack.bridge.at))
    assert not stack.grasp().accepted
    answer = stack.call("reset")
    assert not answer.success
    assert "over-tension" in answer.message
    stack.bridge.fault = ""
    stack.probe.until(lambda: stack.call("reset").success, "the reset")
    if holding:
        assert stack.call("hold").success
        stack.until_state("holding")
    else:
        assert stack.grasp(force=0.2).result().reached


@pytest.mark.parametrize("holding", HOLDING)
def test_bridge_silent(stack, holding):
    stack = stack(bridge_timeout=3.0, close_speed=0.001)
    if holding:
        stack.holding()
    else:
        stack.ready()
        goal = stack.grasp()
        stack.probe.until(lambda: stack.now.phase == "approach")
    stack.bridge.silent = True
    stack.until_state("fault", "servo bridge: no measured pulls of finger_")
    if not holding:
        aborted(goal, "servo bridge: no measured pulls")
    before = dict(stack.bridge.at)
    stack.bridge.silent = False
    kept(stack, before)
    assert stack.now.state == "fault"
    stack.probe.until(lambda: stack.call("reset").success, "the reset")


@pytest.mark.long
def test_stale_pose(stack):
    stack = stack(stale_timeout=3.0).holding()
    last = stack.probe.until(lambda: stack.probe.states("finger_3"), "a state")[-1]
    stack.end(stack.solver)
    for name in FINGERS:
        stack.bridge.tell_stale(name, last)
    stack.until_state("fault", "is stale since")
    assert not stack.now.object_held
    kept(stack, dict(stack.bridge.at))
    # What is held is not known, so that it can only be let go of.
    assert stack.call("reset").success
    assert not stack.call("hold").success
    stack.probe.until(lambda: "is stale" in stack.now.refusal, "the reason")
    assert stack.release(fast=True).result().released


def test_timeout(stack):
    stack = stack(close_speed=0.0005).ready()
    result = aborted(stack.grasp(timeout=1.0), "not done within 1 s")
    assert result.state == "stopped"
    kept(stack, dict(stack.bridge.at))


def test_a_servo_does_not_follow(stack):
    stack = stack(stall_time=1.5, max_lead=0.001).ready()
    stack.bridge.stuck.add("finger_1")
    result = aborted(stack.grasp(), "finger_1: its servo does not follow")
    assert (result.state, result.stalled) == ("stopped", True)


@pytest.mark.long
def test_object_lost(stack):
    stack = stack(loss_time=0.5).holding()
    stack.probe.diagnostics()
    stack.show()
    stack.until_state("fault", "lost the object")
    assert not stack.now.object_held
    stack.probe.until(
        lambda: (
            (s := stack.probe.status("gripper_coordinator_node"))
            and s.level == DiagnosticStatus.ERROR
            and "lost the object" in s.message
        ),
        "the diagnosis",
    )
    kept(stack, dict(stack.bridge.at))
