# SPDX-License-Identifier: Apache-2.0
"""From objects in messages to what fingers touch."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from geometry_msgs.msg import Point
from probe import objects, sphere
from shape_msgs.msg import Mesh, MeshTriangle, SolidPrimitive

from ccr_ros.model import (
    Box,
    Capsule,
    ConvexMesh,
    FiniteCylinder,
    InvalidValue,
    Pose,
    Sphere,
)
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


CORNERS = [(x, y, z) for x in (-0.02, 0.02) for y in (-0.02, 0.02) for z in (-0.02, 0.02)]


def cube(triangles=(), corners=CORNERS, name="cube"):
    item = sphere(name, 1.0, (0.1, 0.2, 0.3))
    item.primitive = SolidPrimitive()
    points = [Point(x=x, y=y, z=z) for x, y, z in corners]
    item.mesh = Mesh(vertices=points, triangles=[MeshTriangle(vertex_indices=t) for t in triangles])
    turn = item.pose.orientation
    turn.x, turn.y, turn.z, turn.w = TURN
    return item


def test_a_mesh_of_vertices_is_their_hull():
    (found,) = objects_from_message(objects(cube()), "base")
    assert isinstance(found.shape, ConvexMesh) and found.solid.kind == "mesh"
    distance = found.obstacle().signed_distance(np.array([[0.1, 0.2, 0.33], [0.1, 0.25, 0.3]]))
    np.testing.assert_allclose(distance, [0.01, 0.03], atol=1e-9)


def test_a_mesh_of_triangles_is_taken_as_it_is():
    (hull,) = objects_from_message(objects(cube()), "base")
    corners, triangles = hull.solid.vertices.tolist(), hull.solid.faces.tolist()
    (found,) = objects_from_message(objects(cube(triangles, corners)), "base")
    np.testing.assert_array_equal(found.solid.vertices, corners)
    # The same again, elsewhere: its polyhedron is not made anew.
    again = cube(triangles, corners)
    again.pose.position.x = 0.5
    (moved,) = objects_from_message(objects(again), "base", [found])
    assert moved.shape is found.shape and moved.pose.position[0] == 0.5
    assert moved.form == found.form and moved.key != found.key
    for text, faces, points in (
        ("watertight", triangles[1:], corners),
        (r"objects\[0\]\.mesh\.faces", [[0, 1, 99]], corners),
        (r"objects\[0\]\.mesh\.vertices", triangles, [(np.nan, 0.0, 0.0), *corners[1:]]),
        (r"objects\[0\]\.mesh", (), corners[:3]),
    ):
        with pytest.raises(InvalidValue, match=text):
            objects_from_message(objects(cube(faces, points)), "base")


def test_a_size_that_cannot_be_is_the_primitives():
    with pytest.raises(InvalidValue, match=r"objects\[0\]\.primitive\.radius"):
        objects_from_message(objects(sphere("ball", 1e9, (0.0, 0.0, 0.1))), "base")


def test_dimensions_count_more_than_a_mesh():
    item = cube()
    item.primitive = SolidPrimitive(type=SolidPrimitive.SPHERE, dimensions=[0.01])
    (found,) = objects_from_message(objects(item), "base")
    assert isinstance(found.shape, Sphere)


def test_what_is_said_of_the_object_in_hand():
    item = sphere("ball", 0.05, (0.0, 0.0, 0.1))
    item.mass, item.friction, item.held = 0.2, 0.5, True
    (found,) = objects_from_message(objects(item), "base")
    assert (found.name, found.mass, found.friction, found.held) == ("ball", 0.2, 0.5, True)
    there = found.seen_at(Pose(np.array([0.0, 0.0, 0.2])))
    assert there.pose.position[2] == 0.2 and there.dimensions == (0.05,)
