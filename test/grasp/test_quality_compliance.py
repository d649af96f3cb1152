# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from test_friction import G, pinch

from ccr_ros.grasp.quality import compliance_of
from ccr_ros.grasp.statics import GraspSolver, sphere_body
from ccr_ros.model import InvalidValue, NotConverged, Pose, load_gripper
from ccr_ros.resources import find_config


@pytest.fixture(scope="module")
def pinched():
    solver = pinch(friction=0.5, mass=0.002)
    solver.let_go().require_converged()
    return solver


def test_what_a_pinch_holds_swings_about_the_line_between_its_contacts(pinched):
    """Only its weight, which hangs a little below that line, turns it back: M = m g h angle."""
    before = pinched.standing
    found = compliance_of(pinched, length=0.02)
    assert found.softest_in_words == "a moment about x"
    solution = pinched.solve({})
    above = np.mean([c.position[2] for c in solution.contacts]) - solution.body.pose.position[2]
    assert above > 5e-4
    assert found.matrix[3, 3] == pytest.approx(0.02**2 / (0.002 * G * above), rel=0.01)
    assert 1 / found.stiffness >= found.matrix[3, 3] * (1 - 1e-9)
    pinched.resume(before)


def test_while_contacts_stick_loads_and_motions_are_reciprocal(pinched):
    """Maxwell and Betti: the motion along i by a load along j is that along j by one along i."""
    before = pinched.standing
    found = compliance_of(pinched)
    assert pinched.point is before.point and pinched.body is before.body
    size = np.sqrt(np.abs(np.outer(np.diag(found.matrix), np.diag(found.matrix))))
    assert np.all(np.abs(found.matrix - found.matrix.T) <= 0.01 * size + 1e-6 * size.max())
    assert np.linalg.eigvalsh(found.matrix + found.matrix.T).min() > -1e-4


def test_a_ball_without_friction_turns_freely():
    fingers = load_gripper(find_config("gripper_sphere")).fingers
    body = sphere_body(0.112, 0.02, Pose(np.array([0, 0, 0.110])))
    solver = GraspSolver(fingers, body)
    length = solver.hand.problems[0].rest_lengths[0] * solver.hand.length
    solver.solve({name: [0.035 * length] for name in solver.names}).require_converged()
    solver.let_go().require_converged()
    found = compliance_of(solver)
    assert found.stiffness == 0
    assert found.softest_in_words == "a moment about x"
    assert found.matrix[3, 3] == np.inf


def test_bad_values_are_named(pinched):
    for length in (0.0, -1.0, np.nan):
        with pytest.raises(InvalidValue, match="length"):
            compliance_of(pinched, length)
    with pytest.raises(InvalidValue, match="supported"):
        compliance_of(pinch(friction=0.5))


def test_a_grasp_that_is_not_stable_is_refused():
    slippery = pinch(friction=0.0, mass=0.0)
    assert not slippery.let_go().stable
    before = slippery.standing
    with pytest.raises(NotConverged, match="not stable"):
        compliance_of(slippery)
    assert slippery.point is before.point
