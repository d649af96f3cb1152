# SPDX-License-Identifier: Apache-2.0
"""Poses through wanted disks: exact, along the tangents, free of twist or in the wanted frames."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from model.fingers import make_finger, straight_cable

from ccr_ros.design.pose_fit import fit_pose, smooth_guess
from ccr_ros.design.rest_statics import curvature_ends
from ccr_ros.design.target import DesiredShape
from ccr_ros.model import Finger, solve
from ccr_ros.model.equilibrium import EquilibriumProblem
from design.shapes import SPHERE, on_curve, wandering_shape


def straight_problem(finger: Finger | None = None) -> EquilibriumProblem:
    finger = make_finger() if finger is None else finger
    straight = np.zeros((finger.segments, 4, 3))
    return EquilibriumProblem(replace(finger, rest_curvature=straight))


CURVES = [
    "arc:90", "arc:-250,direction=40", "arc:0.01", "s:60", "s:-150,direction=90",
    "helix:0.02,turns=1", "helix:0.008,turns=-3", SPHERE, "box:0.06x0.06x0.1,x=0.06,z=0.12",
]  # fmt: skip


@pytest.mark.parametrize("curve", CURVES)
def test_centres_and_tangents_of_curves(curve):
    problem = straight_problem()
    shape = on_curve(curve, problem.finger)
    fit = fit_pose(problem, shape)
    at = problem.evaluate(fit.y)
    centres = at.points[problem.points.backbone] * problem.finger.length
    assert shape.squared_error(centres) == pytest.approx(fit.squared_error, abs=1e-26)
    assert fit.squared_error < 1e-26 and fit.angle_error < 1e-9
    assert at.rod.rotations[::2, :, 2] == pytest.approx(shape.tangents, abs=1e-9)
    assert np.abs(curvature_ends(problem, fit.y)[:, 2]).max() < 1e-12


@given(seed=st.integers(0, 10**6), bend=st.floats(0.1, 15.0))
@hypothesis_settings(max_examples=15)
def test_centres_and_tangents_in_space(seed: int, bend: float) -> None:
    problem = straight_problem()
    fit = fit_pose(problem, wandering_shape(problem.finger, seed, bend))
    assert fit.squared_error < 1e-24 and fit.angle_error < 1e-8
    ends = curvature_ends(problem, fit.y)
    assert np.abs(np.diff(ends[:, :2], axis=0)).max() < 8 * bend  # it bends as smoothly


def test_a_straight_shape_is_the_straight_pose():
    problem = straight_problem()
    shape = DesiredShape(np.linspace([0, 0, 0], [0, 0, 0.182], 10))
    fit = fit_pose(problem, shape)
    assert np.abs(fit.y).max() < 1e-9 and fit.squared_error < 1e-30


def test_without_tangents_a_spline_supplies_them():
    problem = straight_problem()
    given = wandering_shape(problem.finger, 4, 6.0)
    fit = fit_pose(problem, DesiredShape(given.points))
    assert fit.squared_error < 1e-24
    axes = problem.evaluate(fit.y).rod.rotations[::2, :, 2]
    assert np.linalg.norm(axes - given.tangents, axis=1).max() < 0.03


@pytest.mark.parametrize("twist", [0.0, 6.0])
def test_frames_are_met(twist):
    finger = make_finger(rest_curvature=np.tile([3.0, -4.0, twist], (9, 1)))
    pose = solve(finger, [0.006])
    problem = straight_problem(finger)
    fit = fit_pose(problem, DesiredShape.of(pose))
    at = problem.evaluate(fit.y)
    assert fit.squared_error < 1e-24
    assert at.rod.rotations[::2] == pytest.approx(pose.frames, abs=1e-9)


@pytest.mark.parametrize("segments", [2, 40])
def test_few_and_many_segments(segments):
    finger = make_finger(straight_cable(1, segments + 1), segments=segments)
    problem = straight_problem(finger)
    fit = fit_pose(problem, wandering_shape(finger, 2, 4.0))
    assert fit.squared_error < 1e-24 and fit.angle_error < 1e-8


def test_points_that_no_pose_has_leave_an_error_that_is_told():
    problem = straight_problem()
    shape = DesiredShape(np.linspace([0, 0, 0], [0, 0, 0.19], 10))
    fit = fit_pose(problem, shape)
    assert np.isfinite(fit.y).all()
    assert fit.squared_error > (0.008**2) / 2


def test_the_guess_is_near():
    problem = straight_problem()
    shape = on_curve("arc:90", problem.finger)
    at = problem.evaluate(smooth_guess(problem, shape))
    centres = at.points[problem.points.backbone] * problem.finger.length
    assert shape.squared_error(centres) < 1e-20  # an arc is its own guess
    shape = wandering_shape(problem.finger, 9, 6.0)
    at = problem.evaluate(smooth_guess(problem, shape))
    centres = at.points[problem.points.backbone] * problem.finger.length
    assert shape.errors(centres).max() < 2e-3
