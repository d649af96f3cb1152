# SPDX-License-Identifier: Apache-2.0
"""Bodies to be shown: of the surface of their obstacle, as polygons and triangles, and in JSON."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
import synthetic

from ccr_ros.model import (
    Box,
    Capsule,
    ConvexMesh,
    Cylinder,
    FiniteCylinder,
    InvalidValue,
    Obstacle,
    Plane,
    Pose,
    Sphere,
)
from ccr_ros.viz.recording import Recording
from ccr_ros.viz.recording_json import recording_from_json, recording_to_json
from ccr_ros.viz.shapes import surface, triangles
from ccr_ros.viz.solids import SolidObject

BASE = Pose(np.array([0.1, 0, 0]), np.array([0, 0, np.sqrt(0.5), np.sqrt(0.5)]))
AXIS = np.array([0.6, 0.0, 0.8])
WEDGE = 0.1 * np.vstack([np.zeros((1, 3)), np.eye(3)])
FACES = list(combinations(range(4), 3))
SMALL = 1e-9  # m; a rounding that drawings, whose edges are sharp, do not show

SHAPES = {
    "sphere": Sphere([0.02, 0, 0.1], 0.03),
    "box": Box([0, 0.1, 0], [0.1, 0.2, 0.3], [0.6, 0, 0, 0.8], SMALL),
    "cylinder": FiniteCylinder([0.02, 0.01, 0.1], AXIS, 0.08, 0.03, SMALL),
    "capsule": Capsule([0, 0.1, 0], 0.06 * AXIS + [0, 0.1, 0], 0.02),
    "mesh": ConvexMesh.hull_of(WEDGE + BASE.position, edge_radius=SMALL).moved(BASE),
}


@pytest.mark.parametrize("kind", SHAPES)
def test_a_body_has_the_surface_of_its_obstacle(kind: str) -> None:
    obstacle = SHAPES[kind]
    body = SolidObject.from_obstacle(replace(obstacle, name="thing"), BASE)
    assert (body.kind, body.name) == (kind, "thing")
    there = obstacle.moved(BASE)
    corners = surface(body).vertices
    np.testing.assert_allclose(there.signed_distance(corners), 0, atol=5 * SMALL)
    # Triangles are about the same points, closed, and turned outward.
    cut = triangles(body)
    flat = body.pose.points(cut.reshape(-1, 3))
    np.testing.assert_allclose(there.signed_distance(flat), 0, atol=5 * SMALL)
    normals = np.cross(cut[:, 1] - cut[:, 0], cut[:, 2] - cut[:, 0])
    np.testing.assert_allclose(normals.sum(axis=0), 0, atol=1e-12)
    middles = cut.mean(axis=1) - cut.mean(axis=(0, 1))
    assert (np.einsum("ij,ij->i", normals, middles) > 0).all()
    volume = float(np.einsum("ij,ij->i", normals, cut[:, 0]).sum() / 6)
    assert volume == pytest.approx(VOLUMES[kind], rel=0.02)


VOLUMES = {
    "sphere": 4 / 3 * np.pi * 0.03**3,
    "box": 0.1 * 0.2 * 0.3,
    "cylinder": np.pi * 0.03**2 * 0.08,
    "capsule": np.pi * 0.02**2 * 0.06 + 4 / 3 * np.pi * 0.02**3,
    "mesh": 0.1**3 / 6,
}


def test_the_faces_of_a_mesh_are_turned_outward() -> None:
    for faces in (FACES, [face[::-1] for face in FACES]):
        cut = triangles(SolidObject("wedge", "mesh", (), BASE, WEDGE, faces))
        normals = np.cross(cut[:, 1] - cut[:, 0], cut[:, 2] - cut[:, 0])
        assert (np.einsum("ij,ij->i", normals, cut[:, 0] - WEDGE.mean(axis=0)) > 0).all()


def test_infinite_obstacles_are_shown_in_part() -> None:
    for axis in ([0, 1, 0], [1, 0, 0], [0, 0, -1], [0.6, 0, 0.8]):
        rod = SolidObject.from_obstacle(Cylinder(np.zeros(3), axis, 0.01), extent=0.2)
        assert (rod.kind, rod.dimensions) == ("cylinder", (0.2, 0.01))
        np.testing.assert_allclose(rod.pose.rotation[:, 2], axis, atol=1e-12)
        plane = SolidObject.from_obstacle(Plane(np.array([0, 0, 0.5]), axis))
        top = plane.pose.position + plane.dimensions[2] / 2 * plane.pose.rotation[:, 2]
        np.testing.assert_allclose(top, [0, 0, 0.5], atol=1e-12)


class Blob(Obstacle):
    signed_distance = derivatives = moved = None  # type: ignore[assignment]


def test_what_cannot_be_shown_is_told() -> None:
    with pytest.raises(InvalidValue, match="Blob"):
        SolidObject.from_obstacle(Blob())


@pytest.mark.parametrize(
    ("values", "place"),
    [
        ({"kind": "cone", "dimensions": (1.0,)}, "kind"),
        ({"kind": "cylinder", "dimensions": (1.0, -0.1)}, "dimensions.radius"),
        ({"kind": "capsule", "dimensions": (0.0, 0.1)}, "dimensions.length"),
        ({"kind": "mesh", "dimensions": (0.1,)}, "dimensions"),
        ({"kind": "mesh", "dimensions": ()}, "vertices"),
        ({"kind": "mesh", "dimensions": (), "vertices": WEDGE}, "faces"),
        ({"kind": "mesh", "dimensions": (), "vertices": WEDGE, "faces": []}, "faces"),
        (
            {"kind": "mesh", "dimensions": (), "vertices": WEDGE, "faces": [[0, 1, 4]]},
            "faces[0][2]",
        ),
        (
            {"kind": "mesh", "dimensions": (), "vertices": WEDGE * np.nan, "faces": FACES},
            "vertices[0][0]",
        ),
        ({"kind": "sphere", "dimensions": (0.1,), "vertices": WEDGE}, "vertices"),
    ],
)
def test_bad_bodies_are_refused(values: dict, place: str) -> None:
    with pytest.raises(InvalidValue) as caught:
        SolidObject("thing", **values)
    assert caught.value.place == place


def test_bodies_of_the_same_shape_are_known() -> None:
    mesh = SolidObject("wedge", "mesh", (), BASE, WEDGE, FACES)
    assert mesh.shape == replace(mesh, name="other", pose=Pose(), vertices=WEDGE.copy()).shape
    assert mesh.shape != replace(mesh, vertices=2 * WEDGE).shape
    assert mesh.shape != replace(mesh, faces=FACES[::-1]).shape
    ball = SolidObject("ball", "sphere", (0.1,))
    assert ball.shape == replace(ball, pose=BASE).shape != replace(ball, dimensions=(0.2,)).shape


def showing(*bodies: SolidObject) -> Recording:
    recording = synthetic.recording(0.4, 5.0)
    frames = tuple(replace(frame, objects=None) for frame in recording.frames)
    return replace(recording, objects=bodies, frames=frames)


def test_recordings_keep_capsules_and_meshes() -> None:
    bodies = [SolidObject.from_obstacle(replace(o, name=k)) for k, o in SHAPES.items()]
    back = recording_from_json(recording_to_json(showing(*bodies)))
    for one, other in zip(bodies, back.objects, strict=True):
        assert (one.name, one.kind) == (other.name, other.kind)
        np.testing.assert_allclose(surface(one).vertices, surface(other).vertices, atol=2e-6)
    assert back.objects[-1].faces is not None


def test_a_recording_of_a_mesh_without_vertices_is_refused() -> None:
    text = recording_to_json(showing(SolidObject("wedge", "mesh", (), BASE, WEDGE, FACES)))
    with pytest.raises(InvalidValue, match=r"objects\[0\]\.vertices"):
        recording_from_json(text.replace('"vertices"', '"corners"'))
