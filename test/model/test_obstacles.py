# SPDX-License-Identifier: Apache-2.0
"""Signed distances against brute force, and their derivatives against finite differences."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from ccr_ros.model import (
    Box,
    Capsule,
    ConvexMesh,
    Cylinder,
    FingerSolver,
    FiniteCylinder,
    InvalidValue,
    Plane,
    Pose,
    Sphere,
)

from .fingers import make_finger

deterministic = settings(derandomize=True, max_examples=60, deadline=None)
number = st.floats(-1, 1)
points = st.tuples(number, number, number).map(np.array)
quaternions = (
    st.tuples(number, number, number, number)
    .map(np.array)
    .filter(lambda q: np.linalg.norm(q) > 0.1)
    .map(lambda q: q / np.linalg.norm(q))
)
poses = st.builds(Pose, points, quaternions)

TURN = np.array([0.1, -0.3, 0.2, 0.9]) / np.linalg.norm([0.1, -0.3, 0.2, 0.9])
SPHERE = Sphere([0.1, -0.2, 0.3], 0.4)
CYLINDER = Cylinder([0.1, 0.2, 0.3], [1, 2, -1], 0.3)
PLANE = Plane([0.1, 0.2, 0.3], [1, -1, 2])
BOX = Box([0.1, -0.1, 0.2], [0.6, 0.8, 1.0], TURN, 0.15)
CAPSULE = Capsule([0.1, -0.2, -0.1], [0.3, 0.2, 0.3], 0.25)
CAN = FiniteCylinder([0.1, -0.1, 0.2], [1, 2, -1], 0.6, 0.4, 0.1)
WEDGE = [[0, 0, 0], [0.9, 0, 0], [0, 0.8, 0], [0.7, 0.6, 0.1], [0.1, 0.2, 0.9], [0.5, 0.2, 0.8]]
MESH = ConvexMesh.hull_of(WEDGE, edge_radius=0.05).moved(Pose([-0.4, -0.3, -0.2], TURN))
ALL = [SPHERE, CYLINDER, PLANE, BOX, CAPSULE, CAN, MESH]
by_type = pytest.mark.parametrize("obstacle", ALL, ids=lambda o: type(o).__name__)


def distance(obstacle, point):
    return float(obstacle.signed_distance(np.atleast_2d(np.asarray(point, dtype=float)))[0])


def normal_and_hessian(obstacle, point):
    normals, hessians = obstacle.derivatives(np.atleast_2d(np.asarray(point, dtype=float)))
    return normals[0], hessians[0]


def smooth_at(obstacle, point):
    """Tell whether the distance has second derivatives around the point."""
    if isinstance(obstacle, Sphere):
        return np.linalg.norm(point - obstacle.center) > 0.02
    if isinstance(obstacle, Cylinder):
        return np.linalg.norm(np.cross(point - obstacle.point, obstacle.axis)) > 0.02
    if isinstance(obstacle, Box):
        # Faces meet edges where a local coordinate leaves the core; deep inside, two faces tie.
        local = Pose(obstacle.center, obstacle.orientation).inverse().points(point)
        excess = np.abs(local) - (obstacle.size / 2 - obstacle.edge_radius)
        if np.abs(excess).min() < 1e-3 or np.abs(local).min() < 1e-3:
            return False
        ordered = np.sort(excess)
        return bool(ordered[-1] > 0.02 or (ordered[-1] < 0 and ordered[-1] - ordered[-2] > 1e-3))
    # Where pieces of a surface meet, or tie for the nearest, normal or Hessian jump.
    around = point + 1e-4 * np.vstack([np.eye(3), -np.eye(3), np.zeros((1, 3))])
    normals, hessians = obstacle.derivatives(around)
    step = np.abs(hessians - hessians[-1]).max()
    return bool(np.abs(normals - normals[-1]).max() < 0.02 and step < 0.05 and within(hessians[-1]))


def within(hessian):
    """Tell whether differences of 1e-5 can follow a curvature."""
    return np.abs(hessian).max() < 50


@pytest.mark.parametrize(
    ("obstacle", "point", "expected"),
    [
        (Sphere([0, 0, 1], 0.5), [0, 0, 0], 0.5),
        (Sphere([0, 0, 1], 0.5), [0, 0.3, 1.4], 0.0),
        (Sphere([0, 0, 1], 0.5), [0, 0, 1], -0.5),
        (Cylinder([0, 0, 1], [0, 7, 0], 0.5), [3, 1e3, 5], 4.5),
        (Cylinder([0, 5, 1], [0, 1, 0], 0.5), [0.3, -2, 1.0], -0.2),
        (Cylinder([0, 0, 1], [0, -1, 0], 0.5), [0, 9, 1.5], 0.0),
        (Plane([5, 5, 1], [0, 0, 2]), [-3, 2, 4], 3.0),
        (Plane([0, 0, 1], [0, 0, 2]), [0, 0, 0], -1.0),
        (Plane([1, 0, 0], [1, 1, 0]), [1, 2, 9], np.sqrt(2)),
        # Faces of a box stay where they are, whatever the rounding; corners are cut back.
        (Box([0, 0, 0], [2, 4, 6]), [1, 0.5, -2], 0.0),
        (Box([0, 0, 0], [2, 4, 6]), [3, 0, 0], 2.0),
        (Box([0, 0, 0], [2, 4, 6]), [0, 0, -4], 1.0),
        (Box([0, 0, 0], [2, 4, 6]), [0, 0, 0], -1.0),
        (Box([0, 0, 0], [2, 4, 6], edge_radius=0.5), [1 - 0.5, 2, 3 - 0.5], 0.0),
        (Box([0, 0, 0], [2, 4, 6], edge_radius=0.5), [1, 2, 0], (np.sqrt(2) - 1) * 0.5),
        (Box([0, 0, 0], [2, 4, 6], edge_radius=0.5), [1, 2, 3], (np.sqrt(3) - 1) * 0.5),
        (Box([0, 0, 0], [2, 4, 6], edge_radius=0.5), [4, 6, 0], np.hypot(3.5, 4.5) - 0.5),
        # A quarter turn about z swaps x and y.
        (Box([0, 0, 0], [2, 4, 6], [0, 0, 0.5**0.5, 0.5**0.5]), [3, 0, 0], 1.0),
        (Box([0, 0, 0], [2, 2, 2], edge_radius=1), [2, 2, 2], np.sqrt(12) - 1),  # a ball
        # Round at its ends, as a cylinder between them.
        (Capsule([0, 0, -1], [0, 0, 1], 0.5), [2, 0, 0.9], 1.5),
        (Capsule([0, 0, -1], [0, 0, 1], 0.5), [0, 0, 3], 1.5),
        (Capsule([0, 0, -1], [0, 0, 1], 0.5), [3, 0, -5], 4.5),
        (Capsule([0, 0, -1], [0, 0, 1], 0.5), [0, 0, 0.3], -0.5),
        # Side and ends of a cylinder stay where they are, whatever the rounding.
        (FiniteCylinder([0, 0, 1], [0, 0, 5], 4, 2), [0, 3, 1.5], 1.0),
        (FiniteCylinder([0, 0, 1], [0, 0, 5], 4, 2), [1.5, 0.5, 4], 1.0),
        (FiniteCylinder([0, 0, 1], [0, 0, 5], 4, 2), [1.5, 0, -1], 0.0),
        (FiniteCylinder([0, 0, 1], [0, 0, 5], 4, 2), [0.3, 0, -0.5], -0.5),
        (FiniteCylinder([0, 0, 1], [0, 0, 5], 4, 2), [0, -1.9, 1], -0.1),
        (FiniteCylinder([0, 0, 0], [1, 0, 0], 4, 2, 0.5), [2, 2, 0], (np.sqrt(2) - 1) * 0.5),
        (FiniteCylinder([0, 0, 0], [1, 0, 0], 4, 2, 0.5), [-4.5, 0, 4.5], np.hypot(3, 3) - 0.5),
        (FiniteCylinder([0, 0, 0], [1, 0, 0], 4, 2, 0.5), [0, 0, 0], -2.0),
    ],
)
def test_known_distances(obstacle, point, expected):
    assert distance(obstacle, point) == pytest.approx(expected, abs=1e-12)


def surface_of(box, count=41):
    """Points all over a rounded box: those of the core's surface, pushed out by the rounding."""
    core = box.size / 2 - box.edge_radius
    draw = np.random.default_rng(3)
    out = []
    grid = np.linspace(-1, 1, count)
    directions = draw.normal(size=(40 * count**2, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    # Every outward direction leads from its own vertex, edge or face of the core.
    out.append(np.sign(directions) * core + box.edge_radius * directions)
    for axis in range(3):
        u, v = np.meshgrid(grid, grid)
        for sign in (-1, 1):
            face = np.insert(np.column_stack([u.ravel(), v.ravel()]), axis, sign, axis=1) * core
            face[:, axis] += sign * box.edge_radius
            out.append(face)
        for angle in np.linspace(0, 2 * np.pi, 8 * count):
            arc = np.insert([np.cos(angle), np.sin(angle)], axis, 0.0)
            edge = np.sign(np.round(arc, 9)) * core + box.edge_radius * arc
            edge = np.tile(edge, (count, 1))
            edge[:, axis] = grid * core[axis]
            out.append(edge)
    return Pose(box.center, box.orientation).points(np.vstack(out))


def test_box_distances_against_brute_force():
    surface = surface_of(BOX)
    np.testing.assert_allclose(BOX.signed_distance(surface), 0, atol=1e-12)
    draw = np.random.default_rng(5)
    inside = 0
    for point in draw.uniform(-0.9, 0.9, (60, 3)):
        brute = np.linalg.norm(surface - point, axis=1).min()
        local = Pose(BOX.center, BOX.orientation).inverse().points(point)
        core = np.clip(local, -(BOX.size / 2 - 0.15), BOX.size / 2 - 0.15)
        sign = -1 if np.linalg.norm(local - core) < 0.15 else 1
        inside += sign < 0
        # The samples are up to some 15 mm apart.
        assert distance(BOX, point) == pytest.approx(sign * brute, abs=1e-2)
    assert 5 < inside < 55


@by_type
def test_many_points_are_as_one_by_one(obstacle):
    many = np.random.default_rng(2).uniform(-1, 1, (50, 3))
    distances, (normals, hessians) = obstacle.signed_distance(many), obstacle.derivatives(many)
    assert (distances.shape, normals.shape, hessians.shape) == ((50,), (50, 3), (50, 3, 3))
    for i, point in enumerate(many):
        assert distance(obstacle, point) == pytest.approx(distances[i], abs=1e-14)
        normal, hessian = normal_and_hessian(obstacle, point)
        np.testing.assert_allclose(normal, normals[i], atol=1e-15)
        np.testing.assert_allclose(hessian, hessians[i], atol=1e-12)
    assert obstacle.signed_distance(np.zeros((0, 3))).shape == (0,)
    assert [a.shape for a in obstacle.derivatives(np.zeros((0, 3)))] == [(0, 3), (0, 3, 3)]


@by_type
@deterministic
@given(point=points)
def test_derivatives_against_finite_differences(obstacle, point):
    assume(smooth_at(obstacle, point))
    normal, hessian = normal_and_hessian(obstacle, point)
    h = 1e-5
    gradient = [
        (distance(obstacle, point + h * e) - distance(obstacle, point - h * e)) / (2 * h)
        for e in np.eye(3)
    ]
    columns = [
        normal_and_hessian(obstacle, point + h * e)[0]
        - normal_and_hessian(obstacle, point - h * e)[0]
        for e in np.eye(3)
    ]
    np.testing.assert_allclose(normal, gradient, atol=2e-6)
    np.testing.assert_allclose(hessian, np.array(columns) / (2 * h), atol=1e-4)
    assert np.linalg.norm(normal) == pytest.approx(1, abs=1e-12)
    np.testing.assert_allclose(hessian, hessian.T, atol=1e-12)
    np.testing.assert_allclose(hessian @ normal, 0, atol=1e-10)


@by_type
@deterministic
@given(a=points, b=points)
def test_distances_are_continuous_and_never_steeper_than_one(obstacle, a, b):
    # Holds of every distance, across edges, corners and centres too.
    gap = np.linalg.norm(a - b)
    assert abs(distance(obstacle, a) - distance(obstacle, b)) <= gap + 1e-12


@by_type
@deterministic
@given(point=points, pose=poses)
def test_moving_obstacle_and_point_together_changes_nothing(obstacle, point, pose):
    moved = obstacle.moved(pose)
    assert type(moved) is type(obstacle) and moved.name == obstacle.name
    there = pose.points(point)
    assert distance(moved, there) == pytest.approx(distance(obstacle, point), abs=1e-12)
    if smooth_at(obstacle, point):
        normal, hessian = normal_and_hessian(obstacle, point)
        turned_normal, turned_hessian = normal_and_hessian(moved, there)
        np.testing.assert_allclose(turned_normal, pose.vectors(normal), atol=1e-9)
        expected = pose.rotation @ hessian @ pose.rotation.T
        np.testing.assert_allclose(turned_hessian, expected, atol=1e-8)


def test_normals_of_a_box_turn_smoothly_around_an_edge():
    box = Box([0, 0, 0], [2, 2, 2], edge_radius=0.1)
    angles = np.linspace(0, np.pi / 2, 200)
    ring = 0.9 + 0.1 * np.array([np.cos(angles), np.sin(angles)])
    path = np.column_stack([ring[0], ring[1], np.zeros(200)])
    path = np.vstack([[1, 0.8, 0], path, [0.8, 1, 0]])
    normals, _ = box.derivatives(path)
    np.testing.assert_allclose(box.signed_distance(path), 0, atol=1e-12)
    assert np.linalg.norm(np.diff(normals, axis=0), axis=1).max() < 0.01
    np.testing.assert_allclose(normals[0], [1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(normals[-1], [0, 1, 0], atol=1e-12)


def test_normals_of_a_cylinder_turn_smoothly_around_its_edge():
    can = FiniteCylinder([0, 0, 0], [0, 0, 1], 2, 1, 0.1)
    angles = np.linspace(0, np.pi / 2, 200)
    path = np.column_stack([0.9 + 0.1 * np.cos(angles), 0 * angles, 0.9 + 0.1 * np.sin(angles)])
    path = np.vstack([[1, 0, 0.8], path, [0.8, 0, 1]])
    normals, _ = can.derivatives(path)
    np.testing.assert_allclose(can.signed_distance(path), 0, atol=1e-12)
    assert np.linalg.norm(np.diff(normals, axis=0), axis=1).max() < 0.01
    np.testing.assert_allclose(normals[0], [1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(normals[-1], [0, 0, 1], atol=1e-12)


@deterministic
@given(point=points)
def test_a_long_cylinder_is_an_infinite_one_and_a_short_capsule_a_ball(point):
    long = FiniteCylinder(CYLINDER.point, CYLINDER.axis, 100.0, CYLINDER.radius)
    assume(np.linalg.norm(np.cross(point - CYLINDER.point, CYLINDER.axis)) > 0.02)
    assert distance(long, point) == pytest.approx(distance(CYLINDER, point), abs=1e-12)
    for one, other in zip(
        normal_and_hessian(long, point), normal_and_hessian(CYLINDER, point), strict=True
    ):
        np.testing.assert_allclose(one, other, atol=1e-9)
    short = Capsule(SPHERE.center, SPHERE.center + 1e-9 * np.eye(3)[2], SPHERE.radius)
    assert distance(short, point) == pytest.approx(distance(SPHERE, point), abs=1e-8)


def test_a_capsule_knows_its_axis():
    assert CAPSULE.length == pytest.approx(0.6)
    np.testing.assert_allclose(CAPSULE.center, [0.2, 0, 0.1], atol=1e-12)
    np.testing.assert_allclose(CAPSULE.axis, np.array([0.2, 0.4, 0.4]) / 0.6, atol=1e-12)


def test_default_rounding_is_small():
    assert FiniteCylinder([0, 0, 0], [0, 0, 1], 0.1, 0.2).edge_radius == 0.001
    assert FiniteCylinder([0, 0, 0], [0, 0, 1], 0.01, 0.2).edge_radius == pytest.approx(0.0005)
    assert Box([0, 0, 0], [0.1, 0.2, 0.3]).edge_radius == 0.001
    assert Box([0, 0, 0], [0.01, 0.2, 0.3]).edge_radius == pytest.approx(0.0005)


@pytest.mark.parametrize(
    ("obstacle", "point"),
    [
        (Sphere([0, 0, 0.1], 0.01), [0, 0, 0.1]),
        (Cylinder([0, 0, 0.1], [0, 3, 0], 0.01), [0, 0.2, 0.1]),
        (Cylinder([0, 0, 0.1], [1, 1, 1], 0.01), [0.2, 0.2, 0.3]),
        (Box([0, 0, 0.1], [1, 1, 1]), [0, 0, 0.1]),
        (Capsule([0, 0, 0], [1, 1, 1], 0.01), [0.2, 0.2, 0.2]),
        (Capsule([0, 0, 0], [1, 1, 1], 0.01), [0, 0, 0]),
        (FiniteCylinder([0, 0, 0.1], [1, 1, 1], 1, 0.4), [0.2, 0.2, 0.3]),
        (FiniteCylinder([0, 0, 0.1], [1, 1, 1], 0.1, 0.4), [0.01, 0.01, 0.11]),
    ],
)
def test_at_its_centre_an_obstacle_still_has_a_normal(obstacle, point):
    normal, hessian = normal_and_hessian(obstacle, point)
    assert np.linalg.norm(normal) == pytest.approx(1, abs=1e-12)
    assert np.abs(hessian).max() < 1e12 and np.isfinite(hessian).all()
    if isinstance(obstacle, Cylinder):
        assert normal @ obstacle.axis == pytest.approx(0, abs=1e-12)


def test_a_finger_leaves_an_obstacle_that_appears_centred_on_a_disk():
    solver = FingerSolver(make_finger())
    solver.obstacles = (Sphere([0, 0, 0.182], 0.005),)
    solution = solver.solve([0.0])
    assert solution.certificate.converged
    assert np.linalg.norm(solution.backbone[-1] - [0, 0, 0.182]) == pytest.approx(0.005, abs=1e-9)


@pytest.mark.parametrize(
    ("make", "place"),
    [
        (lambda: Sphere([0, 0], 1), "center"),
        (lambda: Sphere([0, 0, 0], 0), "radius"),
        (lambda: Cylinder([0, 0, 0], [0, 0, 0], 1), "axis"),
        (lambda: Cylinder([0, 0, 0], [0, 0, 1], -1), "radius"),
        (lambda: Plane([0, 0, 0], [0, 0, np.nan]), "normal[2]"),
        (lambda: Box([0, 0, 0], [1, 1, 0]), "size[2]"),
        (lambda: Box([0, 0, 0], [1, 1, 1], [0, 0, 0, 2]), "orientation"),
        (lambda: Box([0, 0, 0], [1, 1, 1], edge_radius=0.6), "edge_radius"),
        (lambda: Capsule([0, 0], [0, 0, 1], 1), "start"),
        (lambda: Capsule([0, 0, 0], [0, 0, np.inf], 1), "end[2]"),
        (lambda: Capsule([0, 0, 1], [0, 0, 1], 1), "end"),
        (lambda: Capsule([0, 0, 0], [0, 0, 1], 0), "radius"),
        (lambda: FiniteCylinder([0, 0, np.nan], [0, 0, 1], 1, 1), "center[2]"),
        (lambda: FiniteCylinder([0, 0, 0], [0, 0, 0], 1, 1), "axis"),
        (lambda: FiniteCylinder([0, 0, 0], [0, 0, 1], 0, 1), "height"),
        (lambda: FiniteCylinder([0, 0, 0], [0, 0, 1], 1, -1), "radius"),
        (lambda: FiniteCylinder([0, 0, 0], [0, 0, 1], 2, 1, 1), "edge_radius"),
        (lambda: FiniteCylinder([0, 0, 0], [0, 0, 1], 2, 1, 0), "edge_radius"),
    ],
)
def test_bad_values_are_refused(make, place):
    with pytest.raises(InvalidValue) as caught:
        make()
    assert caught.value.place == place


def test_nearly_unit_quaternions_are_made_unit():
    box = Box([0, 0, 0], [2, 2, 2], [0, 0, 0, 1.009])
    assert distance(box, [2, 0, 0]) == pytest.approx(1, abs=1e-12)


def test_values_are_frozen():
    for array in (
        SPHERE.center,
        CYLINDER.axis,
        PLANE.normal,
        BOX.size,
        BOX.orientation,
        MESH.vertices,
    ):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 9
