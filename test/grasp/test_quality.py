# SPDX-License-Identifier: Apache-2.0
import math

import numpy as np
import pytest
from quality_cases import CENTRE, EQUATOR, PINCH, on_ball

from ccr_ros.grasp.quality import contacts_of, ferrari_canny, grasp_quality, quality_of
from ccr_ros.grasp.statics import GraspSolver, sphere_body
from ccr_ros.model import InvalidValue, Pose, load_gripper
from ccr_ros.resources import find_config

DOWNWARDS = np.array([0, 0, 9.80665])  # gravity in the frame of a gripper that points down


@pytest.fixture(scope="module")
def held():
    """A ball of 20 g with friction in the paper's sphere gripper, which points down."""
    fingers = load_gripper(find_config("gripper_sphere")).fingers
    body = sphere_body(0.112, 0.02, Pose(np.array([0, 0, 0.110])), friction=0.5)
    solver = GraspSolver(fingers, body, gravity=DOWNWARDS)
    length = solver.hand.problems[0].rest_lengths[0] * solver.hand.length
    solver.solve({name: [0.032 * length] for name in solver.names}).require_converged()
    return solver.let_go().require_converged()


def test_all_measures_of_a_grasp_at_once():
    contacts = on_ball(EQUATOR, 0.5, force=2.0, friction_force=[0, 0, 0.25], limit=2.0)
    quality = grasp_quality(contacts, CENTRE)
    assert quality.margin == pytest.approx(0.75)
    assert quality.force_closure
    assert quality.payload == pytest.approx(3.0, rel=2e-3)
    exact = ferrari_canny(contacts, CENTRE, tolerance=0.02)
    assert quality.epsilon <= exact.upper and exact.lower <= quality.epsilon_upper
    assert 0.8 * quality.epsilon_upper < quality.epsilon
    assert quality.length == pytest.approx(1)
    assert np.linalg.norm(quality.weakest) == pytest.approx(1)
    assert quality.weakest_in_words


def test_a_grasp_that_does_not_close_can_still_carry():
    quality = grasp_quality(on_ball(PINCH, 0.5, limit=2.0), CENTRE)
    assert not quality.force_closure and quality.epsilon == quality.epsilon_upper == 0
    assert quality.weakest_in_words in ("a moment about x", "a moment about -x")
    assert quality.payload == pytest.approx(2.0, rel=2e-3)
    assert math.isnan(quality.margin)


def test_nothing_is_no_grasp():
    quality = grasp_quality([], CENTRE)
    assert not quality.force_closure and quality.epsilon == 0 and quality.payload == 0


def test_the_payload_is_along_gravity():
    contacts = on_ball(PINCH, 0.5, limit=2.0)
    sideways = grasp_quality(contacts, CENTRE, gravity=np.array([9.8, 0, 0]))
    assert sideways.payload == pytest.approx(2.0, rel=2e-3)
    with pytest.raises(InvalidValue, match="gravity"):
        grasp_quality(contacts, CENTRE, gravity=np.zeros(3))


def test_a_held_ball(held):
    """Its tips are below the ball: it cannot fall, but nothing keeps it from being pushed up."""
    assert min(c.position[2] for c in held.contacts) > held.body.pose.position[2] + 0.03
    quality = quality_of(held, gravity=DOWNWARDS)
    assert quality.margin == pytest.approx(held.margin, abs=1e-9)
    assert not quality.force_closure and quality.epsilon == 0
    assert quality.weakest_in_words == "a force along -z"  # towards the palm, here upwards
    assert quality.length == pytest.approx(0.056, rel=1e-3)  # its radius
    # It carries the ball, and its forces could be spread better, but not without end.
    assert held.body.mass * 9.80665 < quality.payload < 1.5 * sum(c.force for c in held.contacts)


def test_the_payload_of_a_held_ball_follows_the_limit(held):
    one, two = (quality_of(held, gravity=DOWNWARDS, limit=f).payload for f in (0.1, 0.2))
    assert two == pytest.approx(2 * one, rel=5e-3)
    with pytest.raises(InvalidValue, match="limit"):
        quality_of(held, limit=-1.0)


def test_the_contacts_of_a_held_ball_balance_its_weight(held):
    contacts = contacts_of(held)
    assert len(contacts) == len(held.contacts) >= 3
    on_fingers = sum(c.force * c.normal + c.friction_force for c in contacts)
    assert np.allclose(on_fingers, held.body.mass * DOWNWARDS, atol=1e-7)
