# SPDX-License-Identifier: Apache-2.0
"""Gaps of round-rimmed disks: known ones, other ways to them, derivatives, degenerate poses."""

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from ccr_ros.grasp.clearance import _Disks, _nearest_pair
from ccr_ros.grasp.statics.disk_distance import (
    DOME,
    Disks,
    between,
    gaps_at_least,
    nearest,
    second_derivatives,
)

# The same examples on any machine, however busy.
STEADY = {
    "derandomize": True,
    "deadline": None,
    "suppress_health_check": [HealthCheck.too_slow],
}
R, E = 0.01, 0.001
TURN_X = Rotation.from_euler("y", 90, degrees=True).as_matrix()  # z axis to x
FLAT = np.eye(3)

turns = st.tuples(*[st.floats(-np.pi, np.pi)] * 3).map(
    lambda v: Rotation.from_rotvec(v).as_matrix()
)
places = st.tuples(*[st.floats(-1, 1)] * 3).map(np.array)
radii = st.floats(0.004, 0.02)
motions = st.tuples(*[st.floats(-1, 1)] * 12).map(np.array)


def disks(*poses, core=R - E, edge=E):
    """Disks at (center, frame) pairs."""
    centers, frames = zip(*poses, strict=True)
    count = len(poses)
    cores = np.broadcast_to(core, count).astype(float)
    return Disks(np.array(centers, float), np.array(frames), cores, np.full(count, edge))


def pair(center, frame, other_frame=FLAT):
    return disks((np.zeros(3), other_frame)), disks((center, frame))


@pytest.mark.parametrize(
    ("center", "frame", "expected", "normal"),
    [
        ([0.025, 0, 0], FLAT, 0.005, [1, 0, 0]),  # side by side in a plane
        ([0.005, 0, 0.006], FLAT, 0.004, [0, 0, 1]),  # face to face
        ([0.021, 0, 0.004], FLAT, 0.003, [0.6, 0, 0.8]),  # rim over rim
        ([0, 0, 0.013], TURN_X, 0.002, [0, 0, 1]),  # on edge over the middle
        ([0.0195, 0, 0], FLAT, -0.0005, [1, 0, 0]),  # rims a little in each other
        ([0.003, 0, 0.0015], FLAT, -0.0005, [0, 0, 1]),  # faces a little in each other
    ],
)
def test_known_gaps(center, frame, expected, normal):
    found = nearest(*pair(center, frame))
    dome = DOME * R  # what faces may be thicker
    assert expected - dome <= found.gaps[0] <= expected + 1e-15
    assert found.normals[0] == pytest.approx(normal, abs=DOME)
    assert not found.cut[0]


def test_parallel_faces_meet_in_the_middle_of_what_overlaps():
    found = nearest(*pair([0.007, 0.004, 0.003], FLAT))
    assert found.touch[0] == pytest.approx([0.0035, 0.002, 0.0015], abs=1e-12)


@pytest.mark.parametrize("center", [[0.0, 0.0, 0.004], [0.0, 0.0, 0.0]])
def test_coaxial_and_equal_disks_have_numbers_for_all(center):
    one, other = pair(center, FLAT)
    found = nearest(one, other)
    assert np.isfinite(found.points).all() and np.isfinite(found.normals).all()
    assert np.isfinite(second_derivatives(one, other, found)).all()
    assert found.cut[0] == (center[2] == 0.0)


def test_disks_through_each_other_say_how_far_and_push_apart():
    one, other = pair([0.015, 0, 0.0], Rotation.from_euler("x", 40, degrees=True).as_matrix())
    found = nearest(one, other)
    assert found.cut[0] and found.normals[0] == pytest.approx([1, 0, 0])
    assert found.gaps[0] == pytest.approx(0.015 - 2 * R, abs=1e-12)
    assert np.abs(second_derivatives(one, other, found)).max() == 0.0


@pytest.mark.parametrize("way", [0.0, 4.5e-277, 1e-150, 1e-13])
def test_disks_in_one_place_cut_each_other(way):
    one, other = pair([0.0, way, 0.0], FLAT)
    found = nearest(one, other)
    assert found.cut[0] and np.linalg.norm(found.normals[0]) == pytest.approx(1.0)
    assert -4 * E < found.gaps[0] < 0.0
    assert gaps_at_least(one, other)[0] <= found.gaps[0]


