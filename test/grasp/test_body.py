# SPDX-License-Identifier: Apache-2.0
"""The object in the gripper: every shape held in balance, what leaves it as it is, bad values."""

from dataclasses import replace

import numpy as np
import pytest

from ccr_ros.grasp.statics import (
    Body,
    GraspSolver,
    box_body,
    capsule_body,
    cylinder_body,
    mesh_body,
    sphere_body,
)
from ccr_ros.model import (
    Box,
    Capsule,
    ConvexMesh,
    Cylinder,
    FiniteCylinder,
    InvalidValue,
    MountedFinger,
    Plane,
    Pose,
    Sphere,
    load_gripper,
)
from ccr_ros.resources import find_config

GRAVITY = np.array([0.0, 0.0, -9.80665])
UP = Pose(np.array([0.0, 0.0, 0.110]))
MASS = 0.02
SIDE = 0.08
CUBE = SIDE * (np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T - 0.5)


def barrel():
    """Three-sided, thickest in the middle: 100 mm from its axis, 50 mm at its ends."""
    angles = 2 * np.pi * np.arange(3) / 3 + np.pi / 3
    ring = np.column_stack([np.cos(angles), np.sin(angles)])
    levels = [(-0.05, 0.05), (0.0, 0.1), (0.05, 0.05)]
    corners = [np.insert(radius * ring, 2, z, axis=1) for z, radius in levels]
    return ConvexMesh.hull_of(np.vstack(corners), edge_radius=0.005, name="barrel")


BODIES = {
    "ball": lambda: sphere_body(0.112, MASS, UP),
    "box": lambda: box_body([SIDE] * 3, MASS, UP),
    "cylinder": lambda: cylinder_body(0.1, 0.08, MASS, UP),
    "capsule": lambda: capsule_body(0.106, 0.012, MASS, UP),
    "mesh": lambda: mesh_body(barrel(), MASS, UP),
}


@pytest.fixture(scope="module")
def fingers():
    return load_gripper(find_config("gripper_sphere")).fingers


def held(fingers, body, gravity=GRAVITY):
    solver = GraspSolver(fingers, body, gravity=gravity)
    length = solver.hand.problems[0].rest_lengths[0] * solver.hand.length
    solver.solve({name: [0.034 * length] for name in solver.names}).require_converged()
    return solver.let_go().require_converged()


def balance(solution, gravity):
    """Net force and moment on the object, from the contacts and the weight alone."""
    pushes = [-c.force * c.normal for c in solution.contacts]
    arms = [c.position - solution.body.pose.position for c in solution.contacts]
    return solution.body.mass * gravity + sum(pushes), sum(map(np.cross, arms, pushes))


@pytest.mark.parametrize("kind", BODIES)
def test_every_shape_is_held_in_balance(fingers, kind):
    solution = held(fingers, BODIES[kind]())
    grip = sum(c.force for c in solution.contacts)
    assert grip > 0.2 and len(solution.contacts) >= 3
    force, moment = balance(solution, GRAVITY)
    assert np.abs(force).max() < 1e-6 * grip
    assert np.abs(moment).max() < 1e-6 * grip * 0.05
    shape = solution.body.shape.moved(solution.body.pose)
    points = np.array([c.position for c in solution.contacts])
    assert np.abs(shape.signed_distance(points)).max() < 1e-7
    normals = np.array([c.normal for c in solution.contacts])
    assert np.allclose(shape.derivatives(points)[0], normals, atol=1e-7)


@pytest.mark.parametrize("kind", ["cylinder", "mesh"])
def test_a_rigid_motion_of_all_changes_nothing(fingers, kind):
    turn = Pose(np.array([0.3, -0.2, 0.5]), np.array([0.5, -0.5, 0.5, 0.5]))
    body = BODIES[kind]()
    one = held(fingers, body)
    moved = [MountedFinger(m.finger, turn @ m.base) for m in fingers]
    two = held(moved, replace(body, pose=turn @ body.pose), turn.vectors(GRAVITY))
    assert np.allclose(turn.points(one.body.pose.position), two.body.pose.position, atol=1e-8)
    assert np.allclose(
        [c.force for c in one.contacts], [c.force for c in two.contacts], rtol=0, atol=1e-7
    )
    for a, b in zip(one.contacts, two.contacts, strict=True):
        assert np.allclose(turn.points(a.position), b.position, atol=1e-8)


def test_a_box_and_its_mesh_are_held_alike(fingers):
    mesh = ConvexMesh.hull_of(CUBE + UP.position).moved(Pose([1, 2, 3], [0, 0, 1, 0]))
    one = held(fingers, box_body([SIDE] * 3, MASS, UP))
    two = held(fingers, mesh_body(mesh, MASS, UP))
    assert np.allclose(one.body.pose.position, two.body.pose.position, atol=1e-9)
    assert np.allclose(
        [c.force for c in one.contacts], [c.force for c in two.contacts], rtol=0, atol=1e-7
    )


