# SPDX-License-Identifier: Apache-2.0
"""Mode gripper after a held object has fallen, or got a weight that it cannot have."""

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from probe import objects, sphere
from test_solver_gripper import FINGERS, SHUT, TIGHT, Hand, ball

from ccr_ros.resources import config_dir


@pytest.fixture
def hand(probe, start):
    return Hand(probe, start, gravity=[0.0, 0.0, 9.80665])  # points down


def opened(hand, pull=0.0):
    """Open all fingers; return the state that says that the object fell."""
    before = len(hand.states)
    stamps = {finger: hand.probe.pull(finger, [pull]) for finger in FINGERS}
    fallen = hand.probe.until(
        lambda: next((s for s in hand.states[before:] if "dropped" in s.message), None), "the fall"
    )
    for finger, stamp in stamps.items():
        state = hand.finger(finger, stamp)
        assert not state.stale and not state.contacts and state.pulls[0] == pull
    return fallen


def test_fingers_go_on_by_themselves(hand, probe):
    held = hand.held()
    fallen = opened(hand)
    assert fallen.message == "dropped: no finger touches it any more"
    assert not fallen.held and fallen.stale and not fallen.contacts
    assert (fallen.object, fallen.pose) == ("ball", held.pose)
    assert "dropped" in hand.status(": grasp", DiagnosticStatus.WARN).message
    # They close where it was, each by itself, and of the object the same is said.
    told = len(hand.states)
    state = probe.pull_and_wait("finger_1", [TIGHT])
    assert not state.contacts and not state.stale
    assert probe.states("finger_2")[-1].pulls[0] == 0.0
    probe.publish("objects", objects(ball(held=True)))  # as somebody says who has not seen it
    assert not probe.pull_and_wait("finger_1", [SHUT]).contacts
    hand.probe.until(lambda: len(hand.states) > told, "the state again, with the pulls")
    assert all(s.message == fallen.message for s in hand.states[told:])
    # Put back it stands, and can be held again.
    probe.pull_and_wait("finger_1", [0.0])
    back = hand.say(ball())
    assert not back.stale and not back.message and back.pose.position.z == 0.110
    hand.pull(SHUT)
    assert hand.say(ball(held=True)).held


def test_what_came_meanwhile_is_in_the_way_once_it_stands_again(hand, probe):
    hand.held()
    opened(hand)
    bead = sphere("bead", 0.004, (0.0272, 0.0, 0.172))
    probe.publish("objects", objects(ball(held=True), bead))

    def met():
        return {c.obstacle for c in probe.pull_and_wait("finger_1", [TIGHT]).contacts} == {"bead"}

    probe.until(met, "a finger at the bead")
    hand.say(ball(height=0.106), bead)
    closed = hand.finger("finger_1", hand.pull(TIGHT).header.stamp)
    assert {c.obstacle for c in closed.contacts} == {"ball", "bead"}


def test_a_weight_that_comes_later_is_refused_where_forces_are_per_ei(probe, start, tmp_path):
    for name in ("gripper_sphere.yaml", "sphere_finger.yaml"):
        lines = (config_dir() / name).read_text(encoding="utf-8").splitlines(keepends=True)
        text = "".join(line for line in lines if "youngs_modulus" not in line)
        (tmp_path / name).write_text(text, encoding="utf-8")
    path = str(tmp_path / "gripper_sphere.yaml")
    hand = Hand(probe, start, gripper_file=path, object="ball")
    hand.say(ball(mass=0.0))
    hand.pull(SHUT)
    assert hand.say(ball(mass=0.0, held=True)).held
    assert "objects.ball.mass" in hand.refused(ball(mass=0.02, held=True))
    assert hand.pull(TIGHT).held  # and all goes on
