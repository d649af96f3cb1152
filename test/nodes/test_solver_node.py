# SPDX-License-Identifier: Apache-2.0
"""The solver node through its topics: pulls in, poses, states, tf and diagnostics out."""

import math

import numpy as np
import pytest
from ccr_msgs.msg import CablePulls
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseArray
from probe import objects, sphere

from ccr_ros.model import load_gripper, solve

THUMB = [0.005, 0.004]
FINGERS = ("thumb", "index")


def positions(array: PoseArray) -> np.ndarray:
    return np.array([[p.position.x, p.position.y, p.position.z] for p in array.poses])


def quaternions(array: PoseArray) -> np.ndarray:
    turns = [p.orientation for p in array.poses]
    return np.array([[q.x, q.y, q.z, q.w] for q in turns])


def vector(message) -> list[float]:
    return [message.x, message.y, message.z]


@pytest.fixture
def finger(small_gripper):
    return load_gripper(small_gripper).fingers[0].finger


def test_rest_pose_is_published_before_any_pull(probe, start, small_gripper, finger):
    start(gripper_file=small_gripper)
    state = probe.until(lambda: probe.states("thumb"))[0]
    assert list(state.pulls) == [0.0, 0.0]
    assert all(state.slack)
    assert not state.stale
    assert state.header.stamp.sec > 0
    rest = solve(finger, [0.0, 0.0])
    backbone = probe.until(lambda: probe.backbones("thumb"))[0]
    np.testing.assert_allclose(positions(backbone), rest.backbone, atol=1e-9)


def test_pose_and_state_are_those_of_the_model(probe, start, small_gripper, finger):
    start(gripper_file=small_gripper)
    backbones = probe.backbones("thumb")
    cables = {c: probe.listen(PoseArray, f"thumb/cables/{c}") for c in finger.cable_names}
    state = probe.pull_and_wait("thumb", THUMB)
    truth = solve(finger, THUMB)

    stamp = state.header.stamp
    for topic in (backbones, *cables.values()):
        probe.until(lambda topic=topic: topic and topic[-1].header.stamp == stamp)
        assert topic[-1].header.frame_id == "gripper/thumb_base"
    np.testing.assert_allclose(positions(backbones[-1]), truth.backbone, atol=1e-8)
    np.testing.assert_allclose(quaternions(backbones[-1]), truth.quaternions, atol=1e-6)
    for name, topic in cables.items():
        np.testing.assert_allclose(positions(topic[-1]), truth.cables[name], atol=1e-8)
        np.testing.assert_allclose(quaternions(topic[-1]), truth.quaternions, atol=1e-6)

    assert state.finger == "thumb"
    assert state.header.frame_id == "gripper/thumb_base"
    assert tuple(state.cables) == finger.cable_names
    assert list(state.pulls) == THUMB
    assert list(state.slack) == [False, False]
    np.testing.assert_allclose(state.tensions, truth.tensions, rtol=1e-6)
    assert state.forces_are == "newton"
    assert not state.contacts
    np.testing.assert_allclose(vector(state.tip.position), truth.backbone[-1], atol=1e-8)
    assert state.energy == pytest.approx(truth.energy, rel=1e-6)
    assert state.certificate.converged
    assert state.certificate.stable
    assert not state.certificate.branch_jump
    assert state.certificate.kkt <= 1e-8
    assert state.certificate.iterations > 0
    assert state.certificate.solve_time > 0.0
    assert not state.stale
    assert state.dropped == 0


def test_tf_leads_from_the_gripper_to_every_tip(probe, start, small_gripper):
    start(gripper_file=small_gripper)
    static, dynamic = probe.transforms(static=True), probe.transforms()
    state = probe.pull_and_wait("thumb", THUMB)
    bases = {t.child_frame_id: t for m in probe.until(lambda: static) for t in m.transforms}
    assert set(bases) == {"gripper/thumb_base", "gripper/index_base"}
    assert {t.header.frame_id for t in bases.values()} == {"gripper/gripper_base"}
    thumb = bases["gripper/thumb_base"].transform
    assert vector(thumb.translation) == [0.05, 0.0, 0.01]
    assert (thumb.rotation.z, thumb.rotation.w) == (1.0, 0.0)

    def tip():
        wanted = ("gripper/thumb_tip", state.header.stamp)
        found = [t for m in dynamic for t in m.transforms]
        return [t for t in found if (t.child_frame_id, t.header.stamp) == wanted]

    (transform,) = probe.until(tip, "the tip's transform")
    assert transform.header.frame_id == "gripper/thumb_base"
    assert vector(transform.transform.translation) == vector(state.tip.position)
    assert transform.transform.rotation == state.tip.orientation


