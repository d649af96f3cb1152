# SPDX-License-Identifier: Apache-2.0
"""Grasp, hold and release without ROS, on simulated fingers."""

import numpy as np
import pytest
from plant import LENGTH, NAMES, STEP, TOUCH, Plant

from ccr_ros.grasp.machine import State
from ccr_ros.grasp.runs import End, Refused


@pytest.fixture
def plant():
    plant = Plant()
    plant.run(0.2)
    assert plant.gripper.state is State.IDLE
    return plant


def test_grasp_hold_release(plant):
    run = plant.grasp(force=0.2)
    outcome = plant.finish(run)
    assert (outcome.end, outcome.reached, outcome.stalled) == (End.DONE, True, False)
    assert plant.gripper.state is State.HOLDING
    assert plant.gripper.object_held
    np.testing.assert_allclose(plant.forces(), 0.2, atol=0.021)
    plant.run(5.0)
    np.testing.assert_allclose(plant.forces(), 0.2, atol=0.005)
    assert plant.finish(plant.release()).reached
    assert plant.gripper.state is State.READY
    np.testing.assert_allclose(list(plant.at.values()), 0.0, atol=2e-4)


def test_who_touches_first_waits(plant):
    plant.touch["finger_1"] = 0.003
    run = plant.grasp(force=0.3, speed=0.003)
    most = 0.0
    while not all(plant.forces()):
        plant.advance()
        most = max(most, plant.force("finger_1"))
        assert plant.gripper.phase == "approach"
    # No more than it ran on by before its touch was known: speed times lag and delay.
    assert most < 720.0 * 0.003 * (plant.lag + 2 * STEP)
    waiting = plant.force("finger_1")
    assert waiting == pytest.approx(plant.settings.touch_force, abs=0.02)
    plant.until(lambda: plant.gripper.phase == "press")
    while run.outcome is None:
        plant.advance()
        assert np.ptp(plant.forces()) < 0.15  # all press together
    assert run.outcome.reached


def test_grasp_from_closed_fingers_opens_them_first():
    plant = Plant(finger_1=0.002, finger_2=0.002, finger_3=0.002)
    plant.run(0.2)
    assert plant.gripper.state is State.IDLE
    run = plant.grasp()
    assert plant.gripper.state is State.OPENING
    assert plant.finish(run).reached
    assert min(step["finger_1"] for step in plant.history) == 0.0


def test_no_command_jumps(plant):
    plant.held = False  # it stands: the fingers give way to its size one by one
    plant.touch["finger_2"] = 0.0048
    plant.finish(plant.grasp(speed=0.002))
    plant.touch = dict.fromkeys(NAMES, 0.0051)
    plant.run(3.0)
    plant.finish(plant.release(fast=True))
    places = np.array([[step[name] for name in NAMES] for step in plant.history])
    # But for the touch, which takes back what the command was ahead.
    assert np.abs(np.diff(places, axis=0)).max() < 0.002 * (plant.lag + 4 * STEP)
    assert places.max() <= LENGTH


def test_required_fingers_are_enough(plant):
    plant.touch["finger_3"] = 1.0
    outcome = plant.finish(plant.grasp(required=("finger_1", "finger_2")))
    assert outcome.reached
    plant.run(8.0)
    assert plant.gripper.state is State.HOLDING
    assert plant.at["finger_3"] <= LENGTH


def test_expected_width_makes_the_way_there_short(plant):
    slow = Plant()
    slow.run(0.2)
    start = slow.now
    slow.finish(slow.grasp())
    slow_time, start = slow.now - start, plant.now
    gap = plant.control["finger_1"].free.gap_at(TOUCH)
    plant.finish(plant.grasp(gap=gap))
    assert plant.now - start < slow_time - 2.0


def test_the_named_object_only(plant):
    plant.thing = "table"
    outcome = plant.finish(plant.grasp(thing="ball"))
    assert outcome.end is End.FAILED
    assert "touches 'table', not 'ball'" in outcome.message
    assert plant.gripper.state is State.STOPPED


