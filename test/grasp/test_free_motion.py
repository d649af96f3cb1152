# SPDX-License-Identifier: Apache-2.0
"""The free finger's tensions and gap along its pull path."""

from dataclasses import replace

import numpy as np
import pytest

from ccr_ros.grasp.free_motion import free_motion
from ccr_ros.grasp.pull_path import pull_path
from ccr_ros.model import FingerSolver, InvalidValue, MountedFinger, Pose, load_gripper
from ccr_ros.resources import find_config

FINGERS = load_gripper(find_config("gripper_sphere")).fingers
PATH = pull_path(FINGERS[0].finger, None, None)


@pytest.fixture(scope="module")
def free():
    return free_motion(FINGERS[1], PATH)


def test_tensions_are_the_models(free):
    solver = FingerSolver(FINGERS[1].finger)
    for place in np.linspace(0.0, PATH.length, 29)[1:]:
        truth = solver.solve(PATH.pulls(place)).tensions
        np.testing.assert_allclose(free.tensions_at(place), truth, rtol=2e-3)


def test_gap_is_twice_the_way_from_the_axis_to_the_nearest_point_of_the_tip(free):
    mounted = FINGERS[1]
    solution = FingerSolver(mounted.finger).solve(PATH.pulls(PATH.length))
    cable, center = solution.cables["main"][-1], solution.backbone[-1]
    tip = mounted.base.points(np.array([center, cable, 2 * center - cable]))
    assert free.gap_at(PATH.length) == pytest.approx(2 * np.hypot(*tip[:, :2].T).min(), rel=1e-6)
    assert free.gaps[0] > free.gaps[-1] > 0.0


def test_fingers_alike_have_a_gap_alike(free):
    for mounted in FINGERS:
        np.testing.assert_allclose(free_motion(mounted, PATH).gaps, free.gaps, atol=1e-6)


def test_place_of_gap_is_its_inverse(free):
    for gap in np.linspace(free.gaps[-1], free.gaps[0], 20):
        assert free.gap_at(free.place_of_gap(gap)) == pytest.approx(gap, abs=1e-9)
    assert free.place_of_gap(1.0) == 0.0
    assert free.place_of_gap(0.0) == PATH.length


def test_forces_in_newtons_are_wanted():
    soft = MountedFinger(replace(FINGERS[0].finger, youngs_modulus=None), FINGERS[0].base)
    with pytest.raises(InvalidValue, match=r"finger_1\.youngs_modulus"):
        free_motion(soft, PATH)


def test_a_finger_on_the_axis_has_no_gap():
    central = MountedFinger(FINGERS[0].finger, Pose(np.array([0.0, 0.0, 0.1])))
    with pytest.raises(InvalidValue, match="beside the gripper's axis"):
        free_motion(central, PATH)
