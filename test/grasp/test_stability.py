# SPDX-License-Identifier: Apache-2.0
"""Stability of a grasp: what the factorisation says is what the smallest eigenvalue says."""

import numpy as np
import pytest
from friction_cases import around, pinch, three_on_a_ball

from ccr_ros.grasp.statics import GraspSolver, capsule_body, sphere_body
from ccr_ros.grasp.statics.stability import STABLE
from ccr_ros.model import Pose, load_gripper
from ccr_ros.resources import find_config


def on_a_ball(held=True, friction=0.0):
    fingers = load_gripper(find_config("gripper_sphere")).fingers
    body = sphere_body(0.112, 0.02, Pose(np.array([0.0, 0.0, 0.110])), friction)
    solver = GraspSolver(fingers, body)
    pulls = 0.032 * solver.hand.problems[0].rest_lengths * solver.hand.length
    solution = solver.solve(dict.fromkeys(solver.names, pulls)).require_converged()
    return solver.let_go().require_converged() if held else solution


CASES = {
    "supported": lambda: on_a_ball(held=False),
    "ball": on_a_ball,
    "ball with friction": lambda: on_a_ball(friction=0.5),
    "pinch": lambda: pinch().let_go(),
    "three points": lambda: three_on_a_ball().let_go(),
    "balanced": lambda: balanced(),
}


def balanced():
    """A capsule between two fingers' tips without friction: it turns out at the least touch."""
    body = capsule_body(0.04, 0.02, 0.0, Pose(np.array([0.0, 0.0, 0.118])))
    solver = GraspSolver(around(2, 0.03), body)
    solver.solve({name: [0.0008] for name in solver.names}).require_converged()
    return solver.let_go()


@pytest.mark.parametrize("case", CASES)
def test_a_bound_is_exceeded_if_the_eigenvalue_is_above_it(case):
    solution = CASES[case]()
    value = solution.smallest_eigenvalue
    assert solution.stable == (value > STABLE)
    for change in (-0.1, -1e-4, 1e-4, 0.1):
        bound = value + change * abs(value)
        assert solution.stability.exceeds(bound) == (change < 0)
    stability = solution.stability
    decomposed, _ = stability._by_decomposition(stability._basis())
    assert value == pytest.approx(decomposed, rel=1e-8)
    assert all(f.certificate.stable == solution.stable for f in solution.fingers)
    assert all(np.isnan(f.certificate.smallest_eigenvalue) for f in solution.fingers)


def test_a_stable_grasp_is_told_without_the_eigenvalue():
    stability = on_a_ball().stability
    assert stability.exceeds(STABLE)
    assert "_softest" not in vars(stability)


def test_what_moves_most_easily_is_said():
    solution = balanced()
    assert solution.converged and not solution.stable
    assert solution.softest == "the object moves along y"  # at right angles to the fingers
    assert solution.message.startswith("the grasp is not stable: the object moves along y")


def test_where_contacts_slip_it_is_said_that_they_count_as_free():
    fingers = load_gripper(find_config("gripper_sphere")).fingers
    ball = sphere_body(0.112, 0.02, Pose(np.array([0.0, 0.0, 0.110])), 0.5)
    solver = GraspSolver(fingers, ball)
    solution = solver.solve({name: [0.0062] for name in solver.names}).require_converged()
    assert {c.status for c in solution.contacts} == {"slip"} and not solution.stable
    assert solution.message.endswith("at the slightest disturbance, what slips taken as free")
