# SPDX-License-Identifier: Apache-2.0
"""An object between running fingers: what is said of it, and what becomes of it."""

import numpy as np
import pytest

from ccr_ros.grasp.live import LiveGrasp
from ccr_ros.grasp.statics import sphere_body
from ccr_ros.model import InvalidValue, Pose, SolverSettings, load_gripper
from ccr_ros.resources import find_config

G = 9.80665
UPWARDS, DOWNWARDS = np.array([0.0, 0.0, -G]), np.array([0.0, 0.0, G])  # what the gripper points
PLACE = Pose(np.array([0.0, 0.0, 0.110]))
ELSEWHERE = Pose(np.array([0.0, 0.0, 0.108]))
LIGHT, HEAVY, TOO_HEAVY = 0.02, 0.04, 0.2
SHUT, OPEN = 0.0059, 0.0045  # m


@pytest.fixture(scope="module")
def fingers():
    return load_gripper(find_config("gripper_sphere")).fingers


@pytest.fixture
def live(fingers):
    """The ball on its stand, in a gripper that points up."""
    return started(fingers, UPWARDS)


@pytest.fixture
def hanging(fingers):
    """The ball held by a gripper that points down."""
    live = started(fingers, DOWNWARDS)
    live.want(PLACE, LIGHT, True)
    pull(live, SHUT)
    assert live.held
    return live


def started(fingers, gravity):
    body = sphere_body(0.112, LIGHT, PLACE)
    return LiveGrasp(fingers, body, SolverSettings(time_limit=20.0), gravity)


def pull(live, value):
    return live.solve({name: [value] for name in ("finger_1", "finger_2", "finger_3")})


def height(live):
    assert live.solution.body.pose is live.body.pose or live.failure
    return live.solution.body.pose.position[2]


def test_it_stands_until_it_shall_be_held(live):
    standing = pull(live, SHUT)
    assert (live.supported, live.held, live.failure, live.refusal) == (True, False, "", "")
    assert height(live) == 0.110 and abs(standing.net_force[2]) > 0.1
    assert live.want(PLACE, LIGHT, True)
    held = pull(live, SHUT)
    assert live.held and not live.supported
    assert height(live) < 0.109 and np.abs(held.net_force).max() < 1e-6
    assert not live.want(PLACE, LIGHT, True)  # as it is already


def test_a_new_mass_counts_while_it_is_held_and_while_it_stands(live):
    live.want(PLACE, LIGHT, True)
    pull(live, SHUT)
    light = height(live)
    assert live.want(PLACE, HEAVY, True)
    assert pull(live, SHUT).body.mass == HEAVY
    assert height(live) < light - 1e-5
    assert live.want(PLACE, LIGHT, False)
    assert pull(live, SHUT).body.mass == LIGHT


def test_put_down_it_stays_where_it_is_unless_another_pose_is_said(live):
    live.want(PLACE, LIGHT, True)
    pull(live, SHUT)
    held = height(live)
    assert live.want(PLACE, LIGHT, False)
    pull(live, SHUT)
    assert live.supported and height(live) == held
    assert not live.want(PLACE, LIGHT, False)
    assert live.want(ELSEWHERE, LIGHT, False)
    pull(live, SHUT)
    assert height(live) == 0.108


def test_put_down_with_friction_no_finger_slips(fingers):
    body = sphere_body(0.112, LIGHT, PLACE, friction=0.5)
    live = LiveGrasp(fingers, body, SolverSettings(time_limit=20.0), UPWARDS)
    pull(live, SHUT)
    live.want(PLACE, LIGHT, True)
    held = pull(live, SHUT)
    assert live.held
    live.want(PLACE, LIGHT, False)
    stands = pull(live, SHUT)
    assert live.supported and len(stands.contacts) == len(held.contacts)
    for before, after in zip(held.contacts, stands.contacts, strict=True):
        np.testing.assert_allclose(after.force, before.force, rtol=1e-4)
        np.testing.assert_allclose(after.friction_force, before.friction_force, atol=1e-5)


def test_a_pose_that_is_said_of_a_held_object_counts_for_nothing(live):
    live.want(PLACE, LIGHT, True)
    pull(live, SHUT)
    held = height(live)
    assert not live.want(ELSEWHERE, LIGHT, True)
    pull(live, SHUT)
    assert height(live) == pytest.approx(held, abs=1e-9)


def test_it_may_be_put_elsewhere_and_let_go_of_at_once(live):
    pull(live, SHUT)
    assert live.want(ELSEWHERE, LIGHT, True)
    pull(live, SHUT)
    assert live.held and height(live) < 0.108


def test_what_nobody_touches_is_not_let_go_of_until_it_is_asked_for_again(live):
    live.want(PLACE, LIGHT, True)
    pull(live, OPEN)
    assert not live.held and live.supported and not live.failure
    assert "no finger touches it" in live.refusal
    pull(live, SHUT)  # pulls alone do not ask for it
    assert not live.held and live.refusal
    assert live.want(PLACE, LIGHT, True)
    pull(live, SHUT)
    assert live.held and not live.refusal


@pytest.mark.long
def test_what_is_too_heavy_stands_and_says_so(fingers):
    live = started(fingers, DOWNWARDS)
    live.want(PLACE, TOO_HEAVY, True)
    found = pull(live, SHUT)
    assert found.converged and found is live.solution
    assert live.supported and not live.held and not live.failure
    assert "cannot hold" in live.refusal
    live.want(PLACE, TOO_HEAVY, False)
    assert not live.refusal


@pytest.mark.long
def test_what_gets_too_heavy_is_dropped_and_the_last_pose_stays(hanging):
    before = hanging.solution
    hanging.want(PLACE, TOO_HEAVY, True)
    assert not pull(hanging, SHUT).converged
    assert not hanging.held and hanging.failure.startswith("dropped: ")
    assert hanging.solution is before
    found = pull(hanging, SHUT)
    assert pull(hanging, SHUT + 1e-7) is found  # which is not tried again
    # Pulls and wishes that can be met again are.
    assert hanging.want(PLACE, LIGHT, True)
    pull(hanging, SHUT)
    assert hanging.held and not hanging.failure


def test_what_nobody_touches_any_more_is_dropped_and_comes_back_where_it_is_said_to_be(live):
    live.want(PLACE, 0.0, True)
    pull(live, SHUT)
    assert live.held
    before = live.solution
    pull(live, 0.0)
    assert not live.held and live.solution is before
    assert "dropped: no finger touches it" in live.failure
    assert live.place(PLACE, False) is PLACE
    assert live.want(PLACE, LIGHT, False)
    pull(live, SHUT)
    assert live.supported and not live.failure and height(live) == 0.110
    assert live.want(PLACE, LIGHT, True)
    pull(live, SHUT)
    assert live.held


def test_it_may_start_elsewhere_than_is_said(fingers):
    body = sphere_body(0.112, LIGHT, PLACE)
    live = LiveGrasp(fingers, body, SolverSettings(), UPWARDS, at=ELSEWHERE)
    assert live.body.pose is ELSEWHERE
    assert not live.want(PLACE, LIGHT, False)  # the same as before: it is where it is
    pull(live, SHUT)
    assert height(live) == 0.108


def test_bad_pulls_are_named_and_change_nothing(live):
    pull(live, SHUT)
    before = live.solution
    with pytest.raises(InvalidValue, match="nan"):
        live.solve({"finger_1": [float("nan")]})
    assert live.solution is before and not live.failure
