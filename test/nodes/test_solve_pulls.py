# SPDX-License-Identifier: Apache-2.0
"""The service ~/solve_pulls through a client: answers, refusals, and a live solver left alone."""

import math

import numpy as np
import pytest
from ccr_msgs.srv import SolvePulls
from geometry_msgs.msg import Point
from probe import objects, sphere

from ccr_ros.model import Pose, load_gripper, solve
from ccr_ros.nodes import pull_service
from ccr_ros.nodes.conversions import pose_message

Request = SolvePulls.Request
PULLS = [0.004, 0.005]


@pytest.fixture
def fingers(small_gripper):
    return {mounted.finger.name: mounted for mounted in load_gripper(small_gripper).fingers}


@pytest.fixture
def thumb(fingers):
    return fingers["thumb"].finger


@pytest.fixture
def node(start, small_gripper):
    return start(gripper_file=small_gripper)


@pytest.fixture
def ask(node, probe):
    """Return a function that sends a request at once and returns the future of its answer."""
    client = probe.node.create_client(SolvePulls, "solver_node/solve_pulls")
    probe.until(client.service_is_ready, "the service")

    def ask(**values):
        return client.call_async(Request(**{"finger": "thumb", **values}))

    return ask


@pytest.fixture
def answer(ask, probe):
    """Return a function that sends a request and waits for its answer."""

    def answer(**values):
        future = ask(**values)
        probe.until(future.done, "the answer")
        return future.result()

    return answer


def tip_of(solution):
    return pose_message(solution.tip.position, solution.tip.orientation)


def point(values):
    x, y, z = map(float, values)
    return Point(x=x, y=y, z=z)


def test_tip_position(answer, thumb):
    wanted = solve(thumb, PULLS)
    found = answer(target=Request.TIP_POSITION, tip=tip_of(wanted))
    assert found.success and found.nearest and found.message == ""
    assert found.position_error < 2e-7 and math.isnan(found.force_error)
    assert list(found.cables) == list(thumb.cable_names)
    reached = solve(thumb, list(found.pulls))
    assert reached.backbone[-1] == pytest.approx(wanted.backbone[-1], abs=3e-7)
    assert list(found.tensions) == pytest.approx(reached.tensions, rel=1e-4)
    assert found.forces_are == "newton"
    assert found.tip.position.x == pytest.approx(wanted.backbone[-1, 0], abs=3e-7)
    assert found.certificate.converged and found.certificate.stable


def test_tip_pose_and_points_give_the_pulls_back(answer, thumb):
    wanted = solve(thumb, PULLS)
    found = answer(target=Request.TIP_POSE, tip=tip_of(wanted))
    assert found.success and found.rotation_error < 1e-4
    assert list(found.pulls) == pytest.approx(PULLS, abs=1e-6)
    disks = [3, 6, 9]
    points = [point(wanted.backbone[disk]) for disk in disks]
    found = answer(target=Request.POINTS, disks=disks, points=points)
    assert found.success and list(found.pulls) == pytest.approx(PULLS, abs=1e-6)


def test_target_in_the_gripper_frame(answer, fingers):
    mounted = fingers["thumb"]
    wanted = mounted.base @ solve(mounted.finger, PULLS).tip
    tip = pose_message(wanted.position, wanted.orientation)
    found = answer(target=Request.TIP_POSE, tip=tip, frame_id="gripper/gripper_base")
    assert found.success and list(found.pulls) == pytest.approx(PULLS, abs=1e-6)


def test_disk_presses_an_object(answer, probe, fingers):
    mounted = fingers["index"]
    bent = solve(mounted.finger, [0.005])
    inside = mounted.base.points(bent.backbone[9] + bent.frames[9] @ [0.0, 0.03, 0.0])
    state = probe.until(lambda: probe.states("index"))[-1]
    probe.publish("objects", objects(sphere("ball", 0.03, tuple(inside))))
    probe.until(lambda: probe.states("index")[-1].header.stamp != state.header.stamp)
    found = answer(finger="index", target=Request.PRESS, disk=9, obstacle="ball", force=0.05)
    assert found.success, found.message
    pressing = [c for c in found.contacts if c.disk == 9]
    assert sum(c.force for c in pressing) == pytest.approx(0.05, abs=1e-5)
    assert {c.obstacle for c in pressing} == {"ball"}
    assert abs(found.force_error) < 1e-5 and found.gap == 0.0 and math.isnan(found.position_error)


def test_limits_are_kept_and_told(answer, thumb):
    tip = tip_of(solve(thumb, [0.009, 0.0]))
    found = answer(tip=tip, largest_tensions=[1.0, math.inf], least_pulls=[0.0, -math.inf])
    assert not found.success and found.nearest
    assert found.tensions[0] <= 1.0 + 1e-5
    assert "tension of straight" in list(found.limits) and "out of reach" in found.message


def test_nothing_moves(answer, probe, thumb):
    before = probe.pull_and_wait("thumb", [0.002, 0.001])
    count = len(probe.states("thumb"))
    assert answer(tip=tip_of(solve(thumb, PULLS))).success
    assert len(probe.states("thumb")) == count
    after = probe.pull_and_wait("thumb", [0.002 + 2e-7, 0.001])  # the same would cost no solve
    assert after.certificate.iterations <= 1  # the live solver stands where it stood
    assert list(after.tensions) == pytest.approx(list(before.tensions), rel=1e-3)


