# SPDX-License-Identifier: Apache-2.0
"""Rest curvature that varies along segments: the rest shape, and what pulls make of it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ccr_ros.model import Cable, FingerSolver, InvalidValue, SolverSettings, solve
from ccr_ros.model.equilibrium import EquilibriumProblem
from ccr_ros.model.rod import centerline

from .fingers import helical_cable, make_finger, rms, straight_cable

PULL = [0.003]


def ends(seed: int, pieces: int = 1, segments: int = 9) -> np.ndarray:
    """Curvature at both ends of each piece, with jumps within and between segments."""
    return np.random.default_rng(seed).normal(size=(segments, 2 * pieces, 3)) * [5, 5, 2]


def coefficients(ends: np.ndarray) -> np.ndarray:
    """The mean and the linear part (n, k, 2, 3) of every piece, as `Solution.curvature` has."""
    return np.stack(
        [(ends[:, 1::2] + ends[:, ::2]) / 2, (ends[:, 1::2] - ends[:, ::2]) / 2], axis=2
    )


def test_equal_ends_are_the_constant_rest_curvature():
    constant = np.random.default_rng(2).normal(size=(9, 3)) * [5, 5, 2]
    one = solve(make_finger(rest_curvature=constant), PULL)
    two = solve(make_finger(rest_curvature=np.stack([constant, constant], axis=1)), PULL)
    assert np.array_equal(one.backbone, two.backbone) and one.energy == two.energy


@given(seed=st.integers(0, 10**6), pieces=st.integers(1, 3))
@settings(max_examples=10)
def test_at_rest_a_finger_has_its_rest_curvature_and_no_energy(seed: int, pieces: int) -> None:
    finger = make_finger(rest_curvature=ends(seed, pieces))
    rest = FingerSolver(finger).rest
    assert rest.energy == 0 and not rest.tensions.any()
    wanted = coefficients(finger.rest_curvature)
    assert rest.curvature == pytest.approx(wanted)
    curve = centerline(wanted.reshape(-1, 2, 3), finger.length, 8)
    assert rest.backbone == pytest.approx(curve[:: 8 * pieces], abs=1e-10)
    assert rest.centerline[:: len(rest.centerline) // 9] == pytest.approx(rest.backbone, abs=1e-10)


@pytest.mark.parametrize("pull", [[0.0], PULL])
@pytest.mark.parametrize("pieces", [1, 2])
def test_more_arcs_converge_fast(pull, pieces):
    short = {"segments": 3, "length": 0.0607}  # of the same segments
    cable = Cable.from_holes("main", [7, 8, 9, 11])
    finger = make_finger(cable, rest_curvature=ends(4, pieces, 3), **short)

    def pose(arcs: int, order: int = 1) -> np.ndarray:
        settings = SolverSettings(arcs_per_segment=arcs, curvature_order=order)
        return solve(finger, pull, settings).require_converged().backbone

    fine = pose(4)
    one, two = rms(pose(1), fine), rms(pose(2), fine)
    assert two < one / 6 and one < 5e-4 * finger.length  # bending changes by 10/m in each piece
    assert rms(pose(8, order=0), fine) < 2e-4 * finger.length


def test_pieces_on_one_line_are_one_piece():
    whole = ends(9)
    middle = whole.mean(axis=1)
    split = np.stack([whole[:, 0], middle, middle, whole[:, 1]], axis=1)
    settings = SolverSettings(arcs_per_segment=2)
    one = solve(make_finger(rest_curvature=whole), PULL, settings)
    assert solve(make_finger(rest_curvature=split), PULL).backbone == pytest.approx(
        one.backbone, abs=1e-10
    )


def test_constant_arcs_take_the_mean():
    rest = ends(5)
    settings = SolverSettings(curvature_order=0)
    means = make_finger(rest_curvature=rest.mean(axis=1))
    one = solve(make_finger(rest_curvature=rest), PULL, settings)
    assert one.backbone == pytest.approx(solve(means, PULL, settings).backbone, abs=1e-10)


def test_fine_fingers_keep_a_rest_curvature_that_varies():
    cable = straight_cable(4, 31)
    rest = ends(6, segments=30)
    varying = make_finger(cable, segments=30, rest_curvature=rest)
    constant = make_finger(cable, segments=30, rest_curvature=rest.mean(axis=1))
    assert EquilibriumProblem(varying).rod.order == 1
    assert EquilibriumProblem(constant).rod.order == 0
    assert EquilibriumProblem(varying, SolverSettings(curvature_order=0)).rod.order == 0


@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize("pieces", [1, 2])
def test_a_problem_takes_another_rest_shape(order, pieces):
    settings = SolverSettings(curvature_order=order, arcs_per_segment=2)
    cables = (straight_cable(3, 6), helical_cable())
    first = EquilibriumProblem(make_finger(*cables), settings)
    straight = first.rest_lengths.copy()
    rest = ends(7, pieces)
    other = first.with_rest_curvature(rest)
    settings = SolverSettings(curvature_order=order, arcs_per_segment=2 // pieces)
    fresh = EquilibriumProblem(make_finger(*cables, rest_curvature=rest), settings)
    y = np.random.default_rng(8).normal(size=first.size) * 0.2
    pulls = np.array([0.003, 0.004])
    assert np.array_equal(other.finger.rest_curvature, rest)
    assert other.rest_lengths == pytest.approx(fresh.rest_lengths, rel=1e-13)
    assert other.length_bounds(pulls) == pytest.approx(fresh.length_bounds(pulls), rel=1e-13)
    assert other.evaluate(y).points == pytest.approx(fresh.evaluate(y).points, abs=1e-13)
    assert np.array_equal(first.rest_lengths, straight)  # the first one is as it was
    assert not first.finger.rest_curvature.any() and not first.z_rest.any()
    with pytest.raises(InvalidValue, match="rest_curvature"):
        first.with_rest_curvature(rest[:8])
    with pytest.raises(InvalidValue, match="that 2 arcs per segment can follow"):
        first.with_rest_curvature(ends(7, 3))
