# SPDX-License-Identifier: Apache-2.0
"""The solver node's mode gripper through its topics: fingers and object in one equilibrium."""

import math

import numpy as np
import pytest
from ccr_msgs.msg import GraspContact, GraspState
from ccr_msgs.srv import SolvePulls
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from probe import objects, shown, sphere
from rclpy.exceptions import ParameterException

from ccr_ros.model import CcrError

FINGERS = ("finger_1", "finger_2", "finger_3")
LENGTH = 0.182  # m
SHUT, TIGHT = 0.032 * LENGTH, 0.034 * LENGTH  # pulls
NEAR = 0.1073  # m; a little above where the closed fingers carry the ball
G = 9.80665
BASE = "gripper/gripper_base"


def ball(mass=0.02, held=False, height=0.110, **values):
    item = sphere(values.pop("name", "ball"), values.pop("radius", 0.056), (0.0, 0.0, height))
    item.mass, item.held = mass, held
    for name, value in values.items():
        setattr(item, name, value)
    return item


class Hand:
    """The gripper in mode gripper: says what is between the fingers, pulls, waits for the state."""

    def __init__(self, probe, start, **values):
        self.probe = probe
        start(**{"mode": "gripper", "time_limit": 20.0, "grasp_state_rate": 100.0, **values})
        self.states = probe.listen(GraspState, "grasp_state")
        states = [self.states, *(probe.states(finger) for finger in FINGERS)]
        probe.diagnostics()
        probe.until(lambda: all(states), "the first states")

    def until(self, condition, what):
        """Wait for a grasp state newer than now that is as wanted, and return it."""
        seen = len(self.states)
        find = lambda: next((s for s in self.states[seen:] if condition(s)), None)  # noqa: E731
        return self.probe.until(find, what)

    def say(self, *items, condition=lambda state: True):
        """Publish objects; return the first state that answers them and is as wanted."""
        stamp = self.probe.next_stamp()
        self.probe.publish("objects", objects(*items, stamp=stamp))
        return self.until(lambda s: s.header.stamp == stamp and condition(s), "an answer to them")

    def pull(self, value):
        """Pull all fingers alike; return the state that answers all of them."""
        for finger in FINGERS:
            self.probe.pull(finger, [value])
        return self.probe.until(lambda: self._answer(value), "an answer to the pulls")

    def _answer(self, value):
        newest = self.states[-1]
        fingers = [self.probe.states(finger)[-1] for finger in FINGERS]
        done = all(f.header.stamp == newest.header.stamp for f in fingers)
        return newest if done and all(f.pulls[0] == value for f in fingers) else None

    def finger(self, name, stamp):
        """Wait for the state of a finger that is as new as this."""
        return self.probe.solved(name, stamp)

    def refused(self, *items):
        """Publish objects that are refused; return why."""
        self.probe.publish("objects", objects(*items))
        return self.status(": objects", DiagnosticStatus.ERROR).message

    def status(self, name, level):
        return self.probe.until(
            lambda: (s := self.probe.status(name)) and s.level == level and s, f"{name} {level}"
        )

    def held(self, **values):
        """Put the ball between the fingers, close, and let go of it."""
        self.say(ball(**values))
        self.pull(SHUT)
        state = self.say(ball(**{**values, "held": True}))
        assert state.held, state.message
        return state


@pytest.fixture
def hand(probe, start):
    return Hand(probe, start)


def vector(message):
    return np.array([message.x, message.y, message.z])


def size(wrench):
    return max(np.abs(vector(wrench.force)).max(), np.abs(vector(wrench.torque)).max())


def test_without_an_object_the_fingers_move_by_themselves(hand):
    (state,) = hand.states
    assert (state.object, state.held, state.stale, state.message) == ("", False, False, "")
    assert state.header.frame_id == BASE
    assert math.isnan(state.quality.margin) and math.isnan(state.quality.payload)
    free = hand.probe.pull_and_wait("finger_2", [SHUT])
    assert not free.contacts and not free.stale
    assert hand.probe.states("finger_1")[-1].pulls[0] == 0.0
    hand.probe.until(lambda: (s := hand.probe.status(": grasp")) and s.message == "no object")
    # One without a mass that nobody holds is an obstacle.
    hand.probe.publish("objects", objects(ball(mass=0.0)))
    hand.probe.until(lambda: hand.probe.states("finger_2")[-1].contacts, "a contact")
    assert hand.states[-1].object == ""


