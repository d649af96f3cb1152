# SPDX-License-Identifier: Apache-2.0
"""The solver node's service ~/plan_move: plans of motions of what the fingers carry."""

import math

import numpy as np
import pytest
from ccr_msgs.msg import PullLimits
from ccr_msgs.srv import PlanMove
from cube_stack import CABLES, SHUT, angle_between, array, vector

TURN = math.radians(12)


@pytest.mark.long
def test_a_plan_is_made_while_nothing_moves(cube):
    stack = cube().carry()
    start = stack.thing.pose
    told = len(stack.grasps)
    plan = stack.plan(turn=(0.0, 0.0, TURN), margin=0.1)
    assert (plan.message, plan.reached, plan.share, plan.limiting) == ("", True, 1.0, "")
    first, last = plan.waypoints[0], plan.waypoints[-1]
    assert len(plan.waypoints) > 2
    assert array(first.turn) == pytest.approx([0, 0, 0], abs=1e-9)
    assert angle_between(first.pose, start) < 1e-6
    assert last.turn.z == pytest.approx(TURN, abs=0.0036)
    assert angle_between(start, last.pose) == pytest.approx(np.linalg.norm(array(last.turn)))
    for waypoint in plan.waypoints:
        assert waypoint.margin > 0.08 and waypoint.least_force > 0.005
        named = {n: tuple(p.names) for n, p in zip(waypoint.fingers, waypoint.pulls, strict=True)}
        assert named == CABLES
    assert [list(pulls.pulls) for pulls in first.pulls] == list(SHUT.values())
    # The pulls that come meanwhile are answered, and the object stays where it is.
    assert len(stack.grasps) > told and angle_between(stack.thing.pose, start) < 1e-6
    # Those pulls, sent one after the other, do bring it there.
    for waypoint in plan.waypoints:
        for name, pulls in zip(waypoint.fingers, waypoint.pulls, strict=True):
            stack.bridge.wanted[name] = np.array(pulls.pulls)
        there = waypoint.pose
        stack.probe.until(lambda p=there: angle_between(stack.thing.pose, p) < 0.005, "it there")


def limit(finger="finger_1", **values):
    count = len(CABLES.get(finger, "x"))
    return PullLimits(
        finger=finger, **{"least": [0.0] * count, "largest": [0.006] * count, **values}
    )


REFUSED = {
    "target": {"shift": (0, 0, 0)},
    "shift[2]: nan": {"shift": (0, 0, math.nan)},
    "shift[0]: 2.0": {"shift": (2, 0, 0)},
    "turn": {"turn": (3, 3, 0)},
    "margin: 1.0": {"margin": 1.0},
    "margin: -0.1": {"margin": -0.1},
    "shift_tolerance: -1.0": {"shift_tolerance": -1.0},
    "turn_tolerance: nan": {"turn_tolerance": math.nan},
    "unknown finger 'thumb'": {"limits": [limit("thumb")]},
    "limits.finger_1: 'finger_1'": {"limits": [limit(), limit()]},
    "limits.finger_1.least": {"limits": [limit(least=[0.0])]},
    "limits.finger_1.largest": {"limits": [limit(largest=[])]},
    "pulls.left": {"limits": [limit(largest=[math.inf, 0.0])]},
    "limits.pulls.finger_1": {"limits": [limit(least=[0.0055] * 2, largest=[0.005] * 2)]},
    "one value for each": {"limits": [limit(names=["left", "left"])]},
}


@pytest.mark.long
def test_what_is_refused(cube):
    stack = cube()
    plan = stack.plan(shift=(0, 0, 0.001))
    assert plan.message.startswith("refused: object") and not plan.waypoints
    stack.place()
    stack.probe.until(lambda: stack.grasps and stack.thing.contacts, "a touch")
    assert "asked while the fingers carry it" in stack.plan(shift=(0, 0, 0.001)).message
    stack.carry()
    for reason, values in REFUSED.items():
        plan = stack.plan(**{"shift": (0, 0, 0.001), **values})
        assert plan.message.startswith("refused: ") and reason in plan.message, plan.message
        assert not plan.reached and not plan.waypoints
    # One at a time.
    request = PlanMove.Request(turn=vector((0, 0, 0.1)))
    both = [stack.plans.call_async(request) for _ in range(2)]
    stack.probe.until(lambda: all(future.done() for future in both), "both answers")
    messages = sorted(future.result().message for future in both)
    assert messages == ["", "refused: another plan is being made"]


@pytest.mark.long
def test_what_cannot_be_reached_is_told(cube):
    stack = cube().carry()
    ends = {n: (np.array(pulls) - 1e-4, np.array(pulls) + 1e-4) for n, pulls in SHUT.items()}
    tight = [limit(n, least=low.tolist(), largest=high.tolist()) for n, (low, high) in ends.items()]
    plan = stack.plan(turn=(0, 0, 0.5), limits=tight)
    assert not plan.reached and 0.0 < plan.share < 0.9 and plan.message == ""
    assert "pull of finger_" in plan.limiting and " limit" in plan.limiting
    for waypoint in plan.waypoints:
        for name, pulls in zip(waypoint.fingers, waypoint.pulls, strict=True):
            low, high = ends[name]
            assert np.all(pulls.pulls >= low - 1e-9) and np.all(pulls.pulls <= high + 1e-9)


@pytest.mark.long
def test_a_plan_that_takes_too_long_is_answered_as_far_as_it_is(cube):
    plan = cube(solver={"move_time_limit": 0.1}).carry().plan(turn=(0, 0, 3.0))
    assert not plan.reached and plan.limiting == "the time limit of planning: 0.1 s"
    assert plan.waypoints and plan.message == ""


def test_mode_fingers_knows_of_no_object(probe, start):
    start()
    client = probe.node.create_client(PlanMove, "solver_node/plan_move")
    probe.until(client.service_is_ready, "the service")
    future = client.call_async(PlanMove.Request(turn=vector((0, 0, 0.1))))
    answer = probe.until(lambda: future.done() and future.result(), "an answer")
    assert answer.message.startswith("refused: mode: 'fingers'")
