# SPDX-License-Identifier: Apache-2.0
"""What goes wrong around a grasp ends in a stated state within a stated time, and nothing drops."""

import numpy as np
import pytest
from plant import LENGTH, NAMES, Plant

from ccr_ros.grasp.machine import State
from ccr_ros.grasp.runs import End, Refused


@pytest.fixture
def plant():
    plant = Plant()
    plant.run(0.2)
    return plant


def fails(plant, run, text, state, within):
    """Check that a run fails with this text, and in which state it leaves the gripper."""
    outcome = plant.finish(run, within)
    assert outcome.end is End.FAILED
    assert not outcome.reached
    assert text in outcome.message
    assert plant.gripper.state is state
    return outcome


def test_object_missing(plant):
    plant.touch = dict.fromkeys(NAMES, 1.0)
    run = plant.grasp(thing="ball")
    outcome = fails(plant, run, "closed without touching 'ball'", State.OPENING, 8.0)
    assert not outcome.stalled
    plant.until(lambda: plant.gripper.state is State.READY, 3.0)
    np.testing.assert_allclose(list(plant.at.values()), 0.0, atol=2e-4)
    assert "without touching" in plant.gripper.message
    plant.touch = dict.fromkeys(NAMES, 0.0054)
    assert plant.finish(plant.grasp()).reached


def test_one_finger_never_touches(plant):
    plant.touch["finger_2"] = 1.0
    outcome = fails(plant, plant.grasp(), "finger_2 found nothing", State.STOPPED, 8.0)
    assert outcome.stalled
    plant.run(3.0)
    assert plant.force("finger_1") < 0.05  # it still waits
    assert max(plant.at.values()) <= LENGTH


@pytest.mark.parametrize("phase", ["approach", "press", "holding"])
@pytest.mark.parametrize("what", ["solver silent", "stale", "bridge silent", "servo fault"])
def test_what_fails_while_it_closes_or_holds(plant, what, phase):
    run = plant.grasp(force=0.3)
    if phase == "holding":
        assert plant.finish(run).reached
        run = plant.grasp(force=0.45)
    else:
        plant.until(lambda: plant.gripper.phase == phase)
    start = plant.now
    if what == "servo fault":
        plant.gripper.servos.heard = True
        plant.gripper.servos.active = False
        plant.gripper.servos.reason = "over-tension at finger_1_main"
        text = "servo bridge: over-tension at finger_1_main"
    elif what == "stale":
        plant.stale.add("finger_2")
        text = "solver: the pose of finger_2 is stale"
    elif what == "solver silent":
        plant.solver_silent = True
        text = "solver: no state of finger_1"
    else:
        plant.bridge_silent = True
        text = "servo bridge: no measured pulls of finger_1"
    before = {name: plant.control[name].place for name in NAMES}
    fails(plant, run, text, State.FAULT, 1.0)
    assert plant.now - start <= 1.0
    plant.run(3.0)
    assert plant.gripper.state is State.FAULT
    assert all(plant.control[name].place >= before[name] for name in NAMES)
    with pytest.raises(Refused, match=r"the gripper is fault .*; reset it first"):
        plant.grasp()

    # The way back: reset moves nothing, and what was gripped is held again.
    plant.solver_silent = plant.bridge_silent = False
    plant.stale.clear()
    plant.gripper.servos.active = True
    plant.run(0.2)
    at = dict(plant.at)
    assert "keep what they grip" in plant.gripper.reset(plant.now)
    plant.run(1.0)
    assert plant.gripper.state is State.STOPPED
    np.testing.assert_allclose(list(plant.at.values()), list(at.values()), atol=2e-4)
    if phase == "holding":
        plant.gripper.hold(plant.now)
        plant.run(1.0)
        assert plant.gripper.object_held
    else:
        assert plant.finish(plant.grasp()).reached


def test_reset_waits_for_the_servos():
    plant = Plant().holding()
    plant.bridge_silent = True
    plant.run(1.0)
    with pytest.raises(Refused, match="servo bridge: no measured pulls"):
        plant.gripper.reset(plant.now)
    assert plant.gripper.state is State.FAULT


def test_without_the_solver_one_can_still_let_go():
    plant = Plant().holding()
    plant.solver_silent = True
    plant.until(lambda: plant.gripper.state is State.FAULT)
    plant.gripper.reset(plant.now)
    assert plant.finish(plant.release()).reached


def test_a_short_silence_is_waited_out(plant):
    run = plant.grasp()
    plant.run(2.0)
    plant.stale = set(NAMES)
    before = dict(plant.at)
    plant.run(0.5)
    assert all(plant.at[name] - before[name] < 3e-4 for name in NAMES)  # nothing is pressed blindly
    plant.stale = set()
    assert plant.finish(run).reached


@pytest.mark.parametrize("after", [1.0, 6.0])
def test_timeout(plant, after):
    run = plant.grasp(timeout=after, force=0.5)
    fails(plant, run, f"not done within {after:g} s", State.STOPPED, after + 0.1)


def test_a_servo_that_does_not_follow(plant):
    run = plant.grasp()
    plant.run(2.0)
    plant.stuck.add("finger_3")
    outcome = fails(plant, run, "finger_3: its servo does not follow", State.STOPPED, 2.0)
    assert outcome.stalled
    assert plant.control["finger_3"].place - plant.at["finger_3"] <= plant.settings.max_lead


def test_a_release_that_does_not_follow():
    plant = Plant().holding()
    plant.stuck.add("finger_1")
    run = plant.release(fast=True)
    fails(plant, run, "not open: the servo of finger_1 does not follow", State.STOPPED, 4.0)


def test_touch_without_effort_is_no_grasp(plant):
    plant.limp.add("finger_2")
    outcome = fails(plant, plant.grasp(), "finger_2 touches, but its tension", State.STOPPED, 20.0)
    assert "beyond that of the free finger" in outcome.message


def test_object_lost_while_holding():
    plant = Plant().holding()
    plant.touch["finger_1"] = 1.0
    plant.until(lambda: plant.gripper.state is State.FAULT, 2.5)
    assert plant.gripper.message == "finger_1 lost the object"
    assert not plant.gripper.object_held
    before = dict(plant.at)
    plant.run(3.0)
    assert all(plant.at[name] >= before[name] - 1e-6 for name in NAMES)


def test_a_fault_calls_a_waiting_release_off():
    plant = Plant().holding()
    run = plant.release(delay=1.0)
    plant.bridge_silent = True
    fails(plant, run, "servo bridge", State.FAULT, 1.0)
    plant.bridge_silent = False
    plant.run(3.0)
    assert min(plant.forces()) > 0.15