def test_standing_and_held(hand):
    """The whole story: it stands, is let go of, drawn in, gets heavier, and stands again."""
    poses = hand.probe.listen(PoseStamped, "object_pose")
    standing = hand.say(ball())
    assert (standing.object, standing.held, standing.stale) == ("ball", False, False)
    assert standing.net.force.z == pytest.approx(-0.02 * G) and not standing.contacts

    pressed = hand.pull(SHUT)
    assert pressed.pose.position.z == 0.110 and not pressed.held
    assert {c.finger for c in pressed.contacts} == set(FINGERS)
    assert pressed.net.force.z < -0.5  # the fingertips press it down

    held = hand.say(ball(held=True))
    assert held.held and held.stable and not held.message
    assert held.softest and held.smallest_eigenvalue > 0.1
    assert held.pose.position.z < 0.109
    assert size(held.net) < 1e-6
    assert held.forces_are == "newton" and held.mass == 0.02
    # Every finger's topics show the same equilibrium.
    for finger in FINGERS:
        state = hand.finger(finger, held.header.stamp)
        assert state.certificate.stable and not state.stale
        here = [c for c in held.contacts if c.finger == finger]
        forces = [c.force for c in state.contacts if c.obstacle == "ball"]
        assert forces == pytest.approx([c.normal_force for c in here])
    # What the fingers do to it carries its weight.
    assert all(c.status == GraspContact.FRICTIONLESS for c in held.contacts)
    total = sum(vector(c.wrench.force) for c in held.contacts)
    assert total == pytest.approx([0.0, 0.0, 0.02 * G], abs=1e-7)

    tight = hand.pull(TIGHT)
    assert tight.held and size(tight.net) < 1e-6
    assert tight.pose.position.z < held.pose.position.z - 5e-4  # drawn in
    heavy = hand.say(ball(mass=0.04, held=True))
    assert heavy.held and heavy.mass == 0.04
    assert heavy.pose.position.z < tight.pose.position.z - 1e-5
    light = hand.say(ball(mass=0.01, held=True))
    assert light.pose.position.z > tight.pose.position.z + 1e-5

    hand.probe.until(lambda: poses and poses[-1].header.stamp == light.header.stamp, "its pose")
    assert poses[-1].header.frame_id == BASE and poses[-1].pose == light.pose

    released = hand.say(ball(mass=0.01))
    assert not released.held and released.pose.position.z == light.pose.position.z
    lifted = hand.say(ball(mass=0.01, height=0.111))
    assert lifted.pose.position.z == 0.111
    hand.probe.until(lambda: hand.probe.status(": grasp").message == "stands", "the status")


def test_tf_and_markers_show_it_where_it_is(hand):
    tf, markers = hand.probe.transforms(), hand.probe.markers()
    held = hand.held(height=NEAR, friction=0.4)

    def transform():
        found = [t for m in tf for t in m.transforms if t.child_frame_id == "gripper/ball"]
        return next((t for t in found if t.header.stamp == held.header.stamp), None)

    found = hand.probe.until(transform, "its transform")
    assert found.header.frame_id == BASE
    assert found.transform.translation.z == held.pose.position.z

    def drawn():
        there = markers and shown(markers[-1], "objects")
        return there and abs(there[0].pose.position.z - held.pose.position.z) < 1e-9 and there[0]

    assert hand.probe.until(drawn, "the ball, moved").header.frame_id == BASE
    rubbing = [c for c in held.contacts if np.any(vector(c.friction_force))]
    arrows = shown(markers[-1], "friction")
    assert len(arrows) == len(rubbing) > 0
    for arrow, contact in zip(arrows, rubbing, strict=True):
        start, end = (vector(p) for p in arrow.points)
        assert start == pytest.approx(vector(contact.position))
        along = (end - start) / np.linalg.norm(end - start)
        force = vector(contact.friction_force)
        assert along == pytest.approx(force / np.linalg.norm(force), abs=1e-6)
    assert not shown(markers[-1], "finger_1/obstacles")


