# SPDX-License-Identifier: Apache-2.0
"""Friction between fingers and object: known limits, energy, memory, invariance."""

import numpy as np
import pytest
from friction_cases import LONG, G, around, cube, on_four_cantilevers, pinch, three_on_a_ball

from ccr_ros.grasp.statics import GraspSolver, sphere_body
from ccr_ros.grasp.statics.friction import tangents_of
from ccr_ros.model import Pose, load_gripper
from ccr_ros.resources import find_config


def heaviest(solver, step):
    """Add weight until the grasp is lost; the last solution that was held."""
    held = solver.let_go().require_converged()
    for _ in range(200):
        solution = solver.solve({}, mass=held.body.mass + step)
        if not solution.converged:
            assert solver.body.mass == held.body.mass  # the last that was held
            return held
        held = solution
    raise AssertionError("it holds whatever it weighs")


@pytest.mark.parametrize("friction", [0.2, 0.5])
def test_a_pinch_carries_twice_mu_n_and_then_slips(friction):
    solver = pinch(friction)
    first = solver.let_go().require_converged()
    for contact in first.contacts:
        assert contact.status == "stick"
        assert contact.friction_force[2] == pytest.approx(-first.body.mass * G / 2, abs=1e-9)
        assert contact.margin == pytest.approx(
            1 - first.body.mass * G / 2 / (friction * contact.force), rel=1e-6
        )
    last = heaviest(solver, 5e-4)
    limit = sum(friction * c.force for c in last.contacts)
    assert last.body.mass * G <= limit * (1 + 1e-9)
    assert (last.body.mass + 5e-4) * G > limit * 0.999


def test_a_block_on_an_incline_slides_beyond_the_angle_of_friction():
    limit = np.arctan(0.3)
    stays = on_four_cantilevers(0.3, 0.99 * limit).let_go()
    assert stays.converged
    pushed = -sum(c.friction_force + c.force * c.normal for c in stays.contacts)
    weight = stays.body.mass * G
    assert pushed[0] == pytest.approx(-weight * np.sin(0.99 * limit), rel=1e-6)
    assert pushed[2] == pytest.approx(weight * np.cos(0.99 * limit), rel=1e-6)
    assert not on_four_cantilevers(0.3, 1.01 * limit).let_go().converged


def test_three_points_carry_a_ball_up_to_their_cones():
    """What the ball weighs is mu N and N along the surface there, three times."""
    last = heaviest(three_on_a_ball(0.5), 5e-4)
    carried = sum(0.5 * c.force * np.hypot(*c.normal[:2]) - c.force * c.normal[2]
                  for c in last.contacts)  # fmt: skip
    assert last.body.mass * G <= carried * (1 + 1e-9)
    assert (last.body.mass + 5e-4) * G > 0.999 * carried
    forces = np.array([[c.force, np.linalg.norm(c.friction_force)] for c in last.contacts])
    assert np.allclose(forces, forces[0], rtol=1e-5)  # symmetry


def dragged(steps):
    """A standing cube that a finger is drawn over, there and back: work, heat, what is stored."""
    body = cube(0.4, 0.0)
    solver = GraspSolver(around(1, 0.03), body, LONG)
    first = last = solver.solve({"finger_1": [0.0008]}).require_converged()
    work = heat = 0.0
    there = np.linspace(0.0008, 0.0016, steps)
    for pull in [*there[1:], *there[-2::-1]]:
        before, last = last, solver.solve({"finger_1": [pull]}).require_converged()
        assert last.contacts[0].status == "slip" and last.dissipated > 0
        tension = 0.5 * (before.fingers[0].tensions[0] + last.fingers[0].tensions[0])
        work += tension * (last.fingers[0].pulls[0] - before.fingers[0].pulls[0])
        heat += last.dissipated
    return work, heat, last.energy - first.energy


def test_work_is_what_is_stored_and_what_is_given_off():
    """To first order in the step: where the motion turns back the tension jumps."""
    errors = []
    for steps in (9, 17):
        work, heat, stored = dragged(steps)
        assert heat > 1e-4
        errors.append(abs(work - heat - stored) / heat)
    assert errors[1] < 0.05
    assert errors[1] < 0.6 * errors[0]


def test_while_all_sticks_the_way_back_is_the_way_there():
    solver = pinch(0.8)
    start = solver.let_go().require_converged()
    pushed = solver.solve({}, force=[0.0, 0.005, 0.0]).require_converged()
    assert all(c.status == "stick" and not c.slid.any() for c in pushed.contacts)
    assert pushed.body.pose.position[1] > start.body.pose.position[1] + 1e-4
    for a, b in zip(start.contacts, pushed.contacts, strict=True):
        before = start.body.pose.inverse().points(a.position)
        after = pushed.body.pose.inverse().points(b.position)
        assert np.allclose(before, after, atol=1e-9)
    back = solver.solve({}, force=[0.0, 0.0, 0.0]).require_converged()
    assert np.allclose(back.body.pose.position, start.body.pose.position, atol=1e-9)
    assert back.dissipated == pushed.dissipated == 0.0


