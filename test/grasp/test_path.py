# SPDX-License-Identifier: Apache-2.0
"""Walking to other pulls and loads: what ends a walk, and how soon."""

import numpy as np
import pytest
from friction_cases import LONG, around, cube, pinch, three_on_a_ball

from ccr_ros.grasp.live import LiveGrasp
from ccr_ros.grasp.statics import GraspSolver, sphere_body
from ccr_ros.grasp.statics.path import Way
from ccr_ros.grasp.statics.result import make_grasp_solution
from ccr_ros.model import Pose, load_gripper
from ccr_ros.resources import find_config

# Newton steps; of 5 ms each. Half of them get to where there is no equilibrium any more.
FEW = 70


def sphere_gripper(friction, pull, gravity=-9.80665):
    """The paper's gripper around a ball of 20 g that stands."""
    fingers = load_gripper(find_config("gripper_sphere")).fingers
    ball = sphere_body(0.112, 0.02, Pose(np.array([0.0, 0.0, 0.110])), friction)
    solver = GraspSolver(fingers, ball, LONG, gravity=np.array([0.0, 0.0, gravity]))
    solver.solve({name: [pull] for name in solver.names}).require_converged()
    return solver


def hanging():
    """It points down; without friction."""
    return sphere_gripper(0.0, 0.0059, gravity=9.80665)


LOST = {
    "a pinch that is too heavy": (lambda: pinch(0.5), {"mass": 0.02}),
    "a ball pulled out": (lambda: three_on_a_ball(0.2), {"force": [0.06, 0.02, -0.04]}),
    "a ball that hangs, too heavy": (hanging, {"mass": 0.2}),
    "a gripper that hangs and opens": (hanging, {"pulls": 0.0}),
}


@pytest.mark.parametrize("case", sorted(LOST))
def test_that_there_is_no_equilibrium_is_found_in_few_steps(case):
    make, wanted = LOST[case]
    solver = make()
    solver.let_go().require_converged()
    wanted, pulls = dict(wanted), {}
    if "pulls" in wanted:
        pull = wanted.pop("pulls")
        pulls = {name: [pull] for name in solver.names}
    lost = solver.solve(pulls, **wanted, snap=False)
    assert not lost.converged and "cannot hold" in lost.message
    assert lost.iterations < FEW


def test_a_point_that_has_only_touched_slips_on_at_the_next_pull():
    """To stick it would have to be pulled on to the surface; it slips, which one step finds."""
    solver = GraspSolver(around(2, 0.03), cube(0.5, 0.002), LONG, friction_step=0.0025)
    solver.solve({"finger_1": [0.0004], "finger_2": [0.0004]}).require_converged()
    touching = solver.solve({"finger_1": [0.0002]}).require_converged()
    assert touching.margin == pytest.approx(1.0)  # no friction yet
    pressing = solver.solve({"finger_1": [0.0003], "finger_2": [0.00045]}).require_converged()
    assert pressing.substeps == 1 and pressing.iterations < 9
    slipped = next(c for c in pressing.contacts if c.finger == "finger_2")
    assert slipped.status == "slip" and slipped.margin < 1e-6


PUSH = [0.06, 0.02, -0.04]  # N; beyond the ball's cones


def test_a_ball_that_falls_is_caught_lower_down_and_that_is_told():
    """There is an equilibrium 12 mm lower, which no small step leads to."""
    solver = three_on_a_ball(0.2)
    held = solver.let_go().require_converged()
    caught = solver.solve({}, force=PUSH).require_converged()
    way = caught.body.pose.position - held.body.pose.position
    assert way[2] < -0.012 and np.allclose(caught.snapped, way, atol=1e-3)
    assert caught.stable and caught.message.startswith("the object snapped 12.5 mm")
    assert np.abs(caught.net_force).max() < 1e-7 and np.abs(caught.net_moment).max() < 1e-8
    # It goes on from there, with friction again.
    on = solver.solve({}, force=[0.061, 0.02, -0.04]).require_converged()
    assert not on.snapped.any() and not on.message
    assert all(c.friction_force.any() and c.margin < 1.0 for c in on.contacts)
    back = solver.solve({}, force=[0.0, 0.0, 0.0]).require_converged()  # it does not go up again
    assert back.body.pose.position[2] < held.body.pose.position[2] - 0.01


def test_where_it_may_not_snap_it_is_lost():
    solver = three_on_a_ball(0.2)
    held = solver.let_go().require_converged()
    lost = solver.solve({}, force=PUSH, snap=False)
    assert not lost.converged and "cannot hold" in lost.message and not lost.snapped.any()
    again = solver.solve({}).require_converged()  # where it was, under the load before
    assert np.allclose(again.body.pose.position, held.body.pose.position, atol=1e-9)


def test_a_running_gripper_drops_what_would_snap():
    aslant = np.array([30.0, 10.0, -30.0])  # m/s^2
    ball = sphere_body(0.04, 0.0005, Pose(np.array([0.0, 0.0, 0.118])), 0.2)
    live = LiveGrasp(around(3, 0.03), ball, LONG, aslant)
    pulls = {f"finger_{k}": [0.0008] for k in (1, 2, 3)}
    live.want(ball.pose, ball.mass, True)
    live.solve(pulls)
    assert live.held
    other = live.copy(60.0)
    live.want(ball.pose, 0.002, True)
    assert not live.solve(pulls).converged
    assert not live.held and live.failure.startswith("dropped: ")
    assert other.solve({}, mass=0.002).require_converged().snapped[2] < -0.01


JAMS = {
    "let go": (2.0, 0.0056, {"mass": 0.02}),
    "pulled upwards": (0.5, 0.0056, {"force": [0.0, 0.0, 1.0]}),
    "pushed aside": (0.8, 0.0056, {"force": [0.3, 0.0, 0.0]}),
}


@pytest.mark.parametrize("case", sorted(JAMS))
def test_points_that_slip_beside_others_do_not_jam_the_search(case):
    """All have an equilibrium; principal pivots went round, and the ball was taken for lost."""
    friction, pull, load = JAMS[case]
    solver = sphere_gripper(friction, pull)
    solver.let_go().require_converged()
    found = solver.solve({}, **load, snap=False).require_converged()
    grip = sum(contact.force for contact in found.contacts)
    assert np.abs(found.net_force).max() < 1e-6 * grip
    for contact in found.contacts:
        along = float(np.linalg.norm(contact.friction_force))
        assert along <= friction * contact.force * (1 + 1e-6) + 1e-12


def test_what_ends_just_before_its_target_has_not_come_to_all_of_it():
    solver = pinch(0.5)
    solver.let_go().require_converged()
    way = Way(solver.point, list(solver.pulls.values()), reached=0.9999)
    told = make_grasp_solution(solver.hand, solver.body, way, way.pulls, False, 0.0)
    assert not told.converged and "beyond 99.9% of the way" in told.message