def test_force_beyond_what_the_limit_gives(plant):
    plant.touch = dict.fromkeys(NAMES, 0.0059)
    outcome = plant.finish(plant.grasp(force=0.4))
    assert (outcome.end, outcome.reached, outcome.stalled) == (End.FAILED, False, True)
    assert "less than 0.4 N, at the limit" in outcome.message
    assert plant.gripper.state is State.HOLDING
    assert plant.gripper.object_held
    assert max(plant.at.values()) <= LENGTH + 1e-9


def test_an_unstable_pose_is_not_pressed_on(plant):
    run = plant.grasp(force=0.4)
    plant.until(lambda: plant.gripper.phase == "press")
    plant.unstable.add("finger_2")
    plant.run(2 * STEP)  # until the solver says so
    before = plant.control["finger_2"].place
    plant.run(2.0)
    assert plant.control["finger_2"].place <= before
    plant.unstable.clear()
    assert plant.finish(run).reached


def test_another_force_while_holding():
    plant = Plant().holding(0.2)
    assert plant.finish(plant.grasp(force=0.4)).reached
    np.testing.assert_allclose(plant.forces(), 0.4, atol=0.021)
    assert plant.finish(plant.grasp(force=0.1)).reached
    np.testing.assert_allclose(plant.forces(), 0.1, atol=0.021)
    assert plant.gripper.state is State.HOLDING


def test_a_newer_grasp_takes_over(plant):
    first = plant.grasp(force=0.1)
    plant.run(2.0)
    reached = dict(plant.at)
    second = plant.grasp(force=0.3)
    assert first.outcome.end is End.FAILED
    assert "newer grasp" in first.outcome.message
    assert plant.finish(second).reached
    assert all(plant.at[name] > reached[name] for name in NAMES)
    np.testing.assert_allclose(plant.forces(), 0.3, atol=0.021)


@pytest.mark.parametrize("after", [1.0, 6.5])
def test_cancelled_grasp_keeps_what_it_has(plant, after):
    run = plant.grasp(force=0.4)
    plant.run(after)
    plant.gripper.cancel(run)
    assert run.outcome.end is End.CANCELED
    assert plant.gripper.state is State.STOPPED
    before = dict(plant.at)
    plant.run(5.0)
    assert all(plant.at[name] >= before[name] for name in NAMES)
    assert all(plant.at[name] - before[name] < 1e-3 for name in NAMES)


def test_cancelled_change_of_force_holds_on():
    plant = Plant().holding(0.2)
    run = plant.grasp(force=0.4)
    plant.run(0.5)
    plant.gripper.cancel(run)
    assert plant.gripper.state is State.HOLDING
    plant.run(3.0)
    assert plant.gripper.object_held
    assert max(plant.forces()) < 0.39


def test_timed_release():
    plant = Plant().holding()
    run = plant.release(delay=5.0)
    assert plant.gripper.release_in(plant.now) == 5.0
    plant.run(4.9)
    assert plant.gripper.state is State.HOLDING
    plant.run(0.2)
    assert plant.gripper.state is State.RELEASING
    assert plant.gripper.release_in(plant.now) < 0
    assert plant.finish(run).reached


@pytest.mark.parametrize("how", ["cancel", "stop", "hold", "newer"])
def test_a_release_that_waits_can_be_put_off(how):
    plant = Plant().holding()
    run = plant.release(delay=2.0)
    plant.run(1.0)
    if how == "cancel":
        plant.gripper.cancel(run)
    elif how == "stop":
        plant.gripper.stop()
    elif how == "hold":
        plant.gripper.hold(plant.now)
    else:
        plant.release(delay=100.0)
    assert run.outcome.end is (End.CANCELED if how == "cancel" else End.FAILED)
    plant.run(5.0)
    assert plant.gripper.object_held
    assert plant.gripper.state is (State.STOPPED if how == "stop" else State.HOLDING)


def test_cancelled_release_stops_half_way():
    plant = Plant().holding()
    run = plant.release()
    plant.run(1.0)
    plant.gripper.cancel(run)
    before = dict(plant.at)
    plant.run(2.0)
    assert plant.gripper.state is State.STOPPED
    assert all(abs(plant.at[name] - before[name]) < 3e-4 for name in NAMES)
    assert before["finger_1"] > 0.003


