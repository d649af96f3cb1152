# SPDX-License-Identifier: Apache-2.0
"""Convex meshes: nearest points against their conditions, boxes, and what is no convex mesh."""

import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ccr_ros.model import Box, ConvexMesh, InvalidValue, Pose
from ccr_ros.model.errors import MissingPackage
from ccr_ros.model.obstacles.polytope import MAX_FACES, convex_hull

optimize = pytest.importorskip("scipy.optimize")

deterministic = settings(derandomize=True, max_examples=60, deadline=None)
TURN = np.array([0.1, -0.3, 0.2, 0.9]) / np.linalg.norm([0.1, -0.3, 0.2, 0.9])
SIZE = np.array([0.06, 0.08, 0.10])
CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * SIZE - SIZE / 2
SIDES = [
    [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
    [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
]  # fmt: skip


def box_mesh(**options):
    return ConvexMesh(CORNERS, SIDES, **options)


def test_a_box_as_a_mesh_is_that_box():
    box = Box([0.1, -0.1, 0.2], SIZE, TURN, 0.004)
    mesh = box_mesh(edge_radius=0.004).moved(Pose([0.1, -0.1, 0.2], TURN))
    points = np.random.default_rng(0).uniform(-0.1, 0.1, (20_000, 3)) + box.center
    np.testing.assert_allclose(
        mesh.signed_distance(points), box.signed_distance(points), atol=1e-15
    )
    (normals, hessians), (box_normals, box_hessians) = (
        mesh.derivatives(points),
        box.derivatives(points),
    )
    np.testing.assert_allclose(normals, box_normals, atol=1e-12)
    np.testing.assert_allclose(hessians, box_hessians, atol=1e-8)
    assert box_mesh().edge_radius == Box([0, 0, 0], SIZE).edge_radius


numbers = st.floats(-1, 1)
clouds = st.lists(st.tuples(numbers, numbers, numbers), min_size=4, max_size=9).map(np.array)


@deterministic
@given(
    cloud=clouds,
    flatness=st.tuples(*[st.sampled_from([1.0, 0.1, 0.01])] * 3),
    rounding=st.sampled_from([0.01, 0.5, 0.9, 0.999]),
    seed=st.integers(0, 1000),
)
def test_nearest_points_meet_the_conditions_of_least_distance(cloud, flatness, rounding, seed):
    """The foot is in the core, and the way from it within the cone of the faces it is on."""
    cloud = cloud * flatness
    try:
        planes = convex_hull("points", cloud).planes
        room = float(planes.depth(ConvexMesh.hull_of(cloud).centroid[None])[0])
    except InvalidValue:
        return  # flat
    mesh = ConvexMesh.hull_of(cloud, edge_radius=rounding * room)
    size = float(np.ptp(cloud, axis=0).max())
    core = planes.offsets - mesh.edge_radius
    points = cloud.mean(axis=0) + size * np.random.default_rng(seed).uniform(-1, 1, (20, 3))
    distances, normals = mesh.signed_distance(points), mesh.derivatives(points)[0]
    feet = points - (distances + mesh.edge_radius)[:, None] * normals
    for point, distance, normal, foot in zip(points, distances, normals, feet, strict=True):
        over = planes.normals @ foot - core
        assert over.max() == pytest.approx(0, abs=1e-9 * size)
        assert np.linalg.norm(normal) == pytest.approx(1, abs=1e-12)
        if (planes.normals @ point - core).max() > 1e-9 * size:
            near = planes.normals[over > -1e-7 * size]
            assert optimize.nnls(near.T, normal)[1] < 1e-5
        else:
            inside = (planes.normals @ point - planes.offsets).max()
            assert distance == pytest.approx(inside, abs=1e-9 * size)


def test_corners_are_cut_back_and_faces_stay():
    mesh = ConvexMesh.hull_of(CORNERS, edge_radius=0.01)
    middles = np.vstack([np.diag(SIZE / 2), -np.diag(SIZE / 2)])
    np.testing.assert_allclose(mesh.signed_distance(middles), 0, atol=1e-15)
    np.testing.assert_allclose(mesh.signed_distance(CORNERS), 0.01 * (np.sqrt(3) - 1), atol=1e-12)


def test_a_chamfer_smaller_than_the_rounding_is_lost_in_it():
    cut = np.concatenate([CORNERS[:-1], CORNERS[-1] - 0.002 * np.eye(3)])
    plain, chamfered = (
        ConvexMesh.hull_of(CORNERS, edge_radius=0.01),
        ConvexMesh.hull_of(cut, edge_radius=0.01),
    )
    points = np.random.default_rng(1).uniform(-0.1, 0.1, (2000, 3))
    np.testing.assert_allclose(
        plain.signed_distance(points), chamfered.signed_distance(points), atol=1e-12
    )


def test_normals_turn_smoothly_over_edges_and_corners():
    mesh = ConvexMesh.hull_of(CORNERS + 0.3 * CORNERS[:, [1, 2, 0]], edge_radius=0.01)
    way = np.linspace([-0.2, -0.1, -0.15], [0.1, 0.2, 0.2], 4000)
    on_surface = way - mesh.signed_distance(way)[:, None] * mesh.derivatives(way)[0]
    outside = mesh.signed_distance(way) > 0
    np.testing.assert_allclose(mesh.signed_distance(on_surface[outside]), 0, atol=1e-12)
    normals = mesh.derivatives(on_surface)[0]
    steps = np.linalg.norm(np.diff(on_surface, axis=0), axis=1)
    turns = np.linalg.norm(np.diff(normals, axis=0), axis=1)
    both = outside[1:] & outside[:-1]
    assert (turns[both] <= steps[both] / 0.01 * 1.01 + 1e-9).all()
    assert turns[both].max() > 1e-4


def test_triangles_in_one_plane_are_one_face_also_after_rounding_to_single_precision():
    turned = Pose([0.01, 0.02, 0.03], TURN)
    coarse = turned.points(CORNERS).astype(np.float32).astype(float)
    mesh = ConvexMesh(coarse, SIDES, edge_radius=0.004)
    assert len(mesh._core.faces.offsets) == 6 and len(mesh._core.tails) == 12
    box = Box(turned.position, SIZE, TURN, 0.004)
    points = np.random.default_rng(2).uniform(-0.1, 0.1, (500, 3))
    np.testing.assert_allclose(mesh.signed_distance(points), box.signed_distance(points), atol=2e-8)


def test_the_centre_of_mass_is_that_of_the_solid():
    # A pyramid's is a quarter of its height above the base.
    mesh = ConvexMesh.hull_of([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0.5, 0.5, 1]])
    np.testing.assert_allclose(mesh.centroid, [0.5, 0.5, 0.25], atol=1e-12)
    moved = mesh.moved(Pose([1, 2, 3], TURN))
    centred = moved.centred()
    np.testing.assert_allclose(centred.centroid, 0, atol=1e-12)
    np.testing.assert_allclose(centred.position, moved.pose.points(mesh.centroid), atol=1e-12)
    points = np.random.default_rng(3).uniform(-1, 1, (100, 3)) + moved.position
    np.testing.assert_allclose(
        centred.signed_distance(points), moved.signed_distance(points), atol=1e-12
    )


def test_faces_are_turned_outward_however_they_are_given():
    flipped = [side[::-1] if i % 2 else side for i, side in enumerate(SIDES)]
    mesh = ConvexMesh(CORNERS, flipped)
    corners = mesh.vertices[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("ij,ij->i", normals, corners.mean(axis=1)) > 0).all()
    assert {frozenset(f) for f in mesh.faces.tolist()} == {frozenset(f) for f in SIDES}


def test_arrays_as_messages_hold_them_are_taken():
    mesh = ConvexMesh(CORNERS.astype(np.float32), np.array(SIDES, np.uint32))
    assert mesh.vertices.dtype == float and mesh.faces.dtype == int


def test_moving_keeps_what_was_prepared():
    mesh = box_mesh()
    assert mesh.moved(Pose([1, 0, 0]))._core is mesh._core
    assert mesh.position.tolist() == [0, 0, 0]


def dented(depth):
    return np.vstack([CORNERS, [[SIZE[0] / 2 - depth, 0, 0]]])


DENTED = [*(s for s in SIDES if s not in ([4, 6, 7], [4, 7, 5])),
          [4, 6, 8], [6, 7, 8], [7, 5, 8], [5, 4, 8]]  # fmt: skip


def test_dents_are_told_apart_from_rounding():
    mesh = ConvexMesh(dented(1e-6), DENTED)
    assert len(mesh._core.faces.offsets) == 6
    with pytest.raises(InvalidValue, match=r"vertices\[8\].*1 mm inside of its hull"):
        ConvexMesh(dented(1e-3), DENTED)


def test_a_sheet_with_coarsely_rounded_numbers_is_convex():
    # So turned, the two triangles of a side are joined along the wrong diagonal by rounding.
    turn = np.array([0.3, 0.4, 0.5, 0.7]) / np.linalg.norm([0.3, 0.4, 0.5, 0.7])
    corners = Pose([0, 0, 0], turn).points(CORNERS / SIZE * [0.1, 0.0005, 0.1]).round(5)
    lost = (
        1
        - abs(np.linalg.det(corners[SIDES] - corners[0])).sum()
        / 6
        / convex_hull("v", corners).volume
    )
    assert 0.002 < lost < 0.003
    ConvexMesh(corners, SIDES)


# A dent along an edge: two triangles of a side that is not flat, joined the wrong way round.
SADDLE = CORNERS + np.array([[0.01, 0, 0] if k == 7 else [0, 0, 0] for k in range(8)])
FOLDED = [*(s for s in SIDES if s not in ([4, 6, 7], [4, 7, 5])), [4, 6, 5], [6, 7, 5]]

BAD = {
    "few": (CORNERS[:3], [[0, 1, 2], [0, 2, 1]], "vertices", "at least 4"),
    "sheet": (CORNERS, [[0, 1, 2], [0, 2, 1]], "faces", "at least 4"),
    "flat": (CORNERS * [1, 1, 0], SIDES, "vertices", "not in one plane"),
    "thin": (CORNERS * [1, 1, 1e-7], SIDES, "vertices", "not flat"),
    "nan": ([*CORNERS[:-1].tolist(), [0, np.nan, 0]], SIDES, "vertices[7][1]", "finite"),
    "nan array": (np.full((8, 3), np.nan), SIDES, "vertices[0][0]", "finite"),
    "inf": (np.where(CORNERS > 0, np.inf, 0.0), SIDES, "vertices[1][2]", "finite"),
    "two numbers": (CORNERS[:, :2], SIDES, "vertices[0]", "3 finite numbers"),
    "text": ("cube", SIDES, "vertices", "a list of vectors"),
    "no vertices": ([], SIDES, "vertices", "at least 4"),
    "no faces": (CORNERS, [], "faces", "at least 4"),
    "index": (CORNERS, [*SIDES[:-1], [1, 7, 8]], "faces[11][2]", "0..7"),
    "negative": (CORNERS, np.array([*SIDES[:-1], [1, 7, -1]]), "faces[11][2]", "0..7"),
    "fraction": (CORNERS, [*SIDES[:-1], [1, 7, 3.0]], "faces[11][2]", "integer"),
    "square": (CORNERS, [[0, 1, 3, 2]], "faces[0]", "3 integers"),
    "twice": (CORNERS, [*SIDES[:-1], [1, 7, 7]], "faces[11]", "differ"),
    "hole": (CORNERS, SIDES[:-1], "faces", "watertight"),
    "double": (CORNERS, [*SIDES, SIDES[0]], "faces", "watertight"),
    "saddle": (SADDLE, FOLDED, "faces", "convex"),
}  # fmt: skip


@pytest.mark.parametrize(("vertices", "faces", "place", "words"), BAD.values(), ids=BAD)
def test_what_is_no_convex_mesh_is_refused(vertices, faces, place, words):
    with pytest.raises(InvalidValue, match=words) as caught:
        ConvexMesh(vertices, faces)
    assert caught.value.place == place
    assert "\n" not in str(caught.value)


def test_a_saddle_joined_the_other_way_is_convex():
    ConvexMesh(SADDLE, SIDES)


@pytest.mark.parametrize("edge", [0, -1, np.nan, SIZE[0] / 2, 1])
def test_a_rounding_that_leaves_no_core_is_refused(edge):
    with pytest.raises(InvalidValue, match=r"edge_radius.*< 0\.03"):
        box_mesh(edge_radius=edge)


def test_hulls_need_points_with_volume_and_not_too_many_faces():
    with pytest.raises(InvalidValue, match=r"points: .*not in one plane"):
        ConvexMesh.hull_of(CORNERS[:4])
    with pytest.raises(InvalidValue, match=r"points\[1\]\[0\]"):
        ConvexMesh.hull_of([[0, 0, 0], [np.inf, 0, 0]])
    cloud = np.random.default_rng(4).normal(size=(MAX_FACES, 3))
    with pytest.raises(InvalidValue, match="simplify"):
        ConvexMesh.hull_of(cloud / np.linalg.norm(cloud, axis=1)[:, None])


def test_without_scipy_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "scipy.spatial", None)
    with pytest.raises(MissingPackage, match="extra 'mesh'"):
        box_mesh()
