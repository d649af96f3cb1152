# SPDX-License-Identifier: Apache-2.0
"""Plans that move a held object: what they reach, what they keep, and what they refuse."""

from dataclasses import replace

import numpy as np
import pytest
from friction_cases import LONG

from ccr_ros.grasp.clearance import disk_clearance
from ccr_ros.grasp.manipulation import MoveLimits, MoveTarget, plan_move
from ccr_ros.grasp.manipulation.step import StepLimits, best_step, constraint_rows
from ccr_ros.grasp.statics import Body, GraspSolver
from ccr_ros.grasp.statics.sensitivity import grasp_sensitivity
from ccr_ros.model import Box, InvalidValue, Pose, UnknownName, load_gripper
from ccr_ros.resources import find_config

PULLS = {"finger_1": [0.00217, 0.00217], "finger_2": [0.003524], "finger_3": [0.003524]}


@pytest.fixture(scope="module")
def grasp():
    """The cube gripper with its cube, and where it stands once it holds it."""
    fingers = load_gripper(find_config("gripper_cube")).fingers
    shape = Box(np.zeros(3), np.full(3, 0.04), edge_radius=0.001, name="cube")
    body = Body(shape, 0.01, Pose(np.array([0.0, 0.0, 0.170])), 0.8)
    solver = GraspSolver(fingers, body, LONG)
    solver.solve(PULLS).require_converged()
    held = solver.let_go().require_converged()
    assert held.stable and held.margin > 0.4
    return solver, solver.standing


@pytest.fixture
def solver(grasp):
    found, standing = grasp
    found.resume(standing)
    return found


def test_sensitivities_are_those_of_differences(solver):
    slopes = grasp_sensitivity(solver)
    before = solver.standing
    here = solver.solve({}).require_converged()
    pulls = solver.pulls
    assert slopes.cables == ("finger_1.left", "finger_1.right", "finger_2.main", "finger_3.main")
    step = 2e-6
    for j, (name, cable) in enumerate([("finger_1", 0), ("finger_1", 1), ("finger_2", 0)]):
        found = []
        for sign in (1, -1):
            solver.resume(before)
            wanted = pulls[name].copy()
            wanted[cable] += sign * step
            found.append(solver.solve({name: wanted}).require_converged())
        ahead, behind = found
        motion = (ahead.body.pose.position - behind.body.pose.position) / (2 * step)
        assert np.allclose(
            motion, slopes.motion[:3, j], atol=0.01 * np.abs(slopes.motion[:3]).max()
        )
        for k, (a, b) in enumerate(zip(ahead.contacts, behind.contacts, strict=True)):
            slope = (a.force - b.force) / (2 * step)
            assert slope == pytest.approx(slopes.normal[k, j], abs=0.5)
            turned = [
                s.body.pose.rotation.T @ c.friction_force for s, c in ((ahead, a), (behind, b))
            ]
            along = here.body.pose.rotation @ (turned[0] - turned[1]) / (2 * step)
            assert np.allclose(along, slopes.along[k, :, j], atol=0.5)
    assert [c.finger for c in here.contacts] == ["finger_1", "finger_2", "finger_3"]


@pytest.mark.parametrize("degrees", [20, -20])
def test_the_cube_turns_with_every_contact_in_its_cone(solver, degrees):
    target = MoveTarget(turn=np.array([0.0, 0.0, np.deg2rad(degrees)]))
    plan = plan_move(solver, target, MoveLimits(margin=0.1))
    assert plan.reached and plan.share == 1.0 and not plan.limiting
    assert np.rad2deg(plan.moved[5]) == pytest.approx(degrees, abs=0.25)
    assert plan.margin > 0.08
    assert min(w.force for w in plan.waypoints) > 0.005
    # Walked again, with nothing but its pulls, it does what was planned.
    for waypoint in plan.waypoints:
        solution = solver.solve(waypoint.pulls).require_converged()
        assert solution.stable and all(c.status == "stick" for c in solution.contacts)
        assert np.allclose(solution.body.pose.position, waypoint.pose.position, atol=1e-8)
    back = plan_move(solver, MoveTarget(turn=np.array([0.0, 0.0, -np.deg2rad(degrees)])))
    assert back.reached


def test_planning_leaves_the_solver_as_it_was(solver):
    before = solver.solve({})
    plan = plan_move(solver, MoveTarget(shift=np.array([0.001, 0.0, 0.0])))
    assert plan.reached and plan.moved[0] == pytest.approx(0.001, abs=1e-4)
    after = solver.solve({})
    assert np.allclose(before.body.pose.position, after.body.pose.position, atol=1e-12)
    assert all(np.array_equal(solver.pulls[n], plan.waypoints[0].pulls[n]) for n in solver.names)


def test_what_cannot_be_reached_names_what_limits_it(solver):
    far = MoveTarget(turn=np.array([0.0, 0.0, np.pi / 2]))
    slipping = plan_move(solver, far, MoveLimits(margin=0.1))
    assert not slipping.reached and 0.2 < slipping.share < 0.9
    assert any(word in slipping.limiting for word in ("slip", "no pull", "drift"))
    here = solver.pulls
    limits = {n: np.column_stack([p - 2e-4, p + 2e-4]) for n, p in here.items()}
    narrow = plan_move(solver, far, MoveLimits(pulls=limits))
    assert not narrow.reached and narrow.share < slipping.share
    assert "pull of finger_" in narrow.limiting and "limit" in narrow.limiting
    for waypoint in narrow.waypoints:
        for name, (low, high) in ((n, limits[n].T) for n in limits):
            assert (waypoint.pulls[name] >= low - 1e-12).all()
            assert (waypoint.pulls[name] <= high + 1e-12).all()
    weak = plan_move(solver, far, MoveLimits(least_force=0.06))
    assert not weak.reached and min(w.force for w in weak.waypoints) > 0.055
    few = plan_move(solver, far, MoveLimits(waypoints=2))
    assert "waypoints" in few.limiting
    stiff = plan_move(solver, far, MoveLimits(stiffness=0.08))
    assert "stability" in stiff.limiting or not stiff.reached
    drifted = plan_move(solver, far, MoveLimits(drift=5e-4))
    assert drifted.share < slipping.share and "not asked for" in drifted.limiting


