# SPDX-License-Identifier: Apache-2.0
"""An object between running fingers: what is said of it, and what becomes of it."""

from dataclasses import replace

import numpy as np
import pytest

from ccr_ros.grasp.live import LiveGrasp
from ccr_ros.grasp.statics import Body, DiskShape, sphere_body
from ccr_ros.model import Box, InvalidValue, Pose, SolverSettings, load_gripper
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


CUBE_SHUT = {"finger_1": [0.00217] * 2, "finger_2": [0.003524], "finger_3": [0.003524]}


def opening(live, by):
    """Open the cube's gripper by so much [m]."""
    return live.solve({name: [max(p - by, 0.0) for p in ps] for name, ps in CUBE_SHUT.items()})


@pytest.fixture
def carried():
    """The cube, carried by friction."""
    shape = Box(np.zeros(3), np.full(3, 0.04), edge_radius=0.001, name="cube")
    body = Body(shape, 0.01, Pose(np.array([0.0, 0.0, 0.170])), 0.8)
    cube_fingers = load_gripper(find_config("gripper_cube")).fingers
    live = LiveGrasp(cube_fingers, body, SolverSettings(time_limit=20.0), UPWARDS)
    live.want(body.pose, body.mass, True)
    opening(live, 0.0)
    assert live.held and not live.lost
    return live


def test_what_opening_fingers_let_fall_is_lost_and_nothing_is_solved_with_it(carried):
    place, tries = carried.body.pose, 0
    for step in range(1, 40):
        found = opening(carried, 8e-5 * step)
        tries += bool(carried.failure)
        if carried.lost:
            break
    assert carried.lost and not carried.held and carried.failure.startswith("dropped: no finger")
    assert tries <= 2  # one that was walked, and one that need not be
    assert opening(carried, 0.003) is found and opening(carried, 0.0) is found
    # It has to stand somewhere before it can be held again.
    assert not carried.want(place, 0.01, True) and not carried.want(place, 0.02, True)
    assert opening(carried, 0.0) is found
    assert carried.want(PLACE, 0.01, False) and not carried.lost
    opening(carried, 0.003)
    assert carried.supported and not carried.failure and carried.body.pose is PLACE


def test_out_of_reach_at_once_it_is_lost_without_another_try(carried):
    found = opening(carried, 1.0)  # wide open in one message
    assert carried.lost and "no finger touches it" in carried.failure
    assert opening(carried, 0.0) is found


def test_what_fails_while_fingers_press_is_tried_again(carried):
    before = carried.solution
    carried.want(carried.body.pose, 0.1, True)  # more than friction carries
    assert not opening(carried, 0.0).converged
    assert carried.failure and not carried.lost and carried.solution is before
    assert carried.want(carried.body.pose, 0.01, True)
    assert opening(carried, 0.0).converged and carried.held


def test_disks_press_on_each_other_where_they_shall(fingers):
    body = sphere_body(0.01, pose=Pose(np.array([0.0, 0.0, 0.5])))
    disks = DiskShape(rim=0.0015)
    live = LiveGrasp(fingers, body, SolverSettings(time_limit=20.0), UPWARDS, disks=disks)
    assert len(pull(live, 0.047 * 0.182).disk_contacts) == 3
    copy = live.copy(1.0)
    assert copy.disks == disks and len(copy.solve({}).disk_contacts) == 3


def test_what_fell_onto_a_finger_s_base_is_no_grip_to_be_measured(hanging, fingers):
    base = fingers[0].base.position
    hanging._solver.body = replace(hanging.body, pose=Pose(base))
    hanging.want(PLACE, TOO_HEAVY, True)
    pull(hanging, SHUT)
    assert hanging.failure.startswith("dropped: ") and not hanging.lost
