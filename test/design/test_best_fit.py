# SPDX-License-Identifier: Apache-2.0
"""Best fits: exact gradients, bounds that hold, errors that are the forward model's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from model.fingers import helical_cable, make_finger, straight_cable

from ccr_ros.design.best_fit import best_fit
from ccr_ros.design.bounded_step import bounded_step, curvature_bounds, kept
from ccr_ros.design.nearest_pose import nearest_pose
from ccr_ros.design.pull import Pull
from ccr_ros.design.rest_forward import KINDS, RestForward
from ccr_ros.design.target import DesiredShape
from ccr_ros.design.verify import TOLERANCE, pull_from_rest
from ccr_ros.model import InvalidValue, NotConverged, Sphere, UnknownName
from ccr_ros.model.equilibrium import EquilibriumProblem
from design.shapes import SPHERE, on_curve, wandering_shape
from design.test_rest_shape import BALL, percent, sphere_finger


def pulled(found, shape):
    """Check that pulling from rest leads to what the fit says; return the path."""
    path = pull_from_rest(found.shape.finger, found.shape.pulls, shape, steps=3)
    assert path.completed and not path.jumps
    assert path.last.backbone == pytest.approx(found.shape.actuated, abs=1e-7)
    assert path.squared_error == pytest.approx(found.shape.squared_error, rel=1e-3, abs=1e-18)
    return path


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("case", ["free", "contact", "two cables", "fine"])
def test_gradients_match_finite_differences(kind, case):
    pulls = [Pull(0.03, relative=True)]
    if case == "two cables":
        finger = make_finger(straight_cable(3, 7), helical_cable())
        pulls.append(Pull(0.004))
    elif case == "fine":
        finger = make_finger(straight_cable(3, 25), segments=24)
    else:
        ball = Sphere([0.042, 0.0, 0.110], 0.060 if case == "contact" else 0.01, name="ball")
        finger = sphere_finger(obstacles=(ball,))
    forward = RestForward(finger, pulls, kind)
    rng = np.random.default_rng(2)
    shape = (finger.segments, forward.vectors, 3)
    curvature = np.tile([0.0, -3.0, 0.2], (*shape[:2], 1)) + rng.normal(size=shape) * 0.5
    pose = forward.from_rest(curvature)
    assert pose is not None
    assert bool(pose.point.forces.any()) is (case == "contact")
    jacobian = forward.jacobian(pose)
    for _ in range(3):
        way, step = rng.normal(size=shape), 1e-3
        high, low = (forward.near(curvature + s * step * way, pose) for s in (1, -1))
        assert high is not None and low is not None
        numeric = (high.backbone - low.backbone) / (2 * step)
        assert jacobian @ way.ravel() == pytest.approx(numeric, abs=3e-8)
        assert np.abs(numeric).max() > 1e-4


def test_where_equilibrium_gives_the_shape_the_fit_is_that():
    finger = sphere_finger()
    shape = on_curve(SPHERE, finger)
    found = best_fit(finger, shape, percent(3))
    assert found.optimal and found.solves == 1 and found.shape.squared_error < 1e-24
    assert found.shape.tensions == pytest.approx([5.550], abs=1e-3)
    assert pulled(found, shape).reached


@pytest.mark.parametrize(
    ("kind", "worst", "least"), [("constant", 2e-9, 1e-10), ("linear", 2e-12, 1e-14)]
)
def test_fewer_curvatures_than_the_shape_needs(kind, worst, least):
    """0.001 mm^2 remain with constant curvature: 0.012 mm RMS; linear: 1e-6 mm^2."""
    finger = sphere_finger()
    shape = on_curve(SPHERE, finger)
    found = best_fit(finger, shape, percent(3), kind)
    assert least < found.shape.squared_error < worst < found.first_error / 500
    rest = np.asarray(found.shape.finger.rest_curvature)
    assert rest.shape == ((9, 3) if kind == "constant" else (9, 2, 3))
    assert not pulled(found, shape).reached


def test_a_bound_on_curvature_that_leaves_the_shape_in_reach():
    """Equilibrium's own rest shape bends by 13.1 1/m; there is one that bends by 12."""
    finger = sphere_finger()
    shape = on_curve(SPHERE, finger)
    found = best_fit(finger, shape, percent(3), max_curvature=12.0)
    assert found.optimal and found.shape.squared_error <= TOLERANCE < found.first_error
    assert found.shape.largest_curvature <= 12.0 + 1e-9 and found.at_bound > 0
    assert pulled(found, shape).reached


def test_a_tighter_bound_leaves_an_error_that_is_least():
    finger = sphere_finger()
    shape = on_curve(SPHERE, finger)
    found = best_fit(finger, shape, percent(3), max_curvature=10.0)
    assert found.optimal and found.at_bound > 10
    assert found.shape.largest_curvature <= 10.0 + 1e-9
    assert 1e-6 < found.shape.squared_error < found.first_error
    pulled(found, shape)
    # No small change within the bounds is better.
    forward = RestForward(finger, [Pull(0.03, True)], "pieces")
    curvature = np.asarray(found.shape.finger.rest_curvature)
    pose = forward.from_rest(curvature)
    rng = np.random.default_rng(3)
    limits = np.array([10.0, finger.largest_rest_curvature[1]])
    for _ in range(20):
        other = forward.near(
            kept(curvature + rng.normal(size=curvature.shape) * 0.05, limits), pose
        )
        assert shape.squared_error(other.backbone) > found.shape.squared_error * (1 - 1e-6)


