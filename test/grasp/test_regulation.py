# SPDX-License-Identifier: Apache-2.0
"""The force regulation is stable, as its derivation says, on springs behind a lag and a delay."""

import math
from collections import deque

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ccr_ros.grasp.regulation import ForceLaw
from ccr_ros.grasp.settings import GraspSettings

STEP = 0.02  # s


def forces(law, stiffness, lag, delay, target, start=0.0, seconds=60.0):
    """Return the forces over time of a spring that is pressed through a lag and a delay."""
    place = at = start / stiffness
    late = deque([start] * (round(delay / STEP) + 1), maxlen=round(delay / STEP) + 1)
    course = []
    for _ in range(round(seconds / STEP)):
        place += law.step(late[0], target, STEP)
        at += (place - at) * (1.0 if lag == 0.0 else -math.expm1(-STEP / lag))
        late.append(max(0.0, stiffness * at))
        course.append(late[-1])
    return np.array(course)


@given(
    stiffness=st.floats(100.0, 5000.0),
    lag=st.floats(0.0, 0.3),
    delay=st.floats(0.0, 0.3),
    target=st.floats(0.02, 2.0),
)
def test_well_damped_within_its_bound(stiffness, lag, delay, target):
    # A step of the law is a delay of half a step, and the force is a step old.
    gain = 0.5 / (stiffness * (lag + delay + 2 * STEP))
    course = forces(ForceLaw(gain, math.inf), stiffness, lag, delay, target)
    assert course.max() < 1.15 * target
    assert course[-1] == pytest.approx(target, rel=0.01)


@given(stiffness=st.floats(100.0, 5000.0), delay=st.floats(0.06, 0.3))
def test_the_bound_of_stability_is_one(stiffness, delay):
    """Beyond it, with a pure delay, the force swings more and more: the test above could fail."""
    gain = 1.2 * math.pi / 2 / (stiffness * (delay - STEP))
    course = forces(ForceLaw(gain, math.inf), stiffness, 0.0, delay, 1.0, start=0.9)
    assert np.ptp(course[-500:]) > 2 * abs(course[0] - 1.0)


@pytest.mark.parametrize("start", [0.0, 0.45])
def test_defaults_on_the_sphere_gripper(start):
    settings = GraspSettings()
    law = ForceLaw(settings.force_gain, settings.force_speed, settings.force_dead_band)
    course = forces(law, 720.0, 0.1, 0.1, 0.2, start, seconds=10.0)
    assert abs(course[-100:] - 0.2).max() <= settings.force_dead_band
    overshoot = max(course.max() - max(0.2, start), min(0.2, start) - course.min())
    assert overshoot < 0.01


def test_rate_and_dead_band():
    law = ForceLaw(gain=1.0, max_rate=0.001, dead_band=0.01)
    assert law.step(0.0, 5.0, 2.0) == pytest.approx(0.002)
    assert law.step(5.0, 0.0, 2.0) == pytest.approx(-0.002)
    assert law.step(0.2, 0.21, 1.0) == 0.0
    assert law.step(0.2, 0.2001, 1.0) == 0.0


@pytest.mark.parametrize("delay", [0, 3, 6])
def test_one_step_a_pose_is_stable_for_six_poses_of_delay(delay):
    """As docs/grasping.md says of the defaults; every pose counts for 0.1 s, however late."""
    settings, stiffness = GraspSettings(), 720.0
    law = ForceLaw(settings.force_gain, math.inf)
    bound = 2 * math.sin(math.pi / (2 * (2 * delay + 1)))
    assert settings.force_gain * stiffness * 0.1 < bound
    late = deque([0.3] * (delay + 1), maxlen=delay + 1)
    place, swing = 0.3 / stiffness, []
    for _ in range(600):
        place += law.step(late[0], 0.2, 0.1)
        late.append(stiffness * place)
        swing.append(abs(late[-1] - 0.2))
    assert max(swing[-50:]) < 0.5 * max(swing[:50])
