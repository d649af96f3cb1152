# SPDX-License-Identifier: Apache-2.0
"""A plan made a solve at a time, on a copy of a grasp that goes on by itself."""

import numpy as np
import pytest
from friction_cases import LONG

from ccr_ros.grasp.live import LiveGrasp
from ccr_ros.grasp.manipulation import MovePlan, MoveTarget, move_steps, plan_move
from ccr_ros.grasp.statics import Body
from ccr_ros.grasp.statics.body import GRAVITY
from ccr_ros.model import Box, InvalidValue, Pose, load_gripper
from ccr_ros.resources import find_config

PULLS = {"finger_1": [0.00217, 0.00217], "finger_2": [0.003524], "finger_3": [0.003524]}
TURN = MoveTarget(turn=np.array([0.0, 0.0, 0.2]))


@pytest.fixture(scope="module")
def live():
    fingers = load_gripper(find_config("gripper_cube")).fingers
    shape = Box(np.zeros(3), np.full(3, 0.04), edge_radius=0.001, name="cube")
    body = Body(shape, 0.01, Pose(np.array([0.0, 0.0, 0.170])), 0.8)
    live = LiveGrasp(fingers, body, LONG, GRAVITY)
    live.want(body.pose, body.mass, held=True)
    assert live.solve(PULLS).converged and live.held
    return live


def test_the_grasp_that_was_copied_stays_and_goes_on(live):
    before = live.body.pose.position.copy()
    solver = live.copy(1.0)
    steps = move_steps(solver, TURN)
    first = next(steps)
    assert abs(first.moved[5]) > 0.01
    assert np.array_equal(live.body.pose.position, before)
    tighter = {name: [1.002 * pull for pull in pulls] for name, pulls in PULLS.items()}
    assert live.solve(tighter).converged  # between two steps of the plan
    found = first
    with pytest.raises(StopIteration) as end:
        while True:
            found = steps.send("") or found
    plan = end.value.value
    assert isinstance(plan, MovePlan) and plan.reached and plan.waypoints[-1] is found
    assert plan.moved[5] == pytest.approx(0.2, abs=0.0036)
    # The copy stands where it stood before the plan; the next one begins where the grasp is by now.
    assert np.array_equal(solver.body.pose.position, before)
    again = live.copy(1.0)
    assert again is solver and np.array_equal(again.body.pose.position, live.body.pose.position)
    assert live.solve(PULLS).converged


def test_steps_plan_what_plan_move_plans(live):
    seen = []
    whole = plan_move(live.copy(1.0), TURN, watch=lambda w: seen.append(w) or True)
    assert whole.reached and len(seen) == len(whole.waypoints) - 1
    cut = plan_move(live.copy(1.0), TURN, watch=lambda w: False)
    assert cut.limiting == "stopped by the caller" and len(cut.waypoints) == 2
    np.testing.assert_allclose(cut.moved, seen[0].moved, atol=1e-7)
    steps = move_steps(live.copy(1.0), TURN)
    next(steps)
    with pytest.raises(StopIteration) as end:
        steps.send("enough")
    assert end.value.value.limiting == "enough"


def test_what_stands_is_not_planned_for(live):
    solver = live.copy(1.0)
    solver.support()
    with pytest.raises(InvalidValue, match="grasp"):
        next(move_steps(solver, TURN))