def test_a_shape_inside_an_obstacle():
    """A ball 2 mm larger than the contour was made for: the finger lies on it instead."""
    finger = sphere_finger(obstacles=(replace(BALL, radius=0.058),))
    shape = on_curve(SPHERE, sphere_finger())
    found = best_fit(finger, shape, percent(3))
    path = pulled(found, shape)
    assert path.last.certificate.penetration < 1e-8
    assert 5e-6 < found.shape.squared_error < 5e-5  # 2 mm at six disks would be 2.4e-5
    assert found.optimal and found.shape.largest_curvature < 30
    gaps = finger.obstacles[0].signed_distance(path.last.cables["main"])
    assert np.sum(gaps < 1e-6) >= 4


def test_the_nearest_pose_is_a_trade_between_error_and_smoothness():
    finger = make_finger(
        straight_cable(1), rest_curvature=np.zeros((9, 4, 3)),
        obstacles=(replace(BALL, radius=0.058),),
    )  # fmt: skip
    problem = EquilibriumProblem(finger)
    shape = on_curve(SPHERE, finger)
    limits = 0.5 * np.array(finger.largest_rest_curvature)
    errors = []
    for smoothness in (0.02, 0.2, 2.0):
        at = problem.evaluate(nearest_pose(problem, shape, limits, smoothness))
        assert at.distances[:, ~problem.fixed].min() > -1e-7
        errors.append(shape.squared_error(at.points[problem.points.backbone] * finger.length))
    assert errors == sorted(errors) and errors[2] < 2 * errors[0]


def test_points_out_of_reach():
    finger = sphere_finger()
    up = np.array([0.0, 0.0, 1.0])
    longer = DesiredShape(np.linspace(0 * up, 0.2 * up, 10))
    found = best_fit(finger, longer, percent(3))
    straight = np.sum(np.linspace(0, 0.018, 10) ** 2)  # a straight finger's
    assert found.shape.squared_error == pytest.approx(straight, rel=1e-3)
    pulled(found, longer)


def test_in_space_with_a_helical_cable():
    finger = make_finger()
    shape = wandering_shape(finger, 5, 10.0)
    found = best_fit(finger, shape, percent(3, "helical"), "linear")
    assert found.shape.squared_error <= TOLERANCE < found.first_error
    assert pulled(found, shape).reached


def test_refused(monkeypatch):
    finger = sphere_finger()
    shape = on_curve(SPHERE, finger)
    with pytest.raises(UnknownName, match="constant, linear, pieces"):
        best_fit(finger, shape, percent(3), "cubic")
    with pytest.raises(UnknownName, match="unknown cable 'no'"):
        best_fit(finger, shape, percent(3, "no"))
    with pytest.raises(InvalidValue, match="max_curvature"):
        best_fit(finger, shape, percent(3), max_curvature=-1.0)
    with pytest.raises(InvalidValue, match="10 points"):
        best_fit(finger, DesiredShape(np.zeros((4, 3))), percent(3))
    monkeypatch.setattr(RestForward, "from_rest", lambda *_: None)
    with pytest.raises(NotConverged, match="pull less"):
        best_fit(finger, shape, percent(3))


def test_steps_keep_their_bounds():
    rng = np.random.default_rng(1)
    residual, jacobian = rng.normal(size=5), rng.normal(size=(5, 8))
    rows, room = rng.normal(size=(3, 8)), np.array([0.1, 0.2, -0.1])
    step, multiplier = bounded_step(residual, jacobian, 0.1, rows, room)
    assert (rows @ step <= room + 1e-9).all() and multiplier > 0
    value = np.sum((residual + jacobian @ step) ** 2) + 0.1 * step @ step
    for _ in range(200):
        other = step + rng.normal(size=8) * 0.1
        if (rows @ other <= room).all():
            assert np.sum((residual + jacobian @ other) ** 2) + 0.1 * other @ other > value - 1e-9
    free, multiplier = bounded_step(residual, jacobian, 0.1, rows[:0], room[:0])
    exact = np.linalg.solve(jacobian.T @ jacobian + 0.1 * np.eye(8), -jacobian.T @ residual)
    assert free == pytest.approx(exact) and multiplier == 0.0
    apart = np.array([[1.0] + [0.0] * 7, [-1.0] + [0.0] * 7])
    assert bounded_step(residual, jacobian, 0.1, apart, np.array([-1.0, -1.0])) is None


def test_bounds_on_curvature():
    limits = np.array([10.0, 4.0])
    curvature = np.array([[3.0, 8.0, 0.0], [0.0, 1.0, -3.9], [30.0, 40.0, 9.0]])
    rows, room = curvature_bounds(curvature[:2], limits)
    assert rows.shape == (2, 6) and (room > 0).all()
    for k in range(2):
        at_bound = curvature[:2].ravel() + rows[k] * room[k]
        bends, twists = np.hypot(*at_bound.reshape(2, 3)[k, :2]), abs(at_bound[5])
        assert (bends if k == 0 else twists) == pytest.approx(limits[k])
    inside = kept(curvature, limits)
    assert np.array_equal(inside[:2], curvature[:2])
    assert inside[2] == pytest.approx([6.0, 8.0, 4.0])
    empty, none = curvature_bounds(np.zeros((2, 3)), limits)
    assert empty.shape == (0, 6) and none.shape == (0,)
