# SPDX-License-Identifier: Apache-2.0
"""Fingers and object in one equilibrium: balance, virtual work, invariance, and what fails."""

from dataclasses import replace

import numpy as np
import pytest

from ccr_ros.grasp.statics import Body, GraspSolver, sphere_body
from ccr_ros.grasp.statics.assembly import derive, gather
from ccr_ros.grasp.statics.meeting import Guess
from ccr_ros.grasp.statics.path import displaced, turn_between
from ccr_ros.model import (
    Box,
    InvalidValue,
    MountedFinger,
    NotConverged,
    Pose,
    Sphere,
    UnknownName,
    load_gripper,
)
from ccr_ros.resources import find_config

G = 9.80665
UP = Pose(np.array([0.0, 0.0, 0.110]))
DOWNWARDS = np.array([0.0, 0.0, G])  # gravity in the frame of a gripper that points down


@pytest.fixture(scope="module")
def fingers():
    return load_gripper(find_config("gripper_sphere")).fingers


def pulls(solver, percent):
    length = solver.hand.problems[0].rest_lengths[0] * solver.hand.length
    return {name: [percent / 100 * length] for name in solver.names}


def held(fingers, percent=3.2, mass=0.02, gravity=None, body=None):
    options = {} if gravity is None else {"gravity": gravity}
    solver = GraspSolver(fingers, body or sphere_body(0.112, mass, UP), **options)
    solver.solve(pulls(solver, percent)).require_converged()
    return solver, solver.let_go().require_converged()


def balance(solution, gravity):
    """Net force and moment on the object from the contacts alone, computed from the solution."""
    force = solution.body.mass * gravity
    moment = np.zeros(3)
    for contact in solution.contacts:
        push = -contact.force * contact.normal
        force = force + push
        moment = moment + np.cross(contact.position - solution.body.pose.position, push)
    return force, moment


def test_a_supported_object_stays_and_its_support_carries_the_rest(fingers):
    solver = GraspSolver(fingers, sphere_body(0.112, 0.02, UP))
    solution = solver.solve(pulls(solver, 3.2))
    assert solution.converged and solution.supported
    assert np.allclose(solution.body.pose.position, UP.position)
    force, moment = balance(solution, np.array([0, 0, -G]))
    assert np.allclose(solution.net_force, force, atol=1e-9)
    assert np.allclose(solution.net_moment, moment, atol=1e-9)
    assert abs(force[2]) > 0.5  # the fingertips press it down


def test_the_ball_is_drawn_in_and_held_in_balance(fingers):
    solver, first = held(fingers, 3.1)
    last = solver.solve(pulls(solver, 3.8)).require_converged()
    drawn = first.body.pose.position[2] - last.body.pose.position[2]
    assert 0.002 < drawn < 0.005
    for solution in (first, last):
        grip = sum(c.force for c in solution.contacts)
        force, moment = balance(solution, np.array([0, 0, -G]))
        assert np.abs(force).max() < 1e-6 * grip
        assert np.abs(moment).max() < 1e-6 * grip * 0.056
        assert np.allclose(solution.net_force, force, atol=1e-9)
        assert solution.stable and not solution.message
        assert np.abs(solution.body.pose.position[:2]).max() < 1e-7  # symmetry
    disks = {(c.finger, c.disk) for c in last.contacts}
    assert len(disks) == 6  # on both sides of the equator


def test_pointing_down_it_carries_half_a_newton_without_friction(fingers):
    _, solution = held(fingers, 3.7, mass=0.5 / G, gravity=DOWNWARDS)
    assert len(solution.contacts) == 6 and solution.stable
    force, _ = balance(solution, DOWNWARDS)
    assert np.abs(force).max() < 1e-6


def test_a_weight_too_large_is_not_held_and_the_support_stays(fingers):
    solver = GraspSolver(fingers, sphere_body(0.112, 0.2, UP), gravity=DOWNWARDS)
    solver.solve(pulls(solver, 3.2)).require_converged()
    solution = solver.let_go()
    assert not solution.converged and "cannot hold" in solution.message
    with pytest.raises(NotConverged, match="cannot hold"):
        solution.require_converged()
    assert solver.supported
    assert solver.solve(pulls(solver, 3.2)).converged  # and all is as it was


def test_one_finger_alone_holds_nothing(fingers):
    solver = GraspSolver(fingers[:1], sphere_body(0.112, 0.02, UP))
    solver.solve(pulls(solver, 3.2)).require_converged()
    assert not solver.let_go().converged


