# SPDX-License-Identifier: Apache-2.0
"""Closing with forces: every finger presses with its own, and what cannot be is refused."""

import numpy as np
import pytest
from friction_cases import LONG, around, cube

from ccr_ros.grasp.statics import GraspSolver, close_with_forces, pressing, sphere_body
from ccr_ros.model import InvalidValue, NotConverged, Pose, UnknownName


@pytest.fixture
def solver():
    return GraspSolver(around(2, 0.03), cube(0.5, 0.002), LONG)


@pytest.mark.parametrize("forces", [0.03, {"finger_1": 0.02, "finger_2": 0.05}])
def test_every_finger_presses_with_its_force(solver, forces):
    solution = close_with_forces(solver, forces, tolerance=0.01)
    wanted = forces if isinstance(forces, dict) else dict.fromkeys(solver.names, forces)
    assert pressing(solution) == pytest.approx(wanted, rel=0.01)
    assert solution.supported and solver.supported and solution.converged


def test_the_way_there_does_not_decide_the_pulls(solver):
    close_with_forces(solver, 0.03, tolerance=1e-4)
    once = solver.pulls
    other = GraspSolver(around(2, 0.03), cube(0.5, 0.002), LONG)
    close_with_forces(other, 0.03, step=3e-5, tolerance=1e-4)
    for name, pulls in other.pulls.items():
        np.testing.assert_allclose(pulls, once[name], atol=2e-6)


def test_a_grip_is_tightened_from_where_it_is_and_not_loosened(solver):
    light = close_with_forces(solver, 0.02)
    tight = close_with_forces(solver, 0.04)
    for a, b in zip(light.fingers, tight.fingers, strict=True):
        assert (b.pulls > a.pulls).all()
    before = solver.pulls
    with pytest.raises(InvalidValue, match="presses already"):
        close_with_forces(solver, 0.02)
    assert {n: p.tolist() for n, p in solver.pulls.items()} == {
        n: p.tolist() for n, p in before.items()
    }


def test_a_finger_that_never_comes_there_is_named():
    away = sphere_body(0.03, 0.001, Pose(np.array([0.0, 0.5, 0.1])), 0.5)
    solver = GraspSolver(around(2, 0.03), away, LONG)
    with pytest.raises(NotConverged, match="finger_1") as caught:
        close_with_forces(solver, 0.03, step=0.005)
    assert caught.value.finger in solver.names


@pytest.mark.parametrize("bad", [0.0, -1.0, float("nan"), float("inf"), True, "1"])
def test_bad_forces_are_refused(solver, bad):
    with pytest.raises(InvalidValue, match=r"forces\.finger_1"):
        close_with_forces(solver, bad)
    with pytest.raises(InvalidValue, match=r"forces\.finger_2"):
        close_with_forces(solver, {"finger_1": 0.1, "finger_2": bad})


def test_forces_of_other_fingers_are_refused(solver):
    with pytest.raises(UnknownName, match="thumb"):
        close_with_forces(solver, {"finger_1": 0.1, "finger_2": 0.1, "thumb": 0.1})
    with pytest.raises(InvalidValue, match=r"forces\.finger_2"):
        close_with_forces(solver, {"finger_1": 0.1})


@pytest.mark.parametrize(("key", "bad"), [("step", 0.0), ("step", np.nan), ("tolerance", 0.9)])
def test_bad_settings_are_refused(solver, key, bad):
    with pytest.raises(InvalidValue, match=key):
        close_with_forces(solver, 0.1, **{key: bad})


def test_an_object_that_was_let_go_is_refused(solver):
    close_with_forces(solver, 0.05)
    assert solver.let_go().converged
    with pytest.raises(InvalidValue, match="support"):
        close_with_forces(solver, 0.06)
