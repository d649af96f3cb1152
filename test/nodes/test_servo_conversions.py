# SPDX-License-Identifier: Apache-2.0
"""Messages of the servo bridge: what a command may say, and what a state tells."""

import math

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from ccr_msgs.msg import CablePulls, FingerState, ServoState
from hypothesis import given
from hypothesis import strategies as st

from ccr_ros.model import CcrError, InvalidValue, UnknownName
from ccr_ros.nodes.servo_conversions import (
    commands_from_message,
    servo_state_message,
    tensions_from_message,
)

CABLES = ("left", "right", "tip")
numbers = st.floats(allow_nan=True, allow_infinity=True)


@given(st.lists(numbers, min_size=3, max_size=3), st.permutations(CABLES))
def test_by_name_in_any_order_or_in_the_fingers(pulls, order):
    plain = commands_from_message(CablePulls(pulls=pulls), CABLES)
    assert list(plain) == list(CABLES)
    np.testing.assert_equal(list(plain.values()), pulls)
    by_name = dict(zip(CABLES, pulls, strict=True))
    named = CablePulls(names=list(order), pulls=[by_name[name] for name in order])
    np.testing.assert_equal(commands_from_message(named, CABLES), by_name)


@given(
    st.lists(st.sampled_from([*CABLES, "main", "", "left "]), max_size=5),
    st.lists(numbers, max_size=5),
)
def test_only_what_fits_is_taken(names, pulls):
    message = CablePulls(names=names, pulls=pulls)
    fits = len(pulls) == (len(names) or 3) and len(set(names)) == len(names) <= 3
    if fits and set(names) <= set(CABLES):
        assert set(commands_from_message(message, CABLES)) == set(names or CABLES)
    else:
        with pytest.raises(CcrError):
            commands_from_message(message, CABLES)


def test_errors_say_what_is_valid():
    with pytest.raises(UnknownName, match="unknown cable 'main'; valid: left, right, tip"):
        commands_from_message(CablePulls(names=["main"], pulls=[0.0]), CABLES)
    with pytest.raises(InvalidValue, match=r"3 numbers \[m\], one per cable: left, right, tip"):
        commands_from_message(CablePulls(pulls=[0.0]), CABLES)


def test_tensions_of_the_solver():
    message = FingerState(cables=["left", "tip"], tensions=[1.5, 0.0], forces_are="newton")
    assert tensions_from_message(message) == {"left": 1.5, "tip": 0.0}
    message.forces_are = FingerState.PER_EI
    assert all(math.isnan(tension) for tension in tensions_from_message(message).values())


def test_without_a_bridge_the_state_says_why():
    state = servo_state_message(Time(sec=7), None, "dynamixel", "no port")
    assert (state.state, state.driver, state.reason) == (
        ServoState.UNCONFIGURED,
        "dynamixel",
        "no port",
    )
    assert state.header.stamp.sec == 7 and state.fault == ServoState.NO_FAULT