def test_cables_may_be_named(probe, start, small_gripper):
    start(gripper_file=small_gripper)
    state = probe.pull_and_wait("thumb", [0.004, 0.005], names=["helical", "straight"])
    assert list(state.pulls) == [0.005, 0.004]
    state = probe.pull_and_wait("thumb", [0.003], names=["helical"])
    assert list(state.pulls) == [0.0, 0.003]


def test_fingers_move_on_their_own(probe, start, small_gripper):
    start(gripper_file=small_gripper)
    probe.until(lambda: probe.states("index"))
    before = len(probe.states("index"))
    probe.pull_and_wait("thumb", THUMB)
    probe.pull_and_wait("thumb", [0.0, 0.002])
    assert len(probe.states("index")) == before


def test_unstamped_pulls_get_the_time_of_arrival(probe, start, small_gripper):
    start(gripper_file=small_gripper)
    probe.publish("thumb/cable_pulls", CablePulls(pulls=THUMB))
    states = probe.states("thumb")
    state = probe.until(lambda: next((s for s in states if list(s.pulls) == THUMB), None))
    assert state.header.stamp.sec > 0


BAD_PULLS = {
    "nan": ([0.001, math.nan], [], "pulls.helical: nan"),
    "infinite": ([math.inf, 0.0], [], "pulls.straight: inf"),
    "beyond the finger": ([0.2, 0.0], [], "0.182"),
    "too few": ([0.001], [], "got 1"),
    "too many": ([0.001, 0.0, 0.0], [], "got 3"),
    "none": ([], [], "got 0"),
    "unknown cable": ([0.001], ["strait"], "unknown cable 'strait'; valid: straight, helical"),
    "twice named": ([0.001, 0.0], ["helical", "helical"], "names: 'helical'"),
    "more names": ([0.001], ["helical", "straight"], "got 1"),
}


@pytest.mark.parametrize("case", BAD_PULLS)
def test_bad_pulls_are_refused_and_the_pose_stays(probe, start, small_gripper, case):
    start(gripper_file=small_gripper)
    probe.diagnostics()
    backbones = probe.backbones("thumb")
    good = probe.pull_and_wait("thumb", THUMB)
    probe.until(lambda: backbones and backbones[-1].header.stamp == good.header.stamp)
    poses = len(backbones)

    pulls, names, text = BAD_PULLS[case]
    probe.pull("thumb", pulls, names)
    states = probe.states("thumb")
    stale = probe.until(lambda: states[-1].stale and states[-1], "the stale state")
    assert stale.header == good.header
    assert stale.pulls == good.pulls
    assert stale.tip == good.tip
    status = probe.until(
        lambda: (s := probe.status(": thumb")) and s.level == DiagnosticStatus.ERROR and s
    )
    assert text in status.message
    assert {v.key: v.value for v in status.values}["pulls refused"] == "1"
    assert len(backbones) == poses

    assert not probe.pull_and_wait("thumb", [0.001, 0.0]).stale
    probe.until(lambda: probe.status(": thumb").level == DiagnosticStatus.OK)


def test_a_pose_that_does_not_converge_is_not_published(probe, start, small_gripper):
    start(gripper_file=small_gripper)
    probe.diagnostics()
    backbones = probe.backbones("thumb")
    good = probe.pull_and_wait("thumb", THUMB)
    probe.until(lambda: backbones and backbones[-1].header.stamp == good.header.stamp)
    poses = len(backbones)
    stamp = probe.pull("thumb", [0.15, 0.15])
    states = probe.states("thumb")
    stale = probe.until(lambda: states[-1].stale and states[-1], "the stale state")
    assert stale.header == good.header
    assert stale.tip == good.tip
    assert stale.certificate.converged
    assert stamp not in [s.header.stamp for s in states]
    assert len(backbones) == poses
    status = probe.until(
        lambda: (s := probe.status(": thumb")) and s.level == DiagnosticStatus.ERROR and s
    )
    assert "not converged" in status.message
    assert not probe.pull_and_wait("thumb", THUMB).stale


