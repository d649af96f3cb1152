# SPDX-License-Identifier: Apache-2.0
"""The wanted shape: what is taken, and what is refused by how much."""

from __future__ import annotations

import math

import numpy as np
import pytest
from model.fingers import make_finger, straight_cable

from ccr_ros.design.target import DesiredShape
from ccr_ros.model import InvalidValue, solve

STRAIGHT = np.linspace([0, 0, 0], [0, 0, 0.182], 10)
UP = np.tile([0.0, 0.0, 1.0], (10, 1))


def changed(array: np.ndarray, index: object, value: object) -> np.ndarray:
    array = array.copy()
    array[index] = value
    return array


def turned(angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])


def test_points_alone():
    shape = DesiredShape(STRAIGHT.tolist())
    assert shape.segments == 9 and shape.frames is None and shape.tangents is None
    shape.check_fits(make_finger())
    with pytest.raises(ValueError):
        shape.points[0, 0] = 1.0
    given = STRAIGHT.copy()
    kept = DesiredShape(given)
    given[3] = 0.5
    assert np.array_equal(kept.points, STRAIGHT)


def test_frames_bring_their_tangents():
    shape = DesiredShape(STRAIGHT, np.tile(np.eye(3), (10, 1, 1)))
    assert np.array_equal(shape.tangents, UP)


def test_shape_of_a_pose_and_its_errors():
    finger = make_finger()
    solution = solve(finger, [0.006])
    shape = DesiredShape.of(solution)
    shape.check_fits(finger)
    assert np.array_equal(shape.points, solution.backbone)
    assert np.array_equal(shape.frames, solution.frames)
    centres = DesiredShape.of(solution, frames=False)
    assert centres.frames is None and np.array_equal(centres.tangents, shape.tangents)
    off = solution.backbone + np.array([0.0, 3e-4, 4e-4])
    assert shape.errors(off) == pytest.approx(np.full(10, 5e-4))
    assert shape.squared_error(off) == pytest.approx(10 * 25e-8)


@pytest.mark.parametrize(
    ("values", "place", "words"),
    [
        ({"points": 3}, "points", "at least 3 items of 3 finite numbers"),
        ({"points": STRAIGHT[:2]}, "points", "at least 3"),
        ({"points": STRAIGHT[:, :2]}, "points", "shape (10, 2)"),
        ({"points": [[0, 0, 0], [0, 0]]}, "points", "finite numbers"),
        ({"points": [["a", 0, 0]] * 3}, "points", "finite numbers"),
        ({"points": changed(STRAIGHT, (4, 1), math.nan)}, "points[4][1]", "a finite number"),
        ({"points": changed(STRAIGHT, (4, 1), -math.inf)}, "points[4][1]", "a finite number"),
        ({"points": STRAIGHT + np.array([0.003, 0, 0])}, "points[0]", "it is 3 mm away"),
        ({"tangents": UP[:9]}, "tangents", "10 items of 3"),
        ({"tangents": 2 * UP}, "tangents[0]", "of length 1 (it is 2)"),
        ({"tangents": UP @ turned(0.1).T[[2, 0, 1]]}, "tangents[0]", "it is 90 deg off"),
        ({"tangents": -UP}, "tangents[0]", "it is 180 deg off"),
        ({"frames": np.zeros((10, 3, 3))}, "frames[0]", "a rotation matrix (it is 1 off)"),
        ({"frames": np.tile(np.diag([1, 1, -1.0]), (10, 1, 1))}, "frames[0]", "it is 2 off"),
        ({"frames": np.tile(turned(0.1), (10, 1, 1))}, "frames[0]", "turned by 5.73 deg"),
        ({"frames": np.tile(np.eye(3), (9, 1, 1))}, "frames", "10 items of 3 x 3"),
        ({"frames": np.tile(np.eye(3), (10, 1, 1)), "tangents": UP}, "tangents", "left out"),
    ],
)
def test_refused(values, place, words):
    with pytest.raises(InvalidValue) as caught:
        DesiredShape(**({"points": STRAIGHT} | values))
    assert caught.value.place == place
    assert words in str(caught.value)


def test_points_that_no_finger_of_this_length_can_span():
    shape = DesiredShape(changed(STRAIGHT, 5, STRAIGHT[5] + np.array([0.001, 0, 0])))
    with pytest.raises(InvalidValue, match=r"points\[5\].*it is 0.0247102 mm farther"):
        shape.check_fits(make_finger())
    with pytest.raises(InvalidValue, match=r"9 points, one per disk of finger 'finger' \(got 10\)"):
        DesiredShape(STRAIGHT).check_fits(make_finger(straight_cable(4, 9), segments=8))
