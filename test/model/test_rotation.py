# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ccr_ros.model import InvalidValue, Pose
from ccr_ros.model.rotation import cross, matrix_from_quaternion, quaternion_from_matrix, skew

deterministic = settings(derandomize=True, max_examples=40, deadline=None)
number = st.floats(-1, 1)
vectors = st.tuples(number, number, number).map(np.array)
quaternions = (
    st.tuples(number, number, number, number)
    .map(np.array)
    .filter(lambda q: np.linalg.norm(q) > 0.1)
    .map(lambda q: q / np.linalg.norm(q))
)
poses = st.builds(Pose, vectors, quaternions)
POINTS = np.array([[0.1, 0.2, 0.3], [-1.0, 0.5, 0.0], [0.0, 0.0, 0.0]])
AXES = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [1, 1, 0], [1, -2, 3], [-1, -1, -1]]


def rodrigues(axis, angle):
    """Rotation matrix about an axis, column by column from Rodrigues' formula."""
    axis = np.array(axis) / np.linalg.norm(axis)
    c, s = np.cos(angle), np.sin(angle)
    turned = [c * e + s * np.cross(axis, e) + (1 - c) * axis * np.dot(axis, e) for e in np.eye(3)]
    return np.column_stack(turned)


def assert_same_rotation(a, b, atol=1e-12):
    assert min(np.abs(a - b).max(), np.abs(a + b).max()) < atol


@deterministic
@given(quaternions)
def test_matrices_are_rotations(q):
    matrix = matrix_from_quaternion(q)
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(matrix) == pytest.approx(1, abs=1e-14)


@deterministic
@given(vectors.filter(lambda v: np.linalg.norm(v) > 0.01), st.floats(-np.pi, np.pi))
def test_matrices_follow_rodrigues(axis, angle):
    q = np.append(np.sin(angle / 2) * axis / np.linalg.norm(axis), np.cos(angle / 2))
    np.testing.assert_allclose(matrix_from_quaternion(q), rodrigues(axis, angle), atol=1e-14)


@deterministic
@given(quaternions)
def test_round_trip(q):
    back = quaternion_from_matrix(matrix_from_quaternion(q))
    assert_same_rotation(back, q)
    assert back[3] >= 0 and np.linalg.norm(back) == pytest.approx(1, abs=1e-15)


@pytest.mark.parametrize("degrees", [0, 1e-7, 90, 120, 179.9999999, 180, 180.0000001, 270, 360])
@pytest.mark.parametrize("axis", AXES, ids=str)
def test_round_trip_at_hard_angles(axis, degrees):
    matrix = rodrigues(axis, np.radians(degrees))
    q = quaternion_from_matrix(matrix)
    np.testing.assert_allclose(matrix_from_quaternion(q), matrix, atol=1e-14)
    assert q[3] >= 0


def test_many_at_once_are_as_one_by_one():
    draw = np.random.default_rng(1)
    turns = [rodrigues(draw.normal(size=3), draw.uniform(-np.pi, np.pi)) for _ in range(24)]
    matrices = np.reshape(turns, (2, 3, 4, 3, 3))
    q = quaternion_from_matrix(matrices)
    assert q.shape == (2, 3, 4, 4)
    for i in np.ndindex(2, 3, 4):
        np.testing.assert_array_equal(q[i], quaternion_from_matrix(matrices[i]))


@deterministic
@given(vectors, vectors)
def test_skew_and_cross(a, b):
    np.testing.assert_array_equal(cross(a, b), np.cross(a, b))
    np.testing.assert_allclose(skew(a) @ b, np.cross(a, b), atol=1e-15)
    stack = np.array([a, b])
    assert skew(stack).shape == (2, 3, 3)
    np.testing.assert_array_equal(cross(stack, b), np.cross(stack, b))


def test_right_handed_quarter_turns():
    half = np.sqrt(0.5)
    for axis, source, target in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        q = np.zeros(4)
        q[axis], q[3] = half, half
        turned = Pose(np.zeros(3), q).vectors(np.eye(3)[source])
        np.testing.assert_allclose(turned, np.eye(3)[target], atol=1e-15)


@deterministic
@given(poses, poses)
def test_composition_is_one_after_the_other(a, b):
    np.testing.assert_allclose((a @ b).points(POINTS), a.points(b.points(POINTS)), atol=1e-12)
    np.testing.assert_allclose((a @ b).vectors(POINTS), a.vectors(b.vectors(POINTS)), atol=1e-12)


@deterministic
@given(poses, poses, poses)
def test_composition_is_associative(a, b, c):
    left, right = (a @ b) @ c, a @ (b @ c)
    np.testing.assert_allclose(left.position, right.position, atol=1e-12)
    assert_same_rotation(left.orientation, right.orientation)


@deterministic
@given(poses)
def test_inverse(pose):
    for unit in (pose @ pose.inverse(), pose.inverse() @ pose):
        np.testing.assert_allclose(unit.position, 0, atol=1e-13)
        assert_same_rotation(unit.orientation, np.array([0, 0, 0, 1]))
    np.testing.assert_allclose(pose.inverse().points(pose.points(POINTS)), POINTS, atol=1e-13)


def test_the_default_pose_changes_nothing():
    np.testing.assert_array_equal(Pose().points(POINTS), POINTS)


def test_poses_check_and_freeze_their_values():
    pose = Pose([1, 2, 3], [0, 0, 0.005, 1])
    assert np.linalg.norm(pose.orientation) == pytest.approx(1, abs=1e-15)
    with pytest.raises(ValueError, match="read-only"):
        pose.position[0] = 9
    for bad in ([0, 0, 0, 0], [0, 0, 0, 1.02], [0, 0, 0, -0.98], [1, 0, 0], "abcd", [np.nan] * 4):
        with pytest.raises(InvalidValue) as caught:
            Pose([0, 0, 0], bad)
        assert caught.value.place.startswith("orientation")
    for bad in ([0, 0], [0, 0, np.inf], 3, None, np.array(1.0), np.zeros((3, 1)), [0, 0, True]):
        with pytest.raises(InvalidValue) as caught:
            Pose(bad)
        assert caught.value.place.startswith("position")
