# SPDX-License-Identifier: Apache-2.0
"""Ferrari and Canny's measure against closed forms (derived in docs/grasp_quality.md)."""

import sys

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from quality_cases import CENTRE, EQUATOR, OCTAHEDRON, PINCH, fixture, moved, on_ball, scattered

from ccr_ros.grasp.quality import ferrari_canny, force_closure, wrench_in_words
from ccr_ros.grasp.quality.wrenches import contact_wrenches
from ccr_ros.model import InvalidValue, Pose
from ccr_ros.model.errors import MissingPackage

SEEDS = st.integers(0, 2**32 - 1)
FEW = settings(max_examples=15, suppress_health_check=[HealthCheck.too_slow])


def near(ball, value):
    assert ball.lower <= value * (1 + 1e-9) and value <= ball.upper * (1 + 1e-9)
    assert ball.lower <= ball.upper


@pytest.mark.parametrize("friction", [0.1, 0.3, 0.5, 1.0])
def test_six_contacts_on_the_axes_of_a_ball(friction):
    ball = ferrari_canny(on_ball(OCTAHEDRON, friction), CENTRE, tolerance=2e-4)
    near(ball, friction * np.sqrt(2 / 3))
    assert ball.upper - ball.lower <= 2e-4 * ball.upper
    assert np.allclose(np.abs(ball.weakest[3:]), np.sqrt(1 / 3), atol=0.02)  # about a diagonal
    assert "moment" in wrench_in_words(ball.weakest)


@pytest.mark.parametrize("friction", [0.2, 0.5, 1.5])
def test_three_contacts_on_the_equator_of_a_ball_with_limits_of_each(friction):
    ball = ferrari_canny(on_ball(EQUATOR, friction), CENTRE, norm="each", tolerance=0.02)
    near(ball, 3 * friction / np.sqrt(5))
    assert abs(ball.weakest[2]) == pytest.approx(np.sqrt(1 / 5), abs=0.05)


def test_without_force_closure_it_is_zero_and_says_what_is_not_balanced():
    for contacts in (on_ball(PINCH, 0.5), on_ball(EQUATOR, 0.0), []):
        ball = ferrari_canny(contacts, CENTRE)
        assert ball.lower == ball.upper == 0
        assert np.linalg.norm(ball.weakest) == pytest.approx(1)
    assert wrench_in_words(ferrari_canny(on_ball(PINCH, 0.5), CENTRE).weakest) in (
        "a moment about x", "a moment about -x",
    )  # fmt: skip


def test_seven_contacts_without_friction_hold_a_cube():
    ball = ferrari_canny(fixture(), CENTRE, tolerance=1e-3)
    assert 0 < ball.lower <= ball.upper <= 1.002 * ball.lower


@FEW
@given(SEEDS, st.sampled_from(["sum", "each"]))
def test_the_bounds_hold_the_truth(seed, norm):
    """No sampled direction is weaker than the lower bound; the upper one is that of `weakest`."""
    rng = np.random.default_rng(seed)
    contacts = scattered(rng, 4, 0.6)
    ball = ferrari_canny(contacts, CENTRE, norm=norm, tolerance=0.3, rounds=10)
    directions = rng.standard_normal((20_000, 6))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    directions = np.concatenate([directions, -ball.weakest[None]])
    reach, _ = contact_wrenches(contacts, CENTRE, ball.length).reach(directions)
    reach = np.maximum(reach, 0)
    reach = reach.max(axis=1) if norm == "sum" else reach.sum(axis=1)
    assert reach.min() >= ball.lower
    assert reach[-1] == pytest.approx(ball.upper, abs=1e-8)


@FEW
@given(SEEDS, st.integers(3, 6), st.floats(0.1, 1.0))
def test_it_is_above_zero_exactly_with_force_closure(seed, count, friction):
    contacts = scattered(np.random.default_rng(seed), count, friction)
    ball = ferrari_canny(contacts, CENTRE, tolerance=1.0, rounds=100)
    closed = force_closure(contacts, CENTRE).closed
    assert (ball.upper > 0) is closed
    assert (ball.lower > 0) is closed or ball.upper < 1e-3


@FEW
@given(SEEDS)
def test_a_rigid_motion_changes_nothing_and_a_size_only_the_length(seed):
    rng = np.random.default_rng(seed)
    contacts = scattered(rng, 5, 0.6)
    turn = rng.standard_normal(4)
    pose = Pose(rng.standard_normal(3), turn / np.linalg.norm(turn))
    one = ferrari_canny(contacts, CENTRE, tolerance=0.05)
    two = ferrari_canny(moved(contacts, pose), pose.position, tolerance=0.05)
    assert two.length == pytest.approx(one.length)
    assert one.lower <= two.upper * (1 + 1e-6) and two.lower <= one.upper * (1 + 1e-6)


@FEW
@given(SEEDS)
def test_more_friction_is_never_worse_and_each_never_less_than_sum(seed):
    def at(friction, norm="sum"):
        contacts = scattered(np.random.default_rng(seed), 4, friction)
        return ferrari_canny(contacts, CENTRE, norm=norm, tolerance=0.1, rounds=10)

    low, high = at(0.3), at(0.6)
    assert low.lower <= high.upper * (1 + 1e-6)
    assert low.lower <= at(0.3, "each").upper * (1 + 1e-6)


def test_more_edges_or_rounds_bring_the_bounds_together():
    contacts = on_ball(EQUATOR, 0.5)
    plain = [ferrari_canny(contacts, CENTRE, edges=n, rounds=0) for n in (4, 8, 16, 32)]
    lower = [b.lower for b in plain]
    assert lower[0] < 0.97 * lower[-1] and lower[1] < lower[2] < lower[3]  # the edges' error
    refined = ferrari_canny(contacts, CENTRE, tolerance=0.01)
    assert refined.upper - refined.lower <= 0.01 * refined.upper
    assert max(lower) <= refined.upper


def test_contacts_that_hardly_hold_end_with_honest_bounds():
    ball = ferrari_canny(on_ball(OCTAHEDRON, 1e-6), CENTRE)
    assert 0 <= ball.lower <= 1e-6 * np.sqrt(2 / 3) <= ball.upper * (1 + 1e-9) < 1e-5


def test_bad_values_are_named():
    contacts = on_ball(EQUATOR, 0.5)
    for given_, named in (
        ({"norm": "most"}, "norm"),
        ({"tolerance": 0.0}, "tolerance"),
        ({"tolerance": float("nan")}, "tolerance"),
        ({"edges": 2}, "edges"),
        ({"rounds": -1}, "rounds"),
        ({"length": 0.0}, "length"),
    ):
        with pytest.raises(InvalidValue, match=named):
            ferrari_canny(contacts, CENTRE, **given_)


def test_without_scipy_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "scipy.spatial", None)
    with pytest.raises(MissingPackage, match="quality"):
        ferrari_canny(on_ball(EQUATOR, 0.5), CENTRE)
