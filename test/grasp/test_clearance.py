# SPDX-License-Identifier: Apache-2.0
"""Gaps between disks: known ones, brute force, bounds from below, and a whole gripper."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ccr_ros.grasp.clearance import TOLERANCE, _at_least, _Disks, _nearest_pair, disk_clearance
from ccr_ros.model import InvalidValue, Pose, load_gripper, solve
from ccr_ros.resources import find_config

X, Z = np.eye(3)[0], np.eye(3)[2]
R = 0.01


def gap(center, axis, other_axis=Z, radius=R):
    disks = _Disks(
        np.array([np.zeros(3), center]), np.array([other_axis, axis]), np.array([R, radius])
    )
    _, _, points = _nearest_pair(disks, np.array([0]), np.array([1]))
    return float(np.linalg.norm(points[1] - points[0])), disks, points


@pytest.mark.parametrize(
    ("center", "axis", "expected"),
    [
        ([0.03, 0, 0], Z, 0.01),  # side by side in a plane
        ([0.005, 0, 0.004], Z, 0.004),  # face to face
        ([0.023, 0, 0.004], Z, 0.005),  # rim to rim
        ([0, 0, 0.012], X, 0.002),  # on edge over the middle
        ([0.015, 0, 0.0], X, 0.005),  # on edge beside the rim
        ([0.021, 0, 0.001], [0.6, 0, 0.8], 0.0074),  # leaning over the rim
        ([0.005, 0, 0.002], X, 0.0),  # cut through
        ([0.02, 0, 0.0], Z, 0.0),  # touching
        ([0, 0, 0], Z, 0.0),  # the same
    ],
)
def test_known_gaps(center, axis, expected):
    found, disks, points = gap(center, axis)
    assert found == pytest.approx(expected, abs=2 * TOLERANCE)
    for center, axis, point in zip(disks.centers, disks.axes, points, strict=True):
        assert abs((point - center) @ axis) < 1e-12
        assert np.linalg.norm(point - center) <= R + 1e-12


numbers = st.floats(-1, 1)
vectors = st.tuples(numbers, numbers, numbers).map(np.array)
units = vectors.filter(lambda v: np.linalg.norm(v) > 0.1).map(lambda v: v / np.linalg.norm(v))


@settings(derandomize=True, max_examples=100, deadline=None)
@given(center=vectors, axis=units, other_axis=units, radius=st.floats(0.002, 0.02))
def test_gaps_against_brute_force_and_from_below(center, axis, other_axis, radius):
    found, disks, points = gap(0.03 * center, axis, other_axis, radius)
    if found > TOLERANCE:  # no plane between them is wider: it is the least distance
        below = _at_least(disks[[0]], disks[[1]], points[:1], points[1:])[0]
        assert found - 2 * TOLERANCE <= below <= found + 1e-12
    angles, shares = np.meshgrid(np.linspace(0, 2 * np.pi, 37), np.linspace(0, 1, 9))
    grids = []
    for k in range(2):
        u = np.cross(disks.axes[k], np.eye(3)[np.argmin(np.abs(disks.axes[k]))])
        u /= np.linalg.norm(u)
        v = np.cross(disks.axes[k], u)
        flat = (disks.radii[k] * shares).ravel()[:, None]
        turn = angles.ravel()[:, None]
        grids.append(disks.centers[k] + flat * (np.cos(turn) * u + np.sin(turn) * v))
    brute = np.linalg.norm(grids[0][:, None] - grids[1][None], axis=2).min()
    assert found <= brute + TOLERANCE
    assert brute <= found + 0.2 * max(R, radius)  # the samples are so far apart


@pytest.fixture(scope="module")
def gripper():
    return load_gripper(find_config("gripper_sphere"))


def posed(gripper, percent):
    finger = gripper.fingers[0].finger
    pulls = [percent / 100 * finger.length]
    return [solve(m.finger, pulls).require_converged() for m in gripper.fingers]


def test_an_open_gripper_is_nearest_at_its_neighbouring_disks_of_one_finger(gripper):
    bases = [m.base for m in gripper.fingers]
    found = disk_clearance(posed(gripper, 0.0), bases)
    finger = gripper.fingers[0].finger
    assert found.fingers[0] == found.fingers[1] and found.disks[1] - found.disks[0] == 2
    assert finger.segment_length < found.gap < 2 * finger.segment_length
    assert not found.touching and "mm apart" in found.in_words()


def test_closing_without_an_object_fingers_come_near_each_other_and_meet(gripper):
    bases = [m.base for m in gripper.fingers]
    solutions = posed(gripper, 4.3)
    found = disk_clearance(solutions, bases)
    assert found.fingers[0] != found.fingers[1]
    # All fingers do the same: a turn by 120 degrees gives the same gap, a rim less of it.
    turned = disk_clearance([*solutions[1:], solutions[0]], [*bases[1:], bases[0]])
    assert turned.gap == pytest.approx(found.gap, abs=2 * TOLERANCE)
    wide = disk_clearance(solutions, bases, rim=0.0015)
    assert wide.gap <= found.gap - 0.001
    for name, disk, point in zip(found.fingers, found.disks, found.points, strict=True):
        k = next(i for i, s in enumerate(solutions) if s.finger.name == name)
        away = bases[k].points(solutions[k].backbone[disk]) - point
        assert np.linalg.norm(away) <= solutions[k].finger.disk_radius + 1e-9
    # Moved onto each other they meet, and it is said which.
    onto = disk_clearance(solutions, [bases[0], bases[0], bases[2]])
    assert onto.touching and onto.gap == 0.0 and onto.in_words().endswith("meet")
    assert set(onto.fingers) == {"finger_1", "finger_2"} and onto.disks[0] == onto.disks[1] == 0


def test_a_finger_rolled_up_meets_itself(gripper):
    solution = posed(gripper, 0.0)[0]
    turn = np.linspace(0, 2 * np.pi, len(solution.backbone))
    ring = 0.03 * np.stack([1 - np.cos(turn), 0 * turn, np.sin(turn)], axis=1)
    across = np.stack([np.cos(turn), 0 * turn, -np.sin(turn)], axis=1)
    along = np.stack([np.sin(turn), 0 * turn, np.cos(turn)], axis=1)
    frames = np.stack([across, np.tile([0.0, 1.0, 0.0], (len(turn), 1)), along], axis=2)
    found = disk_clearance([replace(solution, backbone=ring, frames=frames)], [Pose()])
    assert found.touching and found.disks == (0, len(turn) - 1)
    assert found.in_words() == f"disks 0 and {len(turn) - 1} of finger_1 meet"


def test_bad_values_are_refused(gripper):
    solutions = posed(gripper, 0.0)
    bases = [m.base for m in gripper.fingers]
    for few in ([], bases[:2]):
        with pytest.raises(InvalidValue, match="bases"):
            disk_clearance(solutions, few)
    with pytest.raises(InvalidValue, match="bases"):
        disk_clearance([], [])
    for rim in (-1e-3, np.nan, "wide"):
        with pytest.raises(InvalidValue, match="rim"):
            disk_clearance(solutions, bases, rim)