def test_friction_is_against_the_slip_and_on_its_cone():
    body = cube(0.4, 0.0)
    solver = GraspSolver(around(1, 0.03), body, LONG)
    solver.solve({"finger_1": [0.0008]}).require_converged()
    for pull in (0.0012, 0.0016):
        contact = solver.solve({"finger_1": [pull]}).require_converged().contacts[0]
        assert contact.status == "slip" and contact.margin < 1e-6
        size = np.linalg.norm(contact.friction_force)
        assert size == pytest.approx(0.4 * contact.force, rel=1e-6)
        assert abs(contact.friction_force @ contact.normal) < 1e-9
        way = contact.slid / np.linalg.norm(contact.slid)
        assert contact.friction_force @ way == pytest.approx(-size, rel=1e-6)


def test_a_rigid_motion_of_all_changes_nothing():
    turn = Pose(np.array([0.3, -0.2, 0.5]), np.array([0.5, -0.5, 0.5, 0.5]))
    one, two = pinch(0.5).let_go(), pinch(0.5, turn=turn).let_go()
    assert one.converged and two.converged
    assert np.allclose(turn.points(one.body.pose.position), two.body.pose.position, atol=1e-8)
    for a, b in zip(one.contacts, two.contacts, strict=True):
        assert a.force == pytest.approx(b.force, rel=1e-6)
        assert np.allclose(turn.vectors(a.friction_force), b.friction_force, atol=1e-8)


def test_little_friction_is_nearly_none():
    fingers = load_gripper(find_config("gripper_sphere")).fingers
    poses = []
    for friction in (0.0, 1e-6):
        ball = sphere_body(0.112, 0.02, Pose(np.array([0.0, 0.0, 0.110])), friction)
        solver = GraspSolver(fingers, ball, LONG)
        solver.solve({name: [0.0058] for name in solver.names}).require_converged()
        solution = solver.let_go().require_converged()
        poses.append((solution.body.pose.position, sum(c.force for c in solution.contacts)))
    assert np.allclose(poses[0][0], poses[1][0], atol=2e-7)
    assert poses[0][1] == pytest.approx(poses[1][1], rel=1e-4)


def test_a_grasp_is_in_balance_with_friction():
    solver = pinch(0.6)
    solution = solver.let_go().require_converged()
    force = solution.body.mass * np.array([0.0, 0.0, -G])
    moment = np.zeros(3)
    for contact in solution.contacts:
        push = -contact.force * contact.normal - contact.friction_force
        force = force + push
        moment = moment + np.cross(contact.position - solution.body.pose.position, push)
    assert np.abs(force).max() < 1e-6 * solution.body.mass * G
    assert np.abs(moment).max() < 1e-6 * solution.body.mass * G * 0.04
    assert np.allclose(solution.net_force, 0, atol=1e-9)


def test_what_was_held_is_supported_where_it_is_and_let_go_again():
    solver = pinch(0.6)
    held = solver.let_go().require_converged()
    solver.support()
    stands = solver.solve({}).require_converged()
    assert stands.supported
    assert np.allclose(stands.body.pose.position, held.body.pose.position)
    again = solver.let_go().require_converged()
    assert np.allclose(again.body.pose.position, held.body.pose.position, atol=1e-9)
    solver.support(Pose(np.array([0.0, 0.0, 0.119])))
    moved = solver.solve({}).require_converged()
    assert moved.body.pose.position[2] == 0.119 and len(moved.contacts) == 2


def test_standing_and_resume_leave_no_trace():
    solver = pinch(0.6)
    held = solver.let_go().require_converged()
    stood = solver.standing
    solver.solve({}, mass=0.006).require_converged()
    solver.solve({"finger_1": [0.0011]})
    solver.resume(stood)
    same = solver.solve({}).require_converged()
    assert same.body.mass == held.body.mass
    assert np.allclose(same.body.pose.position, held.body.pose.position, atol=1e-12)
    assert [c.margin for c in same.contacts] == pytest.approx([c.margin for c in held.contacts])


def test_tangents_are_unit_and_normal():
    rng = np.random.default_rng(1)
    normals = rng.standard_normal((20, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    for normal, (first, second) in zip(normals, tangents_of(normals), strict=True):
        frame = np.column_stack([normal, first, second])
        assert np.allclose(frame.T @ frame, np.eye(3), atol=1e-12)


def test_a_body_of_another_friction_slips_sooner():
    margins = []
    for friction in (0.3, 0.6):
        solver = pinch(friction)
        margins.append(solver.let_go().require_converged().margin)
    assert margins[0] < margins[1]