def test_of_a_burst_the_newest_is_solved_and_the_rest_counted(probe, start, small_gripper):
    start(gripper_file=small_gripper)
    probe.diagnostics()
    probe.pull_and_wait("thumb", [0.0, 0.0])
    probe.pull_and_wait("index", [0.0])
    states = probe.states("thumb")
    before = len(states)
    for i in range(200):
        last = probe.pull("thumb", [0.005 * (i + 1) / 200, 0.0])
        if i == 100:
            other = probe.pull("index", [0.003])
    state = probe.solved("thumb", last)
    assert list(state.pulls) == [0.005, 0.0]
    solved = len(states) - before
    assert solved + state.dropped == 200
    assert solved <= 100  # fewer on a quick runtime: what waits is let in for a few ms
    assert probe.solved("index", other).dropped == 0  # one finger's flood is not another's

    def told():
        for status in probe.statuses(": thumb"):
            values = {v.key: v.value for v in status.values}
            if values["pulls dropped"] == str(state.dropped):
                return status  # the first: the next ones tell of nothing new
        return None

    status = probe.until(told, "the count in the diagnostics")
    assert status.level == DiagnosticStatus.WARN
    assert "dropped" in status.message
    probe.until(lambda: probe.status(": thumb").level == DiagnosticStatus.OK)


def test_the_same_pulls_again_cost_no_solve(probe, start, small_gripper):
    node = start(gripper_file=small_gripper)
    (thumb,) = (channel for channel in node._fingers if channel.finger.name == "thumb")
    backbones, tf = probe.backbones("thumb"), probe.transforms()
    first = probe.pull_and_wait("thumb", THUMB)
    solves = thumb.solves
    for _ in range(20):
        stamp = probe.pull("thumb", THUMB)
    again = probe.solved("thumb", stamp)
    assert (again.tip, again.dropped, thumb.solves) == (first.tip, 0, solves)
    # The pose is as new as the pulls that it is of.
    probe.until(lambda: backbones[-1].header.stamp == stamp)
    probe.until(lambda: any(t.header.stamp == stamp for m in tf for t in m.transforms))
    # What was refused in between, or is new in the scene, is not covered by it.
    probe.pull("thumb", [1.0, 0.0])
    probe.until(lambda: probe.states("thumb")[-1].stale)
    assert not probe.pull_and_wait("thumb", THUMB).stale
    probe.publish("objects", objects(sphere("far", 0.01, (0.5, 0.5, 0.5))))
    probe.until(lambda: thumb.solves > solves + 1)


def test_diagnostics_tell_what_was_measured(probe, start, small_gripper):
    start(gripper_file=small_gripper)
    probe.diagnostics()
    probe.until(lambda: probe.states("thumb"))
    probe.pull_and_wait("thumb", THUMB)
    status = probe.until(
        lambda: (s := probe.status(": thumb")) and s.message == "solved" and s, "the status"
    )
    assert status.name == "/gripper/solver_node: thumb"
    assert status.hardware_id == "small"
    values = {v.key: v.value for v in status.values}
    assert values["pulls received"] == "1"
    assert values["solves"] == "2"
    assert 0.0 < float(values["solve time p50 [ms]"]) <= float(values["solve time p99 [ms]"])
    assert "no pulls received yet" in probe.status(": index").message


def test_two_grippers_side_by_side(probe, start, small_gripper):
    start(namespace="left/gripper", gripper_file=small_gripper)
    start(namespace="right/gripper", gripper_file=small_gripper)
    static, dynamic = probe.transforms(static=True), probe.transforms()
    left = probe.pull_and_wait("/left/gripper/thumb", THUMB)
    right = probe.pull_and_wait("/right/gripper/thumb", [0.0, 0.0])
    assert list(left.pulls) == THUMB
    assert list(right.pulls) == [0.0, 0.0]
    assert left.header.frame_id == "left/gripper/thumb_base"
    assert right.header.frame_id == "right/gripper/thumb_base"

    def children(messages):
        return {t.child_frame_id for m in messages for t in m.transforms}

    grippers = ("left/gripper", "right/gripper")
    probe.until(lambda: children(static) == {f"{g}/{f}_base" for g in grippers for f in FINGERS})
    probe.until(lambda: children(dynamic) >= {f"{g}/thumb_tip" for g in grippers})
