# SPDX-License-Identifier: Apache-2.0
"""The coordinator through its topics, actions and services: grasp, hold, release."""

import math

import pytest
from action_msgs.msg import GoalStatus
from diagnostic_msgs.msg import DiagnosticStatus
from gripper_stack import BALL, FINGERS, OPEN
from probe import sphere


def forces(message):
    return [finger.force for finger in message.fingers]


def test_grasp_hold_and_timed_release(stack):
    stack = stack().ready()
    stack.show(BALL)
    goal = stack.grasp(object="ball", force=0.2)
    result = goal.result()
    assert goal.status == GoalStatus.STATUS_SUCCEEDED
    assert (result.reached, result.stalled, result.state) == (True, False, "holding")
    assert [finger.finger for finger in result.fingers] == list(FINGERS)
    for finger in result.fingers:
        assert finger.force == pytest.approx(0.2, abs=0.021)
        assert finger.in_contact and finger.effort_agrees and not finger.at_limit
        assert {contact.obstacle for contact in finger.contacts} == {"ball"}
        assert finger.tensions[0] > 6.0
        assert 0.0053 < finger.pulls_measured[0] < 0.0062
    phases = [message.phase for message in goal.feedback]
    assert phases.index("approach") < phases.index("press")
    assert all(len(message.fingers) == 3 for message in goal.feedback)

    stack.probe.until(lambda: stack.now.object_held, "the object held")
    assert stack.now.target_force == 0.2
    assert stack.now.release_in < 0.0

    goal = stack.release(delay=1.0)
    stack.probe.until(lambda: stack.now.release_in >= 0.0, "the release announced")
    assert stack.now.state == "holding"
    result = goal.result()
    assert goal.status == GoalStatus.STATUS_SUCCEEDED
    assert (result.released, result.state, result.message) == (True, "ready", "released")
    remaining = [message.remaining for message in goal.feedback]
    assert remaining[0] > 0.5 and remaining[-1] == 0.0
    # The solver may be behind the servos.
    stack.probe.until(lambda: forces(stack.now) == [0.0, 0.0, 0.0], "no force any more")
    assert all(abs(finger.pulls_measured[0] - OPEN) < 3e-4 for finger in result.fingers)


@pytest.mark.long
def test_an_object_that_grows_and_shrinks_is_held_with_the_same_force(stack):
    stack = stack().holding()

    def settled():
        stack.probe.until(
            lambda: all(abs(force - 0.2) < 0.01 for force in forces(stack.now)),
            "the force at its target",
        )
        return sum(finger.pulls_measured[0] for finger in stack.now.fingers) / 3

    before = settled()
    stack.show(sphere("ball", 0.057, (0.0, 0.0, 0.11)))
    # The model: 0.2 N at 3.09 % of the length on the ball, at 3.01 % on the bigger one.
    stack.probe.until(lambda: settled() < before - 0.0001, "the pulls given way")
    stack.show(BALL)
    stack.probe.until(lambda: settled() > before - 0.00005, "the pulls taken up again")
    assert stack.now.state == "holding"
    assert stack.now.object_held


def test_stop_keeps_the_grip_and_hold_goes_on(stack):
    stack = stack().holding()
    answer = stack.call("stop")
    assert answer.success
    stack.until_state("stopped")
    stack.probe.spin_for(0.5)
    assert min(forces(stack.now)) > 0.15
    assert stack.now.object_held
    assert stack.call("hold").success
    stack.until_state("holding")


def test_cancelled_grasp_stops_and_keeps_its_place(stack):
    stack = stack(close_speed=0.001).ready()
    goal = stack.grasp(force=0.2)
    stack.probe.until(lambda: stack.bridge.at["finger_1"] > OPEN + 5e-4, "a motion")
    assert goal.cancel()
    result = goal.result()
    assert goal.status == GoalStatus.STATUS_CANCELED
    assert result.state == "stopped"
    assert "cancelled" in result.message
    at = dict(stack.bridge.at)
    stack.probe.spin_for(0.5)
    assert all(-1e-5 <= stack.bridge.at[name] - at[name] < 0.0012 for name in FINGERS)
    assert stack.release(fast=True).result().released


def test_a_release_is_cancelled_before_it_begins(stack):
    stack = stack().holding()
    goal = stack.release(delay=60.0)
    stack.probe.until(lambda: stack.now.release_in > 0.0, "the release announced")
    assert goal.cancel()
    result = goal.result()
    assert goal.status == GoalStatus.STATUS_CANCELED
    assert (result.released, result.state) == (False, "holding")
    assert stack.now.object_held
    assert not goal.cancel()  # it is over


@pytest.mark.long
def test_newer_goals_take_over_or_are_rejected_with_a_reason(stack):
    stack = stack(close_speed=0.001).ready()
    stack.show(BALL)
    first = stack.grasp(force=0.1)
    stack.probe.until(lambda: stack.now.state == "closing", "closing")
    second = stack.grasp(force=0.2)
    result = first.result()
    assert first.status == GoalStatus.STATUS_ABORTED
    assert "a newer grasp took its place" in result.message
    assert second.result().reached

    waiting = stack.release(delay=60.0)
    assert not stack.grasp(force=0.3).accepted
    stack.probe.until(lambda: "a release is due" in stack.now.refusal, "the reason")
    assert stack.release(fast=True).result().released
    assert "a newer release" in waiting.result().message
    assert stack.now.refusal == ""


BAD_GOALS = {
    "force: nan": {"force": math.nan},
    "force: 9.0": {"force": 9.0},
    "speed: -1.0": {"speed": -1.0},
    "timeout: inf": {"timeout": math.inf},
    "width: -0.1": {"width": -0.1},
    "unknown finger 'thumb'": {"required_fingers": ["thumb"]},
    "required_fingers[0]": {"required_fingers": ["finger_1", "finger_1"]},
    "object": {"object": " ball"},
}


def test_bad_goals_are_rejected_with_a_reason(stack):
    stack = stack().ready()
    for reason, values in BAD_GOALS.items():
        assert not stack.grasp(**values).accepted, reason
        stack.probe.until(lambda r=reason: r in stack.now.refusal, reason)
    assert not stack.release(delay=-1.0).accepted
    stack.probe.until(lambda: "delay: -1.0" in stack.now.refusal, "the reason")
    assert not stack.call("hold").success
    assert stack.now.state == "idle"


@pytest.mark.long
def test_a_coordinator_that_starts_again_finds_what_it_holds(stack):
    stack = stack().holding()
    stack.end(stack.node)
    at = dict(stack.bridge.at)
    stack.probe.spin_for(0.3)
    stack.states.clear()
    stack.start_coordinator()
    stack.until_state("holding", "found holding")
    stack.probe.spin_for(0.5)
    assert all(abs(stack.bridge.at[name] - at[name]) < 1e-4 for name in FINGERS)
    assert stack.release(fast=True).result().released


def test_diagnostics(stack):
    stack = stack().ready()
    stack.probe.diagnostics()
    status = stack.probe.until(
        lambda: stack.probe.status("gripper_coordinator_node"), "the coordinator's status"
    )
    assert status.level == DiagnosticStatus.OK
    assert status.hardware_id == "gripper_sphere"
    stack.call("stop")
    stack.probe.until(
        lambda: stack.probe.status("gripper_coordinator_node").level == DiagnosticStatus.WARN
    )