def test_friction_is_told_per_contact(hand):
    state = hand.held(height=NEAR, friction=0.4)
    assert state.friction == 0.4 and size(state.net) < 1e-6
    centre = vector(state.pose.position)
    for contact in state.contacts:
        normal, force = vector(contact.normal), vector(contact.friction_force)
        assert contact.status in (GraspContact.STICK, GraspContact.SLIP)
        assert force @ normal == pytest.approx(0.0, abs=1e-9)
        share = np.linalg.norm(force) / (0.4 * contact.normal_force)
        assert contact.margin == pytest.approx(1.0 - share, abs=1e-5)
        push = -(contact.normal_force * normal + force)
        assert vector(contact.wrench.force) == pytest.approx(push)
        turn = np.cross(vector(contact.position) - centre, push)
        assert vector(contact.wrench.torque) == pytest.approx(turn, abs=1e-12)


def test_quality_is_measured(hand):
    seen = len(hand.states)
    held = hand.held(height=NEAR, friction=0.4)
    assert held.quality.margin == min(c.margin for c in held.contacts)

    def measured():
        found = hand.states[-1]
        return found if found.quality.payload > 0.0 and found.held else None

    quality = hand.probe.until(measured, "a quality").quality
    assert quality.force_closure and 0.0 < quality.epsilon < 1.0 and quality.weakest
    assert quality.payload > 0.02 * G
    assert math.isnan(hand.states[seen - 1].quality.epsilon)  # there was no object


def test_what_the_fingers_do_not_touch_stands_until_it_is_asked_for_again(hand):
    hand.say(ball())
    state = hand.say(ball(held=True))
    assert not state.held and not state.stale
    assert "no finger touches it" in state.message
    assert "no finger" in hand.status(": grasp", DiagnosticStatus.WARN).message
    assert not hand.pull(SHUT).held
    assert hand.say(ball(held=True)).held
    assert hand.status(": grasp", DiagnosticStatus.OK).message == "held"


@pytest.mark.long
def test_dropped_and_put_back(probe, start):
    hand = Hand(probe, start, gravity=[0.0, 0.0, G], time_limit=1.0)  # points down
    held = hand.held()
    poses = probe.backbones("finger_1")
    last = probe.until(lambda: poses and poses[-1].header.stamp == held.header.stamp and poses[-1])
    probe.publish("objects", objects(ball(mass=0.2, held=True)))
    dropped = hand.until(lambda s: s.stale, "the drop")
    assert not dropped.held and dropped.message.startswith("dropped: ")
    assert (dropped.pose, dropped.header) == (held.pose, held.header)
    assert "dropped" in hand.status(": grasp", DiagnosticStatus.ERROR).message
    finger = probe.until(lambda: (s := probe.states("finger_1")[-1]).stale and s, "a stale state")
    assert finger.header.stamp == held.header.stamp
    assert poses[-1] is last
    back = hand.say(ball())
    assert not back.held and not back.stale and back.pose.position.z == 0.110
    assert not hand.finger("finger_1", back.header.stamp).stale
    assert hand.say(ball(held=True)).held


def test_bad_pulls_leave_it_as_it_is(hand):
    held = hand.held()
    hand.probe.pull("finger_2", [math.nan])
    stale = hand.until(lambda s: s.stale, "a stale state")
    assert stale.held and (stale.pose, stale.header) == (held.pose, held.header)
    assert "finger_2: pulls refused" in stale.message
    hand.probe.pull("finger_2", [1.0])  # more than there is of the cable
    good = hand.pull(TIGHT)
    assert good.held and not good.stale and not good.message


def test_the_same_again_costs_no_solve(hand):
    hand.held()

    def solves():
        return {v.key: v.value for v in hand.probe.status(": grasp").values}["solves"]

    def told():
        before = len(hand.probe.diagnostics())
        hand.probe.until(lambda: len(hand.probe.diagnostics()) > before, "the diagnostics")
        return solves()

    held = hand.states[-1]
    count = told()
    hand.probe.publish("objects", objects(ball(held=True)))
    stamps = [hand.probe.pull(finger, [SHUT]) for finger in FINGERS]
    again = hand.until(lambda s: s.header.stamp in stamps, "a state of the same pulls")
    assert again.held and not again.stale and again.pose == held.pose
    assert told() == count