OFF, AXIS = np.array([0.01, -0.02, 0.015]), np.array([2.0, -1.0, 2.0]) / 3
FREE = {
    "ball": (Sphere(np.zeros(3), 0.05), 3),
    "ball beside its centre of mass": (Sphere(OFF, 0.05), 3),
    "cylinder": (FiniteCylinder(np.zeros(3), AXIS, 0.08, 0.05), 1),
    "cylinder aside": (FiniteCylinder(OFF, AXIS, 0.08, 0.05, 0.01), 1),
    "capsule": (Capsule(OFF - 0.03 * AXIS, OFF + 0.02 * AXIS, 0.02), 1),
    "rod": (Cylinder(OFF, AXIS, 0.05), 2),
    "box": (Box(np.zeros(3), np.ones(3)), 0),
    "mesh": (ConvexMesh.hull_of(CUBE), 0),
}


@pytest.mark.parametrize(("shape", "count"), FREE.values(), ids=FREE)
def test_motions_that_leave_a_surface_as_it_is(shape, count):
    body = Body(shape)
    motions = body.free_directions()
    assert motions.shape == (6, count)
    points = np.random.default_rng(1).uniform(-0.1, 0.1, (50, 3))
    normals = shape.derivatives(points)[0]
    slides = [
        np.abs(np.einsum("ij,ij->i", normals, m[:3] + np.cross(m[3:], points))).max()
        for m in [*motions.T, *np.eye(6)]
    ]
    assert max(slides[:count], default=0) < 1e-12
    assert np.linalg.matrix_rank(motions) == count
    # Nothing else does: the way the normals see motions has the rank that is left.
    seen = np.concatenate([normals, np.cross(points, normals)], axis=1)
    assert np.linalg.matrix_rank(seen, tol=1e-9) == 6 - count


def test_shapes_are_put_about_the_centre_of_mass():
    can = cylinder_body(0.06, 0.1).shape
    assert (can.radius, can.height, can.axis.tolist()) == (0.03, 0.1, [0, 0, 1])
    capsule = capsule_body(0.06, 0.04).shape
    ends = capsule.signed_distance(np.array([[0, 0, 0.05], [0, 0, -0.05], [0.03, 0, 0]]))
    assert np.allclose(ends, 0, atol=1e-12)
    cut = ConvexMesh.hull_of([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]], edge_radius=0.002)
    body = mesh_body(cut.moved(Pose([1, 2, 3])), 0.1)
    assert np.allclose(body.shape.centroid, 0, atol=1e-15)
    assert np.allclose(body.shape.vertices.min(axis=0), -0.025)
    assert (body.shape.edge_radius, body.name) == (0.002, "obstacle")


@pytest.mark.parametrize("make", BODIES.values(), ids=BODIES)
def test_friction_is_a_coefficient(make):
    assert make().friction == 0.0
    assert replace(make(), friction=0.7).friction == 0.7
    for bad in (-0.1, float("nan"), float("inf"), "rough", None, True):
        with pytest.raises(InvalidValue, match="friction"):
            replace(make(), friction=bad)
    assert box_body([SIDE] * 3, MASS, UP, 0.4).friction == 0.4
    assert sphere_body(0.1, friction=0.4).friction == 0.4


@pytest.mark.parametrize(
    ("make", "place"),
    [
        (lambda: Body(Plane(np.zeros(3), np.array([0.0, 0.0, 1.0]))), "shape"),
        (lambda: Body(CUBE), "shape"),
        (lambda: Body(Sphere(np.array([0, 0, 0.2]), 0.05), MASS), "shape"),
        (lambda: Body(ConvexMesh.hull_of(CUBE + 0.1), MASS), "shape"),
        (lambda: sphere_body(0), "diameter"),
        (lambda: sphere_body(0.1, float("nan")), "mass"),
        (lambda: box_body([0.1, 0.1]), "size"),
        (lambda: box_body([0.1, 0.1, -1]), "size[2]"),
        (lambda: box_body([0.1, 0.1, 0.1], edge_radius=1), "edge_radius"),
        (lambda: cylinder_body(-0.1, 0.1), "diameter"),
        (lambda: cylinder_body(0.1, 0), "height"),
        (lambda: capsule_body(float("inf"), 1), "diameter"),
        (lambda: capsule_body(0.1, 0.0), "length"),
    ],
)
def test_bad_values_are_named(make, place):
    with pytest.raises(InvalidValue) as caught:
        make()
    assert caught.value.place == place