def test_slow_and_fast_release():
    times = []
    for fast in (False, True):
        plant = Plant().holding()
        start = plant.now
        plant.finish(plant.release(fast=fast))
        times.append(plant.now - start)
    assert times[0] > 2 * times[1]


def test_stop_and_hold():
    plant = Plant().holding()
    assert "keep what they grip" in plant.gripper.stop()
    plant.run(3.0)
    forces = plant.forces()
    np.testing.assert_allclose(forces, 0.2, atol=0.03)
    assert plant.gripper.hold(plant.now) == "holding"
    plant.run(3.0)
    np.testing.assert_allclose(plant.forces(), forces, atol=0.01)
    assert plant.gripper.hold(plant.now) == "holding"  # a call again changes nothing


def test_stop_in_the_middle_and_on_with_a_new_grasp(plant):
    run = plant.grasp()
    plant.run(3.0)
    plant.gripper.stop()
    assert run.outcome.message == "stopped"
    at = dict(plant.at)
    assert plant.finish(plant.grasp()).reached
    after = [step["finger_1"] for step in plant.history[-200:]]
    assert min(after) >= at["finger_1"] - 1e-9  # it went on from there


def test_found_holding_at_the_start():
    places = dict.fromkeys(NAMES, TOUCH + 0.25 / 720.0)
    plant = Plant(**places)
    plant.run(0.2)
    assert plant.gripper.state is State.HOLDING
    plant.run(3.0)
    np.testing.assert_allclose(plant.forces(), 0.25, atol=0.005)
    assert plant.finish(plant.release()).reached


def test_found_touching_at_the_start():
    plant = Plant(finger_1=TOUCH + 1e-4)
    plant.run(1.0)
    assert plant.gripper.state is State.STOPPED
    assert plant.gripper.message == "found touching something"
    assert plant.at["finger_1"] == TOUCH + 1e-4


def test_what_is_refused_and_why(plant):
    with pytest.raises(Refused, match="the gripper is idle"):
        plant.gripper.hold(plant.now)
    assert plant.gripper.refusal
    plant.finish(plant.grasp())
    assert plant.gripper.refusal == ""
    with pytest.raises(Refused, match="something else is held; release it first"):
        plant.grasp(thing="cup")
    plant.release(delay=9.0)
    with pytest.raises(Refused, match="a release is due; cancel it first"):
        plant.grasp(force=0.3)
    plant.release()
    plant.run(0.1)
    for command in (plant.grasp, plant.release):
        with pytest.raises(Refused, match="the gripper is releasing"):
            command()
    assert plant.gripper.state is State.RELEASING


def test_refused_before_anything_is_known():
    plant = Plant()
    with pytest.raises(Refused, match="no measured pulls of finger_1 yet"):
        plant.grasp()
    plant.solver_silent = True
    plant.run(0.5)
    with pytest.raises(Refused, match="no state of finger_1 yet"):
        plant.grasp()


@pytest.mark.parametrize("every", [5, 20])
def test_a_slow_solver_makes_fingers_slow_and_not_rough(plant, every):
    """Poses come 10 or 2.5 times a second: what is pressed unawares stays small."""
    plant.solve_every = every
    run = plant.grasp(force=0.2, speed=0.005, timeout=120.0)
    most = 0.0
    while run.outcome is None:
        plant.advance()
        most = max(most, *plant.forces())
    assert run.outcome.reached
    assert most < 720.0 * plant.settings.blind_lead + 0.05
    plant.run(10.0)
    np.testing.assert_allclose(plant.forces(), 0.2, atol=0.02)
    plant.touch = dict.fromkeys(NAMES, TOUCH - 1e-4)
    plant.run(10.0)
    np.testing.assert_allclose(plant.forces(), 0.2, atol=0.02)


def test_hold_ends_a_grasp_with_what_it_has(plant):
    run = plant.grasp(force=0.5)
    plant.until(lambda: min(plant.forces()) > 0.1)
    assert plant.gripper.hold(plant.now) == "holding"
    assert run.outcome.message == "held as it is"
    before = plant.forces()
    plant.run(3.0)
    np.testing.assert_allclose(plant.forces(), before, atol=0.05)
    assert plant.gripper.object_held