def test_a_force_that_comes_and_goes_leaves_no_trace(fingers):
    solver, before = held(fingers, 3.5)
    pushed = solver.solve({}, force=[0.02, 0.01, 0.0], moment=[0.0, 0.0, 0.0]).require_converged()
    assert pushed.body.pose.position[0] > 1e-5
    after = solver.solve({}, force=[0, 0, 0]).require_converged()
    assert np.allclose(after.body.pose.position, before.body.pose.position, atol=1e-9)


def test_what_a_force_does_is_stored_in_the_fingers(fingers):
    """Virtual work: dU / dF = F . dx / dF at given pulls."""
    solver, _ = held(fingers, 3.5, mass=0.0)

    def at(force):
        solution = solver.solve({}, force=[force, 0.0, 0.0]).require_converged()
        return sum(f.energy for f in solution.fingers), solution.body.pose.position[0]

    step, force = 1e-3, 0.03
    (low, x_low), (high, x_high) = at(force - step), at(force + step)
    assert high - low == pytest.approx(force * (x_high - x_low), rel=1e-4)


def test_heavier_is_lower_and_a_new_mass_is_kept(fingers):
    solver, light = held(fingers, 3.5, mass=0.01)
    heavy = solver.solve({}, mass=0.03).require_converged()
    assert heavy.body.mass == 0.03
    assert heavy.body.pose.position[2] < light.body.pose.position[2] - 1e-5
    force, _ = balance(heavy, np.array([0, 0, -G]))
    assert np.abs(force).max() < 1e-6


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_the_order_of_unlike_fingers_changes_nothing(fingers, friction):
    stiff = replace(fingers[1].finger, backbone_diameter=0.0029)
    short = replace(fingers[2].finger, length=0.175)
    unlike = [fingers[0], replace(fingers[1], finger=stiff), replace(fingers[2], finger=short)]
    ball = sphere_body(0.112, 0.02, UP, friction)
    found = []
    for order in (unlike, unlike[::-1]):
        solver = GraspSolver(order, ball)
        solver.solve({name: [0.006] for name in solver.names}).require_converged()
        found.append(solver.let_go().require_converged())
    one, two = found
    assert np.allclose(one.body.pose.position, two.body.pose.position, atol=1e-9)
    assert [(c.finger, c.disk) for c in one.contacts] == [(c.finger, c.disk) for c in two.contacts]
    assert np.allclose([c.force for c in one.contacts], [c.force for c in two.contacts], atol=1e-8)
    assert one.smallest_eigenvalue == pytest.approx(two.smallest_eigenvalue, rel=1e-6)


def test_a_rigid_motion_of_all_changes_nothing(fingers):
    turn = Pose(np.array([0.3, -0.2, 0.5]), np.array([0.5, -0.5, 0.5, 0.5]))
    moved = [MountedFinger(m.finger, turn @ m.base) for m in fingers]
    gravity = np.array([0.0, 0.0, -G])
    _, one = held(fingers, 3.4)
    _, two = held(
        moved, 3.4, body=sphere_body(0.112, 0.02, turn @ UP), gravity=turn.vectors(gravity)
    )
    assert np.allclose(turn.points(one.body.pose.position), two.body.pose.position, atol=1e-8)
    assert np.allclose([c.force for c in one.contacts], [c.force for c in two.contacts], atol=1e-7)
    assert one.smallest_eigenvalue == pytest.approx(two.smallest_eigenvalue, rel=1e-5)