@settings(max_examples=40, **STEADY)
@given(center=places, frame=turns, other_frame=turns, radius=radii)
def test_gaps_against_projections_and_bounds(center, frame, other_frame, radius):
    one = disks((np.zeros(3), other_frame))
    other = disks((0.035 * center, frame), core=radius)
    found = nearest(one, other)
    flat = _Disks(
        np.array([np.zeros(3), 0.035 * center]),
        np.array([other_frame[:, 2], frame[:, 2]]),
        np.array([R - E, radius]),
    )
    _, _, points = _nearest_pair(flat, np.array([0]), np.array([1]))
    apart = np.linalg.norm(points[1] - points[0])
    assert gaps_at_least(one, other)[0] <= found.gaps[0] + 1e-12
    if found.cut[0]:
        assert apart < 2e-5
    else:  # never more than it is, and less by the domes alone
        dome = 0.5 * DOME * (R - E + radius)
        assert found.gaps[0] <= apart - 2 * E + 1e-9
        assert found.gaps[0] >= apart - 2e-6 - 2 * E - dome


@settings(max_examples=25, **STEADY)
@given(center=places, frame=turns, radius=radii)
def test_nearest_points_against_an_optimiser(center, frame, radius):
    one, other = disks((np.zeros(3), FLAT)), disks((0.05 * center, frame), core=radius)
    found = nearest(one, other)
    assume(found.apart[0] > 1e-3)
    cores = np.array([R - E, radius])

    def cost(p):
        way = 0.05 * center + frame[:, :2] @ p[2:] - np.append(p[:2], 0.0)
        dome = 0.5 * DOME * (p[:2] @ p[:2] / cores[0] + p[2:] @ p[2:] / cores[1] - cores.sum())
        return (np.linalg.norm(way) + dome) * 1e2

    inside = [
        {"type": "ineq", "fun": lambda p, k=k: 1 - p[2 * k : 2 * k + 2] @ p[2 * k : 2 * k + 2]
         / cores[k] ** 2} for k in range(2)
    ]  # fmt: skip
    best = minimize(cost, np.zeros(4), method="SLSQP", constraints=inside,
                    options={"ftol": 1e-14, "maxiter": 300})  # fmt: skip
    assert found.gaps[0] + 2 * E <= best.fun * 1e-2 + 1e-7
    assert found.gaps[0] + 2 * E >= best.fun * 1e-2 - 1e-6


def test_a_start_does_not_matter():
    rng = np.random.default_rng(0)
    count = 200
    one, other = (
        Disks(0.02 * rng.normal(size=(count, 3)), Rotation.random(count, random_state=rng)
              .as_matrix(), rng.uniform(0.004, 0.02, count), np.full(count, E))
        for _ in range(2)
    )  # fmt: skip
    cold = nearest(one, other)
    start = 0.02 * rng.normal(size=(count, 4))
    start[::3] = np.nan
    warm = nearest(one, other, start)
    whole = ~cold.cut
    assert whole.sum() > 100 and (cold.cut == warm.cut).all()
    assert np.abs(warm.points - cold.points)[whole].max() < 1e-10
    assert np.abs(warm.gaps - cold.gaps)[whole].max() < 1e-14


