# SPDX-License-Identifier: Apache-2.0
"""Loads that grow on a grasp until it slips and is lost."""

import math

import numpy as np
import pytest
from test_friction import G, pinch

from ccr_ros.grasp.quality import contacts_of, largest_load, payload_until_slip
from ccr_ros.grasp.statics import GraspSolver, sphere_body
from ccr_ros.model import InvalidValue, NotConverged, Pose, load_gripper
from ccr_ros.resources import find_config


@pytest.fixture(scope="module")
def pinched():
    solver = pinch(friction=0.5, mass=0.002)
    solver.let_go().require_converged()
    return solver


@pytest.fixture(scope="module")
def held():
    """A ball of 20 g on three fingertips that point down."""
    fingers = load_gripper(find_config("gripper_sphere")).fingers
    body = sphere_body(0.112, 0.02, Pose(np.array([0, 0, 0.110])), friction=0.5)
    solver = GraspSolver(fingers, body, gravity=np.array([0, 0, G]))
    length = solver.hand.problems[0].rest_lengths[0] * solver.hand.length
    solver.solve({name: [0.032 * length] for name in solver.names}).require_converged()
    solver.let_go().require_converged()
    return solver


def within_rigid_bound(loads):
    """What elastic fingers balance, rigid contacts with the same largest normal forces can."""
    contacts = contacts_of(loads.last)
    bound = largest_load(contacts, loads.last.body.pose.position, loads.direction)
    return loads.held <= bound.upper * (1 + 1e-6)


@pytest.mark.long
def test_a_pinch_is_lost_at_twice_friction_times_grip(pinched):
    before = pinched.standing
    loads = payload_until_slip(pinched)
    assert loads.present == pytest.approx(0.002 * G)
    assert np.allclose(loads.direction, [0, 0, -1])
    limit = sum(0.5 * c.force for c in loads.last.contacts)
    assert loads.held <= limit + 1e-9 and limit <= loads.lost_at
    assert loads.lost_at - loads.held <= 0.01 * sum(c.force for c in loads.last.contacts)
    assert loads.slips_at == loads.lost_at and not loads.first  # both slip at once, and it falls
    assert not loads.slipping
    assert within_rigid_bound(loads)
    # The solver is where it was.
    assert pinched.point is before.point and pinched.body is before.body
    assert np.array_equal(pinched.standing.outer, before.outer)


def test_a_ball_on_fingertips_slips_long_before_it_is_pushed_out(held):
    loads = payload_until_slip(held, np.array([0, 0, -2.0]), tolerance=0.02, largest=0.05)
    assert np.allclose(loads.direction, [0, 0, -1])
    assert loads.present == pytest.approx(-0.02 * G)  # the weight acts against the push
    assert "disk 9 cable main" in loads.first  # a fingertip
    assert loads.present < loads.slips_at < loads.present + 0.02
    assert loads.held == 0.05 and loads.lost_at == math.inf
    assert loads.last.stable and {c.status for c in loads.last.contacts} == {"slip"}
    assert within_rigid_bound(loads)


def test_a_small_load_does_nothing(pinched):
    loads = payload_until_slip(pinched, largest=0.03)
    assert loads.held == 0.03 and loads.slips_at == loads.lost_at == math.inf
    assert [c.status for c in loads.last.contacts] == ["stick", "stick"]


def test_bad_values_are_named(pinched):
    for given, named in (
        ({"direction": [0, 0, 0]}, "direction"),
        ({"direction": [0, math.nan, 0]}, "direction"),
        ({"largest": 0.01}, "largest"),
        ({"largest": math.nan}, "largest"),
        ({"tolerance": 0.0}, "tolerance"),
    ):
        with pytest.raises(InvalidValue, match=named):
            payload_until_slip(pinched, **given)
    with pytest.raises(InvalidValue, match="supported"):
        payload_until_slip(pinch(friction=0.5))


def test_a_grasp_that_is_not_stable_is_refused():
    slippery = pinch(friction=0.0, mass=0.0)
    assert not slippery.let_go().stable
    before = slippery.standing
    with pytest.raises(NotConverged, match="not stable"):
        payload_until_slip(slippery)
    assert slippery.point is before.point
