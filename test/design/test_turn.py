# SPDX-License-Identifier: Apache-2.0
"""How far grippers turn what they hold; and that of config/, which is made for a cube."""

from dataclasses import replace

import numpy as np
import pytest

from ccr_ros.design.turn import TurnTask, evaluate_turn, record_turn, scaled
from ccr_ros.grasp.manipulation import MoveLimits
from ccr_ros.grasp.statics import box_body
from ccr_ros.model import InvalidValue, Pose, SolverSettings, UnknownName, load_gripper
from ccr_ros.resources import find_config

LONG = SolverSettings(time_limit=60.0)
GRIP = {"finger_1": 0.12, "finger_2": 0.06, "finger_3": 0.06}
CUBE = box_body(np.full(3, 0.04), 0.01, Pose(np.array([0.0, 0.0, 0.17])), 0.8)
TASK = TurnTask(CUBE, GRIP, MoveLimits(margin=0.1, step=2e-4), farthest=np.deg2rad(20))


@pytest.fixture(scope="module")
def fingers():
    return load_gripper(find_config("gripper_cube")).fingers


@pytest.fixture(scope="module")
def turned(fingers):
    """The cube turned by 20 degrees both ways, which is where the plans end."""
    return evaluate_turn(fingers, TASK, LONG)


def test_the_cube_turns_20_degrees_both_ways_within_every_cone(turned):
    assert turned.held and turned.failure == ""
    assert turned.hold.stable and not turned.hold.supported and turned.hold.margin > 0.4
    assert {c.finger for c in turned.hold.contacts} == set(GRIP)
    left, right = turned.ways
    assert left.plan.reached and right.plan.reached
    assert np.rad2deg(left.plan.moved[5]) == pytest.approx(20, abs=0.3)
    assert np.rad2deg(right.plan.moved[5]) == pytest.approx(-20, abs=0.3)
    assert min(left.plan.margin, right.plan.margin) > 0.07  # 0.1 to first order
    assert turned.reached(np.deg2rad(20)) and not turned.reached(np.deg2rad(21))


@pytest.mark.long
def test_with_straight_cables_it_turns_30_degrees_both_ways():
    fingers = load_gripper(find_config("gripper_cube_straight")).fingers
    result = evaluate_turn(fingers, replace(TASK, farthest=np.deg2rad(30)), LONG)
    assert result.hold.stable and result.hold.margin > 0.4
    assert result.reached(np.deg2rad(30))
    assert min(way.plan.margin for way in result.ways) > 0.07


def test_a_record_goes_from_one_end_to_the_other_through_the_hold(turned):
    record = record_turn(turned)
    assert np.rad2deg(record.angles[[0, -1]]) == pytest.approx([-20, 20], abs=0.3)
    middle = int(np.argmin(np.abs(record.angles)))
    assert record.angles[middle] == 0
    assert (record.angles[:middle] < 0).all() and (record.angles[middle + 1 :] > 0).all()
    assert record.forces[middle].sum() == pytest.approx(sum(c.force for c in turned.hold.contacts))
    assert np.nanmin(record.margins[middle]) == pytest.approx(turned.hold.margin, abs=1e-6)
    right = turned.ways[1].plan
    assert np.nanmin(record.margins[0]) == pytest.approx(right.waypoints[-1].margin, abs=1e-3)
    np.testing.assert_allclose(
        record.pulls[0], np.concatenate([*right.waypoints[-1].pulls.values()])
    )
    assert record.cables[:2] == ("finger_1.left", "finger_1.right")
    assert record.pulls.shape == (len(record.angles), 4)


def test_a_record_of_one_way_alone_does_not_come_back(turned):
    """Where the turn to the right does not get on at all the hold is not told twice."""
    left, right = turned.ways
    stuck = replace(right, plan=replace(right.plan, waypoints=right.plan.waypoints[:1]))
    record = record_turn(replace(turned, ways=(left, stuck)))
    np.testing.assert_allclose(record.angles, [w.moved[5] for w in left.plan.waypoints])


def test_the_solver_stays_at_the_hold(turned):
    here = turned.solver.solve({})
    np.testing.assert_allclose(here.body.pose.position, turned.hold.body.pose.position, atol=1e-9)


@pytest.mark.long
def test_where_little_is_gained_a_turn_ends(fingers):
    lazy = replace(TASK, farthest=np.deg2rad(90), stall=np.deg2rad(60), patience=2)
    result = evaluate_turn(fingers, lazy, LONG, lambda r: not r.ways)
    (way,) = result.ways
    assert way.plan.moved[5] > 0 and len(way.plan.waypoints) == 4
    assert way.limiting.startswith("2 more steps of 0.2 mm turn it by less than 60 deg")


def test_what_slips_off_is_not_held(fingers):
    ice = replace(TASK, body=replace(CUBE, friction=0.05))
    result = evaluate_turn(fingers, ice, LONG)
    assert not result.held and result.failure and result.ways == () and result.angle == 0
    assert not result.reached(np.deg2rad(1))


def test_a_caller_may_ask_for_the_hold_alone(fingers):
    result = evaluate_turn(fingers, TASK, LONG, lambda r: False)
    assert result.held and result.ways == ()


def test_forces_scale():
    assert scaled(TASK, 2.0).forces["finger_1"] == pytest.approx(0.24)
    assert scaled(replace(TASK, forces=0.1), 0.5).forces == pytest.approx(0.05)


def test_what_does_not_fit_is_refused(fingers):
    with pytest.raises(UnknownName, match="thumb"):
        evaluate_turn(fingers, replace(TASK, forces={**GRIP, "thumb": 1.0}), LONG)
    with pytest.raises(InvalidValue, match="forces"):
        evaluate_turn(fingers, replace(TASK, forces=float("nan")), LONG)
    with pytest.raises(UnknownName, match="thumb"):
        limits = MoveLimits(pulls={"thumb": np.zeros((1, 2))})
        evaluate_turn(fingers, replace(TASK, limits=limits), LONG)
    for key, bad in (("farthest", 0.0), ("farthest", 4.0), ("stall", -1.0), ("patience", 0)):
        with pytest.raises(InvalidValue, match=key):
            replace(TASK, **{key: bad})
