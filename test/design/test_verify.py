# SPDX-License-Identifier: Apache-2.0
"""Pulling from rest: what is reached, and what happens on the way."""

from __future__ import annotations

import numpy as np
import pytest
from model.fingers import make_finger, straight_cable

from ccr_ros.design.target import DesiredShape
from ccr_ros.design.verify import pull_from_rest
from ccr_ros.model import FingerSolver, InvalidValue, Sphere, load_finger, solve
from ccr_ros.resources import find_config


def test_a_pose_is_reached_again():
    finger = make_finger()
    pose = solve(finger, [0.006])
    path = pull_from_rest(finger, np.array([0.006]), DesiredShape.of(pose), steps=5)
    assert path.reached and path.smooth and path.completed and not path.unstable
    assert path.squared_error < 1e-18 and len(path.steps) == 6 and path.wanted == 5
    assert not path.steps[0].tensions.any()
    assert [s.pulls[0] for s in path.steps] == pytest.approx(np.linspace(0, 0.006, 6))


def test_another_shape_is_not_reached_unless_tolerated():
    finger = make_finger()
    shape = DesiredShape.of(solve(finger, [0.006]))
    path = pull_from_rest(finger, np.array([0.0061]), shape)
    assert path.completed and not path.reached and not path.smooth
    assert path.squared_error == pytest.approx(shape.squared_error(path.last.backbone))
    assert pull_from_rest(finger, np.array([0.0061]), shape, 2, tolerance=1e-5).reached


def test_a_pull_too_far_ends_the_path_and_says_where():
    finger = load_finger(find_config("general_1"))
    rest = FingerSolver(finger).rest
    pulls = 0.99 * FingerSolver(finger).rest_lengths
    path = pull_from_rest(finger, pulls, DesiredShape.of(rest), steps=4)
    assert not path.completed and not path.reached and "Pull less" in path.message
    assert len(path.steps) <= 5 and path.last.certificate.converged is False


def test_a_snap_to_another_branch_is_told():
    """Pulled over a ball the finger presses harder on it, over saddles, until it slips off."""
    ball = Sphere([0.0, 0.04, 0.15], 0.02, name="ball")
    finger = make_finger(straight_cable(), obstacles=(ball,))
    wanted = DesiredShape.of(solve(make_finger(straight_cable()), [0.012]))
    path = pull_from_rest(finger, np.array([0.012]), wanted, steps=12, tolerance=1e-3)
    assert len(path.jumps) == 1 and 0.3 < path.jumps[0] < 1
    assert path.unstable and max(path.unstable) < path.jumps[0]
    assert path.reached and not path.smooth


def test_obstacles_act_from_the_first_step():
    ball = Sphere([0.03, 0.0, 0.1], 0.031, name="ball")  # where the straight finger stands
    finger = make_finger(straight_cable(1), obstacles=(ball,))
    path = pull_from_rest(finger, np.array([0.0]), DesiredShape.of(solve(finger, [0.0])), steps=1)
    assert path.steps[0].contacts and path.reached


def test_bad_values():
    finger = make_finger()
    shape = DesiredShape.of(solve(finger, [0.0]))
    with pytest.raises(InvalidValue, match="steps"):
        pull_from_rest(finger, np.zeros(1), shape, steps=0)
    with pytest.raises(InvalidValue, match=r"pulls\.helical"):
        pull_from_rest(finger, np.array([np.nan]), shape)
