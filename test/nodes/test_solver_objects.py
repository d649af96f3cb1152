# SPDX-License-Identifier: Apache-2.0
"""Objects of the solver node: contacts that come and go, and what is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from probe import objects, shown, sphere
from shape_msgs.msg import SolidPrimitive
from visualization_msgs.msg import Marker

from ccr_ros.model import Sphere, load_gripper, solve
from ccr_ros.resources import find_config

PULL = 0.006  # m; enough to press on the ball
BALL = sphere("ball", 0.056, (0.0, 0.0, 0.11))


@pytest.fixture
def gripping(probe, start):
    """The sphere gripper with all fingers pulled, nothing between them."""
    start()
    probe.diagnostics()
    probe.markers()
    states = [probe.pull_and_wait(f"finger_{i}", [PULL]) for i in (1, 2, 3)]
    assert not any(state.contacts for state in states)
    return probe


def newest(probe, finger):
    return probe.states(finger)[-1]


def objects_status(probe, level):
    return probe.until(
        lambda: (s := probe.status(": objects")) and s.level == level and s, "the objects' status"
    )


def test_object_appears_and_goes(gripping):
    probe = gripping
    free = {f"finger_{i}": newest(probe, f"finger_{i}").tip for i in (1, 2, 3)}
    stamp = probe.next_stamp()
    probe.publish("objects", objects(BALL, frame="gripper/gripper_base", stamp=stamp))
    for finger in free:
        state = probe.until(lambda f=finger: (s := newest(probe, f)).contacts and s, "a contact")
        assert not state.stale
        assert state.header.stamp == stamp
        assert list(state.pulls) == [PULL]
        assert all(c.obstacle == "ball" and c.force > 0.0 for c in state.contacts)

    # The same in the model, with the ball put into the finger's frame by hand.
    mounted = load_gripper(find_config("gripper_sphere")).fingers[1]
    center = mounted.base.inverse().points(np.array([0.0, 0.0, 0.11]))
    truth = solve(replace(mounted.finger, obstacles=(Sphere(center, 0.056, name="ball"),)), [PULL])
    state = newest(probe, "finger_2")
    assert [(c.disk, c.point, c.cable) for c in state.contacts] == [
        (c.disk, c.point, c.cable) for c in truth.contacts
    ]
    for found, wanted in zip(state.contacts, truth.contacts, strict=True):
        p, n = found.position, found.normal
        np.testing.assert_allclose([p.x, p.y, p.z], wanted.position, atol=1e-6)
        np.testing.assert_allclose([n.x, n.y, n.z], wanted.normal, atol=1e-4)
        assert found.force == pytest.approx(wanted.force, rel=1e-3)

    def drawn(arrays):
        parts = ("finger_1/contacts", "finger_1/forces", "objects")
        return bool(arrays) and all(shown(arrays[-1], part) for part in parts)

    probe.until(lambda: drawn(probe.markers()), "contact, force and object in the markers")
    contacts = {(m.ns, m.id) for m in shown(probe.markers()[-1], "finger_1/contacts")}

    probe.publish("objects", objects())
    for finger, tip in free.items():
        state = probe.until(lambda f=finger: (s := newest(probe, f)).contacts == [] and s)
        assert state.tip.position.x == pytest.approx(tip.position.x, abs=1e-7)

    def deleted():
        last = probe.markers()[-1]
        gone = {(m.ns, m.id) for m in last.markers if m.action == Marker.DELETE}
        return not shown(last, "objects") and gone >= contacts | {("objects", 0)}

    probe.until(deleted, "the deletion of contact and object")


def cone():
    item = sphere("cone", 0.05, (0.0, 0.0, 0.11))
    item.primitive = SolidPrimitive(type=SolidPrimitive.CONE, dimensions=[0.1, 0.05])
    return item


def changed(**values):
    item = sphere("ball", 0.02, (0.0, 0.0, 0.11))
    for path, value in values.items():
        target = item
        *way, last = path.split("__")
        for step in way:
            target = getattr(target, step)
        setattr(target, last, value)
    return item


BAD_OBJECTS = {
    "cone": (objects(cone()), "primitive.type: 'CONE'"),
    "frame": (objects(BALL, frame="map"), "unknown frame 'map'; valid: gripper/gripper_base"),
    "twice": (objects(BALL, BALL), "objects[1].name: 'ball'"),
    "unnamed": (objects(changed(name="")), "objects[0].name"),
    "zero quaternion": (objects(changed(pose__orientation__w=0.0)), "objects[0].pose.orientation"),
    "nan": (objects(changed(pose__position__y=math.nan)), "objects[0].pose.position[1]"),
    "radius": (objects(changed(primitive__dimensions=[-0.1])), "objects[0].dimensions.radius"),
    "sizes": (objects(changed(primitive__dimensions=[0.1, 0.1])), "objects[0].dimensions"),
    "mass": (objects(changed(mass=-1.0)), "objects[0].mass"),
    "on a base": (objects(sphere("ball", 0.03, (0.042, 0.0, 0.0))), "clear of the base disk"),
    "on the last base": (objects(sphere("ball", 0.02, (-0.021, -0.036, 0.0))), "finger_3"),
}


def test_bad_objects_are_refused_and_the_last_good_ones_stay(gripping):
    probe = gripping
    probe.publish("objects", objects(BALL))
    for finger in ("finger_1", "finger_2", "finger_3"):
        probe.until(lambda f=finger: newest(probe, f).contacts, "a contact")
    for case, (message, text) in BAD_OBJECTS.items():
        probe.publish("objects", message)
        status = objects_status(probe, DiagnosticStatus.ERROR)
        assert text in status.message, case
        # The scene is as it was: a new pull meets the ball.
        state = probe.pull_and_wait("finger_1", [PULL * 1.01])
        assert [c.obstacle for c in state.contacts] == ["ball"] * len(state.contacts) != [], case
        probe.publish("objects", objects(BALL))
        objects_status(probe, DiagnosticStatus.OK)


def test_objects_that_come_again_unchanged_cost_no_solve(gripping):
    probe = gripping
    probe.publish("objects", objects(BALL))
    probe.until(lambda: newest(probe, "finger_3").contacts, "a contact")
    probe.until(lambda: newest(probe, "finger_1").contacts, "a contact")
    before = len(probe.states("finger_1"))
    for _ in range(5):
        probe.publish("objects", objects(BALL))
    stamp = probe.pull("finger_1", [PULL * 1.01])
    probe.solved("finger_1", stamp)
    assert len(probe.states("finger_1")) == before + 1


@pytest.mark.parametrize("kind", ["box", "cylinder"])
def test_boxes_and_cylinders_touch(gripping, kind):
    probe = gripping
    item = sphere(kind, 0.05, (0.0, 0.0, 0.11))
    if kind == "box":
        item.primitive = SolidPrimitive(type=SolidPrimitive.BOX, dimensions=[0.1, 0.1, 0.06])
    else:
        # Lying along y.
        item.primitive = SolidPrimitive(type=SolidPrimitive.CYLINDER, dimensions=[0.2, 0.055])
        item.pose.orientation.x, item.pose.orientation.w = math.sqrt(0.5), math.sqrt(0.5)
    probe.publish("objects", objects(item))
    state = probe.until(lambda: (s := newest(probe, "finger_1")).contacts and s, "a contact")
    assert {c.obstacle for c in state.contacts} == {kind}
    probe.until(lambda: (m := probe.markers()) and shown(m[-1], "objects"), "the object shown")
    marker = shown(probe.markers()[-1], "objects")[0]
    assert marker.header.frame_id == "gripper/gripper_base"
    assert marker.type == (Marker.CUBE if kind == "box" else Marker.CYLINDER)
