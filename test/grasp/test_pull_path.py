# SPDX-License-Identifier: Apache-2.0
"""Pull paths: places and pulls, and what is refused."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ccr_ros.grasp.pull_path import PullPath, pull_path
from ccr_ros.model import InvalidValue, load_finger
from ccr_ros.resources import find_config

ONE, TWO = (load_finger(find_config(name)) for name in ("sphere_finger", "two_cables"))


@given(st.floats(-0.01, 0.02))
def test_place_and_pulls_are_inverse(place):
    path = PullPath(np.array([0.001, -0.002]), np.array([0.005, 0.0]))
    assert path.length == pytest.approx(0.004)
    assert path.place(path.pulls(place)) == pytest.approx(place, abs=1e-12)


def test_ends():
    path = pull_path(TWO, [0.001, 0.0], [0.004, 0.006])
    np.testing.assert_allclose(path.pulls(0.0), [0.001, 0.0])
    np.testing.assert_allclose(path.pulls(path.length), [0.004, 0.006])
    assert path.length == pytest.approx(0.006)


def test_defaults_of_a_finger_with_one_cable():
    path = pull_path(ONE, None, None)
    assert path.open.tolist() == [0.0]
    assert path.closed.tolist() == [0.034 * 0.182]


@pytest.mark.parametrize(
    ("finger", "start", "end", "text"),
    [
        (TWO, None, None, r"two_cables\.closed_pulls: .*2 pulls \[m\], one per cable"),
        (TWO, None, [0.01], r"two_cables\.closed_pulls: .*2 numbers"),
        (ONE, [math.nan], None, r"sphere_finger\.open_pulls\.main: nan"),
        (ONE, None, [1.0], r"sphere_finger\.closed_pulls\.main: 1\.0"),
        (ONE, [0.005], [0.005], "unlike open_pulls"),
    ],
)
def test_refused(finger, start, end, text):
    with pytest.raises(InvalidValue, match=text):
        pull_path(finger, start, end)