@settings(max_examples=30, **STEADY)
@given(center=places, frame=turns, other_frame=turns, place=places, turn=turns)
def test_rigid_motion_and_exchange(center, frame, other_frame, place, turn):
    one, other = disks((np.zeros(3), other_frame)), disks((0.03 * center, frame), core=0.006)
    found = nearest(one, other)
    assume(found.apart[0] > 1e-4)
    swapped = nearest(other, one)
    assert swapped.gaps[0] == pytest.approx(found.gaps[0], abs=1e-13)
    assert swapped.normals[0] == pytest.approx(-found.normals[0], abs=1e-7)
    moved = nearest(
        *(
            Disks(d.centers @ turn.T + place, turn @ d.frames, d.cores, d.edges)
            for d in (one, other)
        )
    )
    assert moved.gaps[0] == pytest.approx(found.gaps[0], abs=1e-12)
    assert moved.normals[0] == pytest.approx(turn @ found.normals[0], abs=1e-6)
    # No rigid motion of both changes the gap, to second order.
    second = second_derivatives(one, other, found)[0]
    for k in range(6):
        spin, shift = np.eye(6)[k, :3], np.eye(6)[k, 3:]
        a, b = found.points[0]
        both = np.concatenate([spin, shift, spin, shift + np.cross(spin, b - a)])
        # b turns about a: it accelerates towards it, which is the points' own part
        own = found.normals[0] @ np.cross(spin, np.cross(spin, b - a))
        assert both @ second @ both + own == pytest.approx(0.0, abs=1e-6 * np.abs(second).max())


def moved(disks, points, motion, size):
    """Disks after a turn about their points and a shift, of 6 numbers each."""
    turn = Rotation.from_rotvec(size * motion[:3]).as_matrix()
    centers = (disks.centers - points) @ turn.T + points + size * motion[3:] * R
    return Disks(centers, turn @ disks.frames, disks.cores, disks.edges)


@settings(max_examples=80, **STEADY)
@given(center=places, frame=turns, other_frame=turns, motion=motions)
def test_derivatives_against_differences(center, frame, other_frame, motion):
    one, other = disks((np.zeros(3), other_frame)), disks((0.03 * center, frame), core=0.007)
    found = nearest(one, other)
    assume(found.apart[0] > 1e-3)
    a, b = found.points[:, 0], found.points[:, 1]

    def at(size):
        return nearest(
            moved(one, a, motion[:6], size), moved(other, b, motion[6:], size), found.places
        )

    size = 1e-5
    ahead, back = at(size), at(-size)
    rims = [
        np.linalg.norm(n.places.reshape(2, 2), axis=1) >= np.array([R - E, 0.007]) * (1 - 1e-9)
        for n in (ahead, back)
    ]
    assume((rims[0] == rims[1]).all())  # the second derivative jumps where a place leaves a rim
    slope = found.normals[0] @ (motion[9:] - motion[3:6]) * R
    assert (ahead.gaps[0] - back.gaps[0]) / (2 * size) == pytest.approx(slope, abs=1e-8)
    speed = motion.copy()
    speed[3:6] *= R
    speed[9:] *= R
    second = second_derivatives(one, other, found)[0]

    def rate(near):  # the first derivative along the motion, at a pose on it
        spin = [motion[:3], motion[6:9]]
        shift = [speed[3:6], speed[9:]]
        sign = size if near is ahead else -size
        pivot = [a[0] + sign * speed[3:6], b[0] + sign * speed[9:]]
        v = [s + np.cross(w, x - p) for s, w, x, p in zip(shift, spin, near.points[0], pivot,
                                                          strict=True)]  # fmt: skip
        return near.normals[0] @ (v[1] - v[0])

    expected = (rate(ahead) - rate(back)) / (2 * size)
    bound = 1e-5 * (1 + np.abs(second).max() * R)
    assert speed @ second @ speed == pytest.approx(expected, abs=bound, rel=1e-4)


def test_disks_on_their_way_are_disks():
    start = disks((np.zeros(3), FLAT))
    end = disks(([0.01, 0, 0], Rotation.from_euler("yz", [50, 20], degrees=True).as_matrix()))
    assert np.allclose(between(start, end, 0.0).frames, start.frames)
    assert np.allclose(between(start, end, 1.0).frames, end.frames)
    half = between(start, end, 0.5)
    assert half.centers[0] == pytest.approx([0.005, 0, 0])
    assert np.allclose(half.frames[0].T @ half.frames[0], FLAT)
    assert np.linalg.det(half.frames[0]) == pytest.approx(1.0)


def test_no_pairs_are_no_trouble():
    none = Disks(np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros(0), np.zeros(0))
    found = nearest(none, none)
    assert len(found.gaps) == 0 and second_derivatives(none, none, found).shape == (0, 12, 12)
