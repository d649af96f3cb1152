# SPDX-License-Identifier: Apache-2.0
"""Watches of one joint: limits and what is borne after a reset, and stalls by lack of progress."""

import math

import numpy as np
import pytest
from ccr_msgs.msg import ServoState
from hypothesis import given
from hypothesis import strategies as st
from racks import PERIOD, joint

from ccr_ros.actuation.faults import FaultCode, Limits, StallWatch
from ccr_ros.actuation.states import BridgeState


def test_numbers_are_those_of_the_message():
    for enum in (FaultCode, BridgeState):
        for member in enum:
            assert getattr(ServoState, member.name) == member.value


def test_limits():
    limits = Limits(joint())
    assert limits.check(0.005, 9.9) is None
    assert limits.check(math.nan, math.nan) is None
    assert limits.check(0.0129, 0.0) is None  # the tolerance, 1 mm, is no excess
    over = limits.check(0.005, 10.1)
    assert (over.code, over.joint) == (FaultCode.OVER_TENSION, "thumb_main")
    assert over.reason == "tension 10.1 N, limit 10 N"
    for pull in (0.0131, -0.0031):
        out = limits.check(pull, 0.0)
        assert out.code == FaultCode.OVER_TRAVEL
        assert "travel -2..12 mm" in out.reason
    assert limits.check_servo(69.0, "") is None
    assert limits.check_servo(math.nan, "") is None
    assert limits.check_servo(71.0, "").code == FaultCode.TEMPERATURE
    assert limits.check_servo(71.0, "overload").code == FaultCode.SERVO_ERROR


def test_what_is_beyond_after_a_reset_is_borne_while_it_shrinks():
    limits = Limits(joint())
    limits.accept(0.015, 20.0)
    assert limits.check(0.015, 20.0) is None
    assert limits.check(0.0151, 21.0) is None  # noise
    assert limits.check(0.015, 22.5).code == FaultCode.OVER_TENSION
    assert limits.check(0.0155, 20.0).code == FaultCode.OVER_TRAVEL
    assert limits.check(0.0140, 15.0) is None
    assert limits.check(0.0140, 17.0).code == FaultCode.OVER_TENSION  # it has been at 15 N
    assert limits.check(0.0145, 15.0).code == FaultCode.OVER_TRAVEL
    assert limits.check(0.005, 5.0) is None
    assert limits.check(0.005, 10.1).code == FaultCode.OVER_TENSION
    assert limits.check(0.0131, 5.0).code == FaultCode.OVER_TRAVEL


def first_stall(watch, setpoints, measured):
    for step, (setpoint, place) in enumerate(zip(setpoints, measured, strict=True)):
        if watch.stalled(setpoint, place, step * PERIOD):
            return step * PERIOD
    return None


def test_a_servo_that_stands_still_stalls_in_spite_of_noise():
    noise = 2e-4 * np.random.default_rng(1).standard_normal(100)
    found = first_stall(StallWatch(1e-3, 0.5), np.full(100, 0.005), noise)
    # Noise may once look like progress, which is half the tolerance away.
    assert 0.5 < found < 1.2


def test_a_slow_servo_does_not_stall():
    # Its setpoint runs away from it, but it gets on: 3 mm in a second.
    times = np.arange(500) * PERIOD
    assert first_stall(StallWatch(1e-3, 0.5), 0.02 * times, 0.003 * times) is None


def test_a_servo_that_goes_the_wrong_way_stalls():
    times = np.arange(100) * PERIOD
    assert first_stall(StallWatch(1e-3, 0.5), np.full(100, 0.005), -0.01 * times) is not None


@given(st.lists(st.floats(-0.9e-3, 0.9e-3), min_size=1, max_size=200))
def test_within_the_tolerance_nothing_stalls(errors):
    assert first_stall(StallWatch(1e-3, 0.1), np.zeros(len(errors)), errors) is None


@given(st.floats(0.0, 0.05), st.floats(0.1, 1.0))
def test_a_servo_that_never_moves_is_found_within_its_time(place, patience):
    steps = math.ceil(patience / PERIOD) + 2
    setpoints = np.full(steps, place + 0.002)
    assert first_stall(StallWatch(1e-3, patience), setpoints, np.full(steps, place)) is not None


def test_forgets_when_told_and_when_the_clock_goes_back():
    watch = StallWatch(1e-3, 0.5)
    assert not watch.stalled(0.01, 0.0, 10.0)
    assert not watch.stalled(0.01, 0.0, 3.0)
    assert not watch.stalled(0.01, 0.0, 3.4)
    watch.reset()
    assert not watch.stalled(0.01, 0.0, 3.6)
    assert watch.stalled(0.01, 0.0, 4.2)


@pytest.mark.parametrize("setpoint", [math.nan, 0.01])
def test_what_is_not_measured_does_not_stall(setpoint):
    watch = StallWatch(1e-3, 0.1)
    assert first_stall(watch, [setpoint] * 50, [math.nan] * 50) is None