def test_other_objects_stay_obstacles(hand):
    held = hand.held()
    # A bead above the ball, 1 mm from the last disk of finger_1, which meets it when it closes.
    bead = sphere("bead", 0.004, (0.0272, 0.0, 0.172))
    state = hand.say(ball(held=True), bead)
    assert state.held and state.pose.position.z == pytest.approx(held.pose.position.z, abs=1e-4)
    closed = hand.finger("finger_1", hand.probe.pull("finger_1", [TIGHT]))
    assert {c.obstacle for c in closed.contacts} >= {"bead"}
    # Gone again.
    gone = hand.say(ball(held=True))
    assert gone.held
    state = hand.finger("finger_1", gone.header.stamp)
    assert "bead" not in {c.obstacle for c in state.contacts}


def test_the_object_goes(hand):
    hand.held()
    hand.probe.publish("objects", objects())
    gone = hand.until(lambda s: s.object == "", "the state of no object")
    assert not gone.held and not gone.contacts
    for finger in FINGERS:
        hand.probe.until(lambda f=finger: not hand.probe.states(f)[-1].contacts, "a free finger")
    assert hand.held().held


BAD = {
    "two": ([ball(), ball(name="other", held=True, height=0.4)], "the parameter 'object' says"),
    "frame": ([ball(name="finger_1_tip")], "not 'gripper/finger_1_tip'"),
    "mass": ([ball(mass=-1.0)], "objects[0].mass"),
    "nan": ([ball(mass=math.nan)], "objects[0].mass"),
    "much": ([ball(mass=1e6)], "objects.ball.mass"),
    "friction": ([ball(friction=1e6)], "objects.ball.friction"),
    "base": ([ball(height=0.02)], "clear of the base disk"),
}


def test_bad_objects_are_refused_and_the_held_one_stays(hand):
    before = hand.held()
    for case, (items, text) in BAD.items():
        # With one that is held the pose that is said does not count.
        if case == "base":
            continue
        assert text in hand.refused(*items), case
        hand.probe.publish("objects", objects(ball(held=True)))
        hand.status(": objects", DiagnosticStatus.OK)
    after = hand.pull(TIGHT)
    assert after.held and after.pose.position.z < before.pose.position.z
    items, text = BAD["base"]
    assert text in hand.refused(*items)
    assert hand.pull(SHUT).held


def test_the_parameter_object_says_which_is_meant(probe, start):
    hand = Hand(probe, start, object="ball")
    hand.probe.publish("objects", objects(ball(name="other", height=0.4)))
    state = hand.say(ball(mass=0.0), ball(name="other", height=0.4))
    assert (state.object, state.mass) == ("ball", 0.0)
    assert not hand.pull(SHUT).stale


def test_pulls_are_planned_only_while_it_stands(hand):
    client = hand.probe.node.create_client(SolvePulls, "solver_node/solve_pulls")
    hand.probe.until(client.service_is_ready, "the service")

    def ask():
        tip = hand.probe.states("finger_1")[-1].tip
        future = client.call_async(
            SolvePulls.Request(finger="finger_1", target=SolvePulls.Request.TIP_POSITION, tip=tip)
        )
        hand.probe.until(future.done, "the answer")
        return future.result()

    hand.say(ball())
    pressed = hand.pull(SHUT)
    answer = ask()
    assert answer.success, answer.message
    assert list(answer.pulls) == pytest.approx([SHUT], rel=1e-3)
    assert [c.obstacle for c in answer.contacts].count("ball") == len(
        [c for c in pressed.contacts if c.finger == "finger_1"]
    )
    assert hand.say(ball(held=True)).held
    answer = ask()
    assert not answer.success and answer.message.startswith("refused: solve_pulls")
    # It has left nothing behind.
    hand.probe.publish("objects", objects())
    hand.until(lambda s: s.object == "", "the state of no object")
    hand.probe.until(lambda: not hand.probe.states("finger_1")[-1].contacts, "a free finger")


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("mode", "hand", "unknown mode 'hand'; valid: fingers, gripper"),
        ("gravity", [0.0, 0.0], "gravity"),
        ("gravity", [0.0, 0.0, math.nan], "gravity"),
        ("gravity", [0.0, 0.0, 1e6], "gravity"),
    ],
)
def test_bad_parameters(start, name, value, text):
    with pytest.raises(CcrError, match=text):
        start(**{name: value})


@pytest.mark.parametrize(
    ("name", "value"), [("grasp_state_rate", 0.0), ("gravity", "down"), ("object", 3)]
)
def test_parameters_of_a_wrong_type_or_range(start, name, value):
    with pytest.raises(ParameterException, match=name):
        start(**{name: value})
