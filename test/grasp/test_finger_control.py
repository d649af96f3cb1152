# SPDX-License-Identifier: Apache-2.0
"""One finger's command: it never jumps, and what is heard is kept."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from plant import FREE, free_motion

from ccr_ros.grasp.finger_control import FingerControl, SolvedFinger
from ccr_ros.grasp.free_motion import FreeMotion
from ccr_ros.grasp.progress import Lasting, Progress
from ccr_ros.grasp.pull_path import PullPath
from ccr_ros.grasp.settings import GraspSettings

PULLS = st.floats(-0.01, 0.01)


def two_cables():
    places = np.array([0.0, 0.006])
    free = FreeMotion(places, FREE * np.outer(places, [1.0, 0.5]), np.array([0.1, 0.0]))
    path = PullPath(np.array([0.0, 0.001]), np.array([0.006, 0.004]))
    return FingerControl("thumb", ("a", "b"), path, free)


@given(PULLS, PULLS, st.floats(0.0, 0.006), st.floats(1e-4, 1e-3))
def test_found_anywhere_it_goes_to_the_path_in_steps(first, second, place, step):
    finger = two_cables()
    finger.hear_pulls(np.array([first, second]), 0.0)
    finger.adopt()
    np.testing.assert_allclose(finger.command, [first, second], atol=1e-15)
    before = finger.command
    for _ in range(350):
        finger.step_towards(place, step)
        assert np.abs(finger.command - before).max() <= step + 1e-12
        before = finger.command
    np.testing.assert_allclose(finger.command, finger.path.pulls(place), atol=1e-9)


def test_freeze_does_not_add_noise_up():
    finger = two_cables()
    finger.place = 0.003
    for noise in np.random.default_rng(1).normal(0.0, 5e-5, 1000):
        finger.hear_pulls(finger.path.pulls(0.003 + noise), 0.0)
        finger.freeze(2e-4)
    assert finger.place == pytest.approx(0.003, abs=3e-4)
    finger.hear_pulls(finger.path.pulls(0.005), 0.0)
    finger.freeze(2e-4)
    assert finger.place == pytest.approx(0.005)


def test_tension_of_the_servos_counts_before_that_of_the_solver():
    finger = two_cables()
    assert np.isnan(finger.tensions).all()
    assert math.isnan(finger.effort_excess)
    finger.hear_pulls(finger.path.pulls(0.002), 0.0)
    finger.hear_solved(SolvedFinger(finger.path.pulls(0.002), np.array([2.0, 1.0])), 0.0)
    np.testing.assert_allclose(finger.tensions, [2.0, 1.0])
    finger.servo_tensions = np.array([np.nan, 3.0])
    np.testing.assert_allclose(finger.tensions, [2.0, 3.0])
    assert finger.effort_excess == pytest.approx(3.0 - FREE * 0.002 * 0.5)


def test_force_of_one_thing_and_of_all():
    finger = two_cables()
    assert finger.force() == 0.0
    contacts = (("ball", 0.2), ("ball", 0.1), ("table", 1.0))
    finger.hear_solved(SolvedFinger(np.zeros(2), np.zeros(2), contacts), 0.0)
    assert finger.force() == pytest.approx(1.3)
    assert finger.force("ball") == pytest.approx(0.3)
    assert finger.force("cup") == 0.0


def test_a_stale_state_is_heard_but_not_fresh():
    finger = two_cables()
    finger.hear_solved(SolvedFinger(np.zeros(2), np.zeros(2)), 1.0)
    finger.hear_solved(SolvedFinger(np.zeros(2), np.zeros(2), stale=True), 2.0)
    assert (finger.solved_at, finger.fresh_at) == (2.0, 1.0)


def test_progress_of_a_slow_finger_is_no_stall_and_noise_is_none():
    settings = GraspSettings(stall_time=1.0, place_tolerance=2e-4)
    path = PullPath(np.array([0.0]), np.array([0.006]))
    noise = np.random.default_rng(2).uniform(-1.0, 1.0, 400)
    for speed, stalls in ((1e-4, False), (0.0, True)):
        finger = FingerControl("thumb", ("a",), path, free_motion())
        finger.place = 0.005
        progress = Progress(settings)
        names = []
        for step, shake in enumerate(noise):
            now = step * 0.02
            finger.hear_pulls(np.array([now * speed + 2e-5 * shake]), now)
            names.append(progress.stalled([finger], now))
        assert ("thumb" in names) == stalls


def test_lasting():
    lasting = Lasting()
    assert not lasting.holds(True, 0.0, 1.0)
    assert not lasting.holds(True, 0.9, 1.0)
    assert not lasting.holds(False, 0.95, 1.0)
    assert not lasting.holds(True, 1.0, 1.0)
    assert lasting.holds(True, 2.0, 1.0)
    assert lasting.holds(True, 2.0, 0.0)
