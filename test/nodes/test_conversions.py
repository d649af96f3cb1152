# SPDX-License-Identifier: Apache-2.0
"""Conversions between messages and the model that the topics' tests do not reach."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from probe import objects, sphere
from shape_msgs.msg import SolidPrimitive

from ccr_ros.model import (
    Box,
    Capsule,
    ConvexMesh,
    FiniteCylinder,
    InvalidValue,
    Pose,
    Sphere,
)
from ccr_ros.nodes.frames import FingerFrames, prefix_of
from ccr_ros.nodes.object_conversions import objects_from_message, obstacle_from_body
from ccr_ros.viz.solids import SolidObject

# A quarter turn about x: the body's z points along -y.
TURN = (np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5))


def obstacle(kind, dimensions):
    item = sphere("thing", 1.0, (0.1, 0.2, 0.3))
    item.primitive = SolidPrimitive(type=kind, dimensions=dimensions)
    turn = item.pose.orientation
    turn.x, turn.y, turn.z, turn.w = TURN
    (found,) = objects_from_message(objects(item), "base")
    return found.obstacle()


def test_sphere():
    found = obstacle(SolidPrimitive.SPHERE, [0.05])
    assert isinstance(found, Sphere)
    assert (found.name, found.radius, found.center.tolist()) == ("thing", 0.05, [0.1, 0.2, 0.3])


def test_box_is_turned():
    found = obstacle(SolidPrimitive.BOX, [0.02, 0.04, 0.06])
    assert isinstance(found, Box)
    # Its z side lies along y: half of it away is the surface.
    distance = found.signed_distance(np.array([[0.1, 0.2 + 0.04, 0.3], [0.1, 0.2, 0.3 + 0.04]]))
    np.testing.assert_allclose(distance, [0.01, 0.02], atol=1e-12)


def test_cylinder_has_an_axis_and_ends():
    found = obstacle(SolidPrimitive.CYLINDER, [0.1, 0.05])
    assert isinstance(found, FiniteCylinder)
    np.testing.assert_allclose(found.axis, [0.0, -1.0, 0.0], atol=1e-12)
    distance = found.signed_distance(np.array([[0.1, 0.22, 0.3 + 0.06], [0.1, 0.2 + 0.07, 0.3]]))
    np.testing.assert_allclose(distance, [0.01, 0.02], atol=1e-12)


def test_bodies_without_a_primitive():
    pose = Pose(np.array([0.1, 0.2, 0.3]), np.array(TURN))
    capsule = obstacle_from_body(SolidObject("pill", "capsule", (0.06, 0.02), pose))
    assert isinstance(capsule, Capsule) and capsule.name == "pill"
    ends = np.array([[0.1, 0.2 + 0.05, 0.3], [0.1, 0.2 - 0.05, 0.3], [0.1, 0.2, 0.3 + 0.02]])
    np.testing.assert_allclose(capsule.signed_distance(ends), 0, atol=1e-12)
    corners, faces = np.vstack([np.zeros((1, 3)), 0.1 * np.eye(3)]), list(combinations(range(4), 3))
    body = SolidObject("wedge", "mesh", (), pose, corners, faces)
    mesh = obstacle_from_body(body)
    assert isinstance(mesh, ConvexMesh) and mesh.name == "wedge"
    on_face = pose.points(np.array([[0.03, 0.03, 0.0]]))
    np.testing.assert_allclose(mesh.signed_distance(on_face), 0, atol=1e-12)
    with pytest.raises(InvalidValue, match="watertight"):
        obstacle_from_body(replace(body, faces=[*faces[:3], faces[0]]))


def test_an_unknown_kind_is_named():
    with pytest.raises(InvalidValue, match=r"objects\[0\]\.primitive\.type: 'PRISM'"):
        obstacle(SolidPrimitive.PRISM, [0.1, 0.1])


@pytest.mark.parametrize(
    ("namespace", "prefix"), [("/", ""), ("/gripper", "gripper/"), ("/left/hand", "left/hand/")]
)
def test_frames_come_from_the_namespace(namespace, prefix):
    assert prefix_of(namespace) == prefix
    frames = FingerFrames.of("thumb", "world", prefix_of(namespace))
    assert frames == FingerFrames("world", f"{prefix}thumb_base", f"{prefix}thumb_tip")