def test_a_box_pressed_and_turned_has_the_derivatives_that_differences_give(fingers):
    """First and second derivatives of each finger's Lagrangian, in the object's motion too."""
    rng = np.random.default_rng(3)
    pose = Pose(np.array([-0.004, 0.006, 0.12]), np.array([0.1, 0.2, 0.3, 0.9]) / 0.974679434)
    body = Body(Box(np.zeros(3), np.array([0.10, 0.09, 0.11]), edge_radius=0.04), 0.02)
    hand = GraspSolver(fingers[1:2], body).hand
    problem = hand.problems[0]
    y = 0.02 * rng.standard_normal(problem.size)
    none = np.zeros((1, len(problem.points.labels)))
    (free,) = derive(hand, body, pose, [Guess(y, np.zeros(1), none)])
    forces = none.copy()
    near = free.point.pairs[:, 1]
    assert len(near) > 2
    forces[0, near] = rng.uniform(0.5, 2.0, len(near))
    tension = np.array([1.7])

    def gradient(dy, dq):
        there = displaced(pose, dq, hand.length)
        (part,) = derive(hand, body, there, [Guess(y + dy, tension, forces)])
        found = {int(k): i for i, k in enumerate(part.point.pairs[:, 1])}
        rows = [0, *(1 + found[int(k)] for k in near)]
        force = np.concatenate([tension, forces[0, near]])
        return part.point.at.y + force @ part.point.rows[rows], force @ part.columns[rows], part

    _, _, part = gradient(np.zeros(problem.size), np.zeros(6))
    h = 1e-6
    for i in range(6):
        dq = h * np.eye(6)[i]
        ahead, ahead_q, _ = gradient(0 * y, dq)
        behind, behind_q, _ = gradient(0 * y, -dq)
        assert np.allclose((ahead - behind) / (2 * h), part.border[:, i], atol=2e-6)
        if i < 3:  # turns do not commute: their first differences hold the gradient, too
            assert np.allclose((ahead_q - behind_q)[:3] / (2 * h), part.corner[i, :3], atol=2e-6)
    for i in rng.integers(0, problem.size, 5):
        dy = h * np.eye(problem.size)[i]
        _, ahead_q, _ = gradient(dy, np.zeros(6))
        _, behind_q, _ = gradient(-dy, np.zeros(6))
        assert np.allclose((ahead_q - behind_q) / (2 * h), part.border[i], atol=2e-6)
    # Distances along a turn, to second order.
    force = np.concatenate([tension, forces[0, near]])

    def energy(dq):
        moved = body.shape.moved(hand.in_base(0, displaced(pose, dq, hand.length)))
        distance = moved.signed_distance(part.point.at.points[near] * problem.finger.length)
        return -float(force[1:] @ distance) / problem.finger.length

    h = 1e-4
    for i in range(3, 6):
        for j in range(3, 6):
            a, b = h * np.eye(6)[i], h * np.eye(6)[j]
            mixed = energy(a + b) - energy(a - b) - energy(b - a) + energy(-a - b)
            assert mixed / (4 * h * h) == pytest.approx(part.corner[i, j], abs=2e-4)
    total = gather(hand, pose, [part], np.zeros(6))
    assert np.allclose(total.unbalanced, part.point.multipliers @ part.columns)


def test_bad_values_are_named(fingers):
    with pytest.raises(InvalidValue, match="at least one finger"):
        GraspSolver([], sphere_body(0.1))
    with pytest.raises(InvalidValue, match="youngs_modulus"):
        soft = MountedFinger(replace(fingers[0].finger, youngs_modulus=None), fingers[0].base)
        GraspSolver([soft], sphere_body(0.1, 0.1))
    for mass in (-0.1, float("nan"), float("inf")):
        with pytest.raises(InvalidValue, match="mass"):
            Body(Sphere(np.zeros(3), 0.05), mass)
    solver = GraspSolver(fingers, sphere_body(0.112, 0.02, UP))
    with pytest.raises(InvalidValue, match="called after a solve"):
        solver.let_go()
    with pytest.raises(UnknownName, match="finger_9"):
        solver.solve({"finger_9": [0.0]})
    with pytest.raises(InvalidValue, match=r"pulls\.finger_1\.main"):
        solver.solve({"finger_1": [0.3]})
    with pytest.raises(InvalidValue, match=r"pulls\.finger_1\.main: nan"):
        solver.solve({"finger_1": [float("nan")]})
    with pytest.raises(InvalidValue, match=r"pulls\.finger_1: "):
        solver.solve({"finger_1": [0.0, 0.0]})
    with pytest.raises(InvalidValue, match="force"):
        solver.solve({}, force=[0.0, float("nan"), 0.0])
    with pytest.raises(InvalidValue, match="overlaps the disk by"):
        GraspSolver(fingers, sphere_body(0.112, 0.02)).solve({})


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-3, 2.0, np.pi - 1e-9, np.pi])
def test_a_turn_is_what_leads_from_one_orientation_to_the_other(angle):
    axis = np.array([2.0, -1.0, 2.0]) / 3
    start = Pose(orientation=np.array([0.5, -0.5, 0.5, 0.5]))
    end = displaced(start, np.concatenate([np.zeros(3), angle * axis]), 1.0)
    turn = turn_between(start, end)
    assert np.linalg.norm(turn) == pytest.approx(angle, abs=1e-14)
    assert abs(turn @ axis) == pytest.approx(angle, abs=1e-14)
    assert np.allclose(displaced(start, np.append(np.zeros(3), turn), 1.0).rotation, end.rotation)
