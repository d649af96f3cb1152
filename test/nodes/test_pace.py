# SPDX-License-Identifier: Apache-2.0
"""At most so many calls per second, and the last one never left out."""

import pytest
from rclpy.clock import Clock, ClockType

from ccr_ros.nodes.pace import Pace


@pytest.fixture
def calls():
    return []


@pytest.fixture
def make(probe, calls):
    def make(rate):
        clock = Clock(clock_type=ClockType.STEADY_TIME)
        return Pace(probe.node, rate, clock, lambda: calls.append(len(calls)))

    return make


def test_the_first_change_is_told_at_once_and_the_others_not_yet(make, calls):
    pace = make(0.01)
    assert pace.free and not calls
    for _ in range(5):
        pace.changed()
        assert len(calls) == 1 and not pace.free


def test_what_had_to_wait_is_told_once(make, calls, probe):
    pace = make(20.0)
    for _ in range(5):
        pace.changed()
    probe.until(lambda: len(calls) == 2, "the second call")
    probe.until(lambda: pace.free, "an end of waiting")
    assert len(calls) == 2
    pace.changed()
    assert len(calls) == 3