def test_search_starts_from_the_live_pose(answer, probe, thumb):
    probe.pull_and_wait("thumb", PULLS)
    found = answer(tip=tip_of(solve(thumb, PULLS)))
    assert found.success and found.certificate.iterations == 0
    assert list(found.pulls) == pytest.approx(PULLS, abs=1e-9)


def test_live_pulls_are_solved_while_a_request_is_worked_on(ask, probe, thumb):
    """A request that takes many solves; the pulls sent after it are answered before it is."""
    probe.pull_and_wait("thumb", [0.001, 0.001])
    order = []
    future = ask(tip=tip_of(solve(thumb, [0.012, 0.004])))
    future.add_done_callback(lambda _: order.append("answer"))
    seen = len(probe.states("thumb"))
    for step in range(3):
        stamp = probe.pull("thumb", [0.001 + 1e-4 * step, 0.001])
    probe.solved("thumb", stamp)
    assert len(probe.states("thumb")) > seen
    probe.until(future.done)
    assert future.result().success


def test_requests_queue(ask, probe, thumb):
    wanted = [solve(thumb, pulls) for pulls in ([0.002, 0.001], [0.006, 0.002], [0.001, 0.006])]
    futures = [ask(target=Request.TIP_POSE, tip=tip_of(solution)) for solution in wanted]
    probe.until(lambda: all(f.done() for f in futures))
    for future, solution in zip(futures, wanted, strict=True):
        assert list(future.result().pulls) == pytest.approx(solution.pulls, abs=1e-6)


@pytest.mark.parametrize(
    ("values", "word"),
    [
        ({"finger": "toe"}, "unknown finger 'toe'; valid: thumb, index"),
        ({"finger": ""}, "unknown finger"),
        ({"target": 9}, "target: 9"),
        ({"frame_id": "world"}, "unknown frame 'world'"),
        ({"tip": pose_message(np.array([np.nan, 0, 0]), np.array([0, 0, 0, 1.0]))}, "tip.position"),
        ({"target": 1, "tip": pose_message(np.zeros(3), np.zeros(4))}, "tip.orientation"),
        ({"target": 1, "rotation_weight": -1.0}, "rotation_weight"),
        ({"target": 2}, "points"),
        ({"target": 2, "disks": [1, 2], "points": [Point()]}, "disks"),
        ({"target": 2, "disks": [1, 1], "points": [Point(), Point()]}, "disks"),
        ({"target": 2, "disks": [10], "points": [Point()]}, "disk"),
        ({"target": 2, "disks": [0], "points": [Point()]}, "points"),
        ({"target": 3, "disk": 9, "obstacle": "ball", "force": 1.0}, "unknown obstacle 'ball'"),
        ({"target": 3, "disk": 9, "obstacle": "ball"}, "press.force"),
        ({"largest_tensions": [1.0]}, "limits.tension"),
        ({"largest_tensions": [1.0, -1.0]}, "limits.tension.helical"),
        ({"least_pulls": [0.1, 0.0]}, "limits.low.straight"),
        ({"largest_pulls": [math.nan, 0.0]}, "limits.high.straight"),
    ],
)
def test_refusals(answer, values, word):
    found = answer(**values)
    assert not found.success and not found.nearest
    assert found.message.startswith("refused: ") and word in found.message
    assert not len(found.pulls) and math.isnan(found.position_error)


def test_proportional_cable_model_is_refused(start, probe, small_gripper):
    start(gripper_file=small_gripper, cable_model="proportional")
    client = probe.node.create_client(SolvePulls, "solver_node/solve_pulls")
    probe.until(client.service_is_ready)
    future = client.call_async(Request(finger="thumb"))
    probe.until(future.done)
    assert "cable_model" in future.result().message


def test_a_fault_of_ours_is_an_answer_and_the_node_goes_on(answer, probe, thumb, monkeypatch):
    def broken(*_):
        raise ZeroDivisionError("none of the user's doing")

    with monkeypatch.context() as patch:
        patch.setattr(pull_service, "_target", broken)
        assert "ZeroDivisionError" in answer().message
    assert answer(tip=tip_of(solve(thumb, PULLS))).success
    assert probe.pull_and_wait("thumb", PULLS).certificate.converged


def test_finger_that_stands_in_an_object_is_refused(answer, probe, fingers):
    """No pose among the objects: nothing to start from, said in the message."""
    mounted = fingers["index"]
    walls = [
        sphere(f"wall_{i}", 0.04, tuple(mounted.base.points(np.array([x, y, 0.091]))))
        for i, (x, y) in enumerate([(0.03, 0.0), (-0.03, 0.0), (0.0, 0.03), (0.0, -0.03)])
    ]
    probe.until(lambda: probe.states("index"), "the pose at rest")
    probe.publish("objects", objects(*walls))
    probe.until(lambda: any(s.stale for s in probe.states("index")), "a stale state")
    found = answer(finger="index", tip=pose_message(np.zeros(3), Pose().orientation))
    assert not found.success and "free of its obstacles" in found.message
