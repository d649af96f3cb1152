# SPDX-License-Identifier: Apache-2.0
"""The rest shape of given tensions and forces, and the tensions of given pulls."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from model.fingers import helical_cable, make_finger, straight_cable

from ccr_ros.design.pose_fit import fit_pose
from ccr_ros.design.pull import Pull
from ccr_ros.design.rest_statics import Push, RestStatics, curvature_ends
from ccr_ros.design.tension_roots import taut_sets, tension_roots
from ccr_ros.model import Sphere
from ccr_ros.model.equilibrium import EquilibriumProblem
from ccr_ros.model.sqp import derive
from design.shapes import on_curve, wandering_shape

BALL = Sphere([0.042, 0.0, 0.110], 0.05, name="ball")
CABLES = (straight_cable(3, 7), helical_cable())
PULLS = (Pull(0.003), Pull(0.02, relative=True))


@lru_cache
def problem_and_pose(seed: int = 3) -> tuple[EquilibriumProblem, np.ndarray]:
    finger = make_finger(*CABLES, rest_curvature=np.zeros((9, 4, 3)), obstacles=(BALL,))
    problem = EquilibriumProblem(finger)
    return problem, fit_pose(problem, wandering_shape(finger, seed, 5.0)).y


@given(seed=st.integers(0, 10**6))
def test_the_pose_is_in_equilibrium_with_any_tensions_and_forces(seed: int) -> None:
    problem, y = problem_and_pose()
    rng = np.random.default_rng(seed)
    tensions = rng.uniform(0, 20, 2)
    pushes = [
        Push(0, int(p), float(f)) for p, f in zip((20, 30), rng.uniform(0, 9, 2), strict=True)
    ]
    statics = RestStatics(problem, y, PULLS, pushes)
    rest = statics.rest(tensions)
    curvature = curvature_ends(problem, rest).reshape(9, 4, 3)
    bent = problem.with_rest_curvature(curvature)
    forces = np.zeros((1, len(problem.points.labels)))
    for push in pushes:
        forces[0, push.point] = push.force
    point = derive(bent, bent.evaluate(y - rest), tensions, forces)
    assert point.residual < 1e-12
    assert point.at.points == pytest.approx(statics.at.points, abs=1e-12)


def test_missing_length_and_its_jacobian():
    problem, y = problem_and_pose()
    statics = RestStatics(problem, y, PULLS)
    tensions = np.array([4.0, 11.0])
    value, jacobian = statics.missing(tensions)
    bent = problem.with_rest_curvature(
        curvature_ends(problem, statics.rest(tensions)).reshape(9, 4, 3)
    )
    length = problem.finger.length
    assert value[0] == pytest.approx(bent.rest_lengths[0] - statics.at.lengths[0] - 0.003 / length)
    assert value[1] == pytest.approx(0.98 * bent.rest_lengths[1] - statics.at.lengths[1])
    step = 1e-5
    for j, unit in enumerate(np.eye(2)):
        high, low = (statics.missing(tensions + s * step * unit)[0] for s in (1, -1))
        assert jacobian[:, j] == pytest.approx((high - low) / (2 * step), rel=1e-6, abs=1e-9)


@given(seed=st.integers(0, 10**6), twisted=st.booleans())
def test_reach_ends_where_a_bound_is_met(seed: int, twisted: bool) -> None:
    problem, y = problem_and_pose()
    rng = np.random.default_rng(seed)
    bounds = (1e3, 8.0) if twisted else (45.0, 1e3)
    statics = RestStatics(problem, y, PULLS, (), *bounds)
    start, way = rng.uniform(0, 5, 2), rng.normal(size=2)
    end = statics.reach(start, way)
    assert end > 0

    def used(t: float) -> float:
        ends = curvature_ends(problem, statics.rest(start + t * way))
        if twisted:
            return float(np.abs(ends[:, 2]).max()) / bounds[1]
        return float(np.hypot(ends[:, 0], ends[:, 1]).max()) / bounds[0]

    assert used(end) == pytest.approx(1.0, abs=1e-9)
    assert used(0.5 * end) < 1
    assert statics.reach(start + 1.01 * end * way, way) == 0.0
    assert statics.reach(start, np.zeros(2)) == np.inf


def test_taut_sets():
    assert list(taut_sets(2)) == [(0, 1), (0,), (1,), ()]
    assert len(list(taut_sets(4))) == 16


def test_one_cables_roots_are_all_there_are():
    """Against a dense scan, for a finger of long segments that has two."""
    finger = make_finger(straight_cable(4, 4), segments=3, rest_curvature=np.zeros((3, 4, 3)))
    problem = EquilibriumProblem(finger)
    counts = set()
    for seed in range(4):
        y = fit_pose(problem, wandering_shape(finger, seed, 5.0)).y
        for pull in (0.5, 3.0, 10.0, 25.0):
            pulls = [Pull(pull / 100, relative=True)]
            statics = RestStatics(problem, y, pulls, (), *finger.largest_rest_curvature)
            end = statics.reach(np.zeros(1), np.ones(1))
            grid = np.linspace(0, end, 120)
            values = np.array([statics.missing(np.array([t]))[0][0] for t in grid])
            changes = np.flatnonzero(values[:-1] * values[1:] < 0)
            found = tension_roots(statics, (0,), 1)
            assert len(found) == len(changes)
            for root, k in zip(sorted(float(r[0]) for r in found), changes, strict=True):
                assert grid[k] <= root <= grid[k + 1]
                assert abs(statics.missing(np.array([root]))[0][0]) < 1e-12
            counts.add(len(found))
    assert counts >= {0, 2}


def test_no_taut_cable_and_no_room():
    problem, y = problem_and_pose()
    statics = RestStatics(problem, y, PULLS)
    assert [t.tolist() for t in tension_roots(statics, (), 2)] == [[0.0, 0.0]]
    tight = RestStatics(problem, y, PULLS, (), 1.0, 1.0)  # the pose bends by more
    assert tension_roots(tight, (0,), 2) == [] and tension_roots(tight, (0, 1), 2) == []


def test_two_cables_roots_satisfy_both():
    finger = make_finger(straight_cable(4), helical_cable(), rest_curvature=np.zeros((9, 4, 3)))
    problem = EquilibriumProblem(finger)
    y = fit_pose(problem, on_curve("helix:0.02,turns=1", finger)).y
    statics = RestStatics(problem, y, PULLS, (), *finger.largest_rest_curvature)
    (root,) = tension_roots(statics, (0, 1), 2)
    assert np.abs(statics.missing(root)[0]).max() < 1e-12 and (root > 0).all()
    (alone,) = tension_roots(statics, (1,), 2)
    assert alone[0] == 0 and abs(statics.missing(alone)[0][1]) < 1e-12