def test_what_no_pull_brings_together_ends(solver):
    """Four cables cannot do a shift and a turn that have little to do with each other."""
    target = MoveTarget(shift=np.array([0.0, 0.0, 0.001]), turn=np.array([0.0, 0.1, 0.1]))
    plan = plan_move(solver, target, MoveLimits(waypoints=1000))
    assert not plan.reached and plan.limiting and len(plan.waypoints) < 200


def test_fingers_that_would_meet_limit_a_plan(solver, monkeypatch):
    """The second time that it is looked at two disks touch, as they do nowhere in this grasp."""
    gaps = iter([0.005, 0.001, 0.0])

    def clearance(fingers, bases):
        found = disk_clearance(fingers, bases)
        assert found.gap > 0.005 and len(bases) == 3
        return replace(found, gap=next(gaps, 0.0))

    monkeypatch.setattr("ccr_ros.grasp.manipulation.plan.disk_clearance", clearance)
    plan = plan_move(solver, MoveTarget(turn=np.array([0.0, 0.0, 0.3])))
    assert not plan.reached and len(plan.waypoints) == 2
    assert plan.limiting.startswith("room: disk") and "meet" in plan.limiting


def test_a_watch_may_end_it(solver):
    seen = []
    target = MoveTarget(turn=np.array([0.0, 0.0, 0.3]))
    plan = plan_move(solver, target, watch=lambda w: len(seen.append(w) or seen) < 2)
    assert (
        not plan.reached and len(plan.waypoints) == 3 and plan.limiting == "stopped by the caller"
    )


def test_more_margin_is_kept(solver):
    target = MoveTarget(turn=np.array([0.0, 0.0, np.deg2rad(15)]))
    plan = plan_move(solver, target, MoveLimits(margin=0.3))
    assert plan.reached and plan.margin > 0.27


def test_a_step_keeps_its_constraints(solver):
    solution = solver.solve({})
    slopes = grasp_sensitivity(solver)
    pulls = np.concatenate(list(solver.pulls.values()))
    limits = StepLimits(0.3, 0.05, 0.16, 0.1, pulls - 1e-4, pulls + 5e-5, 2e-4)
    rows = constraint_rows(solution, slopes, pulls, limits)
    rng = np.random.default_rng(2)
    for _ in range(20):
        wanted = rng.standard_normal(6) * [0.001, 0.001, 0.001, 0.05, 0.05, 0.05]
        step = best_step(wanted, np.diag([50.0] * 3 + [1.0] * 3), 1.0, slopes, rows, 2e-4)
        assert (np.abs(step.change) <= 2e-4 * (1 + 1e-9)).all()
        worth = np.maximum(np.linalg.norm(rows.rows, axis=1), 1e-12)
        assert ((rows.rows @ step.change - rows.room) / worth).max() < 1e-9
        assert np.allclose(step.motion, slopes.motion @ step.change)


def test_bad_values_are_named(solver):
    for bad in (np.zeros(3), np.array([np.nan, 0, 0]), [0.1, 0.2], np.array([4.0, 0.0, 0.0])):
        with pytest.raises(InvalidValue, match=r"turn|target"):
            MoveTarget(turn=bad)
    with pytest.raises(InvalidValue, match="shift"):
        MoveTarget(shift=np.array([np.inf, 0.0, 0.0]))
    for name, bad in (("margin", 1.0), ("margin", -0.1), ("step", 0.0), ("waypoints", 0),
                      ("stiffness", 2.0), ("drift", 0.0), ("largest_force", 0.0)):  # fmt: skip
        with pytest.raises(InvalidValue, match=name):
            MoveLimits(**{name: bad})
    target = MoveTarget(turn=np.array([0.0, 0.0, 0.1]))
    with pytest.raises(UnknownName, match="finger_9"):
        plan_move(solver, target, MoveLimits(pulls={"finger_9": np.zeros((1, 2))}))
    with pytest.raises(InvalidValue, match=r"limits\.pulls\.finger_1"):
        plan_move(solver, target, MoveLimits(pulls={"finger_1": np.zeros((1, 2))}))
    with pytest.raises(InvalidValue, match="lower pull first"):
        plan_move(solver, target, MoveLimits(pulls={"finger_2": np.array([[0.2, 0.1]])}))
    with pytest.raises(InvalidValue, match="pose"):
        solver.support("there")
    solver.support()
    with pytest.raises(InvalidValue, match="supported"):
        plan_move(solver, target)
    fresh = GraspSolver([m for m in solver.hand.mounted], replace(solver.body), LONG)
    with pytest.raises(InvalidValue, match="sensitivity"):
        grasp_sensitivity(fresh)


def test_no_plan_counts_on_an_object_that_snaps(solver, monkeypatch):
    allowed, solve = [], solver.solve

    def spy(pulls, **values):
        allowed.append(bool(pulls) and values.get("snap", True))
        return solve(pulls, **values)

    monkeypatch.setattr(solver, "solve", spy)
    plan_move(solver, MoveTarget(shift=np.array([0.0, 0.0, 5e-4])), MoveLimits(waypoints=4))
    assert len(allowed) > 1 and not any(allowed)
