# SPDX-License-Identifier: Apache-2.0
"""Obstacles of finger files: read, refused with their place, and read again when written."""

import math

import numpy as np
import pytest

from ccr_ros.model import (
    Box,
    Capsule,
    ConvexMesh,
    Cylinder,
    FiniteCylinder,
    InvalidFile,
    InvalidValue,
    Plane,
    Pose,
    Sphere,
    load_finger,
    load_gripper,
)
from ccr_ros.model.errors import MissingKey, UnknownKey
from ccr_ros.model.obstacle_files import obstacle_to_dict, obstacles_from_list

trimesh = pytest.importorskip("trimesh")


def refused(entries):
    with pytest.raises(InvalidValue) as caught:
        obstacles_from_list(entries)
    assert "\n" not in str(caught.value)
    return caught.value


SPHERE = {"type": "sphere", "center": [0, 0, 1], "radius": 0.1}
CYLINDER = {"type": "cylinder", "point": [0, 0, 1], "axis": [0, 1, 0], "radius": 0.1}
BOX = {"type": "box", "center": [0, 0, 1], "size": [1, 1, 1], "orientation": [0, 0, 0, 1]}
CAPSULE = {"type": "capsule", "start": [0, 0, 1], "end": [0, 1, 1], "radius": 0.1}
CAN = {"type": "finite_cylinder", "center": [0, 0, 1], "axis": [0, 1, 0], "height": 0.3,
       "radius": 0.1}  # fmt: skip
MESH = {"type": "mesh", "vertices": [[0, 0, 1], [1, 0, 1], [0, 1, 1], [0, 0, 2]],
        "faces": [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]}  # fmt: skip
PLANE = {"type": "plane", "point": [0, 0, -1], "normal": [0, 0, 1]}
ORIENTATIONS = ([0, 0, 0, 0], [0, 0, 0, 2], [0, 0, 1], [1e200] * 4, "none", [0, 0, 0, math.nan])


@pytest.mark.parametrize(
    ("good", "key", "values"),
    [
        (SPHERE, "center", [1, [0, 0], [0, 0, 0, 0], "abc", [0, 0, None], [0, 0, 1e7]]),
        (SPHERE, "radius", [0, -1, "1", math.inf, True, 1e7]),
        (CYLINDER, "point", [1, [0, 0], [0, math.nan, 0]]),
        (CYLINDER, "axis", [[0, 0, 0], [0, 0, 1e-200], [0, 0], 3, [True, 0, 0]]),
        (CYLINDER, "radius", [0, -1]),
        (CAPSULE, "start", [1, [0, 0], [0, math.nan, 0]]),
        (CAPSULE, "end", [1, [0, 0], [0, 0, "1"], CAPSULE["start"]]),
        (CAPSULE, "radius", [0, -1, "thick"]),
        (CAN, "center", [1, [0, 0], [0, math.inf, 0]]),
        (CAN, "axis", [[0, 0, 0], [0, 0], "up"]),
        (CAN, "height", [0, -1, True]),
        (CAN, "radius", [0, -1, [1]]),
        (CAN, "edge_radius", [0, -0.1, 0.1, math.nan]),
        (MESH, "vertices", [1, [], [[0, 0]], [[0, 0, 1e7]] * 4, [[0, 0, 0]] * 4]),
        (MESH, "faces", [1, [[0, 1]], [[0, 1, 4]], [[0, 1, 2]], [[0, 1, 2.5]]]),
        (MESH, "position", [1, [0, 0]]),
        (MESH, "orientation", ORIENTATIONS),
        (MESH, "edge_radius", [0, 1, "x"]),
        (BOX, "center", [0, [0]]),
        (BOX, "size", [1, [1, 1], [1, 0, 1], [1, -1, 1], [1, 1, math.inf]]),
        (BOX, "orientation", ORIENTATIONS),
        (BOX, "edge_radius", [0, -0.1, 0.51, "x", math.nan]),
        (PLANE, "point", [[0, 0], 0, [0, 0, "0"]]),
        (PLANE, "normal", [[0, 0, 0], 1]),
    ],
)
def test_bad_obstacle_values(good, key, values):
    obstacles_from_list([good])
    for value in values:
        place = refused([SPHERE, {**good, key: value}]).place
        assert place.startswith(f"obstacles[1].{key}")


@pytest.mark.parametrize(
    "good", [SPHERE, CYLINDER, CAPSULE, CAN, BOX, PLANE], ids=lambda o: o["type"]
)
def test_obstacle_keys(good):
    for key in good:
        absent = {k: v for k, v in good.items() if k != key}
        if key == "orientation":
            obstacles_from_list([absent])
        else:
            error = refused([absent])
            assert isinstance(error, MissingKey) and error.place == f"obstacles[0].{key}"
    error = refused([{**good, "colour": "red"}])
    assert isinstance(error, UnknownKey) and error.place == "obstacles[0].colour"


@pytest.mark.parametrize("value", ["sphere", {}, SPHERE, False, 0, "", 3])
def test_obstacles_must_be_a_list(value):
    error = refused(value)
    assert (error.place, error.allowed) == ("obstacles", "a list")


@pytest.mark.parametrize("kind", ["ball", "Sphere", 3, ["sphere"], {}])
def test_obstacle_types_are_listed(kind):
    error = refused([{"type": kind}])
    assert (error.place, error.value) == ("obstacles[0].type", kind)
    assert error.allowed == "one of sphere, capsule, cylinder, finite_cylinder, box, mesh, plane"


def test_obstacle_names_are_unique_and_made_up_where_absent():
    names = [o.name for o in obstacles_from_list([SPHERE, PLANE, {**SPHERE, "name": "ball"}])]
    assert names == ["sphere_0", "plane_1", "ball"]
    clash = [{**PLANE, "name": "plane_1"}, PLANE]
    assert refused(clash).place == "obstacles[1].name"


POINTS = np.random.default_rng(0).uniform(-1, 2, (100, 3))


@pytest.mark.parametrize(
    ("entry", "cls"),
    [
        (SPHERE, Sphere),
        (CYLINDER, Cylinder),
        (CAPSULE, Capsule),
        (CAN, FiniteCylinder),
        ({**CAN, "edge_radius": 0.03}, FiniteCylinder),
        (BOX, Box),
        (PLANE, Plane),
        (MESH, ConvexMesh),
        (
            {**MESH, "position": [0.1, 0, 0], "orientation": [0, 0.6, 0, 0.8], "edge_radius": 0.1},
            ConvexMesh,
        ),
    ],
)
def test_what_is_written_is_read_again(entry, cls):
    (one,) = obstacles_from_list([entry])
    assert type(one) is cls
    (two,) = obstacles_from_list([obstacle_to_dict(one)])
    assert type(two) is cls and two.name == one.name == f"{entry['type']}_0"
    np.testing.assert_array_equal(one.signed_distance(POINTS), two.signed_distance(POINTS))


def test_a_mesh_is_placed_by_its_frame():
    plain, placed = obstacles_from_list(
        [MESH, {**MESH, "position": [0.1, 0, 0], "orientation": [0, 0.6, 0, 0.8]}]
    )
    moved = plain.moved(Pose([0.1, 0, 0], [0, 0.6, 0, 0.8]))
    np.testing.assert_allclose(
        placed.signed_distance(POINTS), moved.signed_distance(POINTS), atol=1e-12
    )


@pytest.fixture
def wedge(tmp_path):
    """An STL file of a wedge of 40 x 20 x 30 mm, in millimetres, in a folder of its own."""
    corners = [[0, 0, 0], [40, 0, 0], [0, 20, 0], [0, 0, 30]]
    folder = tmp_path / "meshes"
    folder.mkdir()
    mesh = trimesh.Trimesh(corners, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], process=False)
    mesh.export(folder / "wedge.stl")
    return folder / "wedge.stl"


FINGER = """\
name: small
length: 0.1
segments: 2
disk_radius: 0.008
backbone_diameter: 0.0025
poisson_ratio: 0.39
cables: [{name: main, holes: [1, 2, 12]}]
obstacles: [{type: mesh, file: meshes/wedge.stl, scale: 0.001, position: [0.1, 0, 0]}]
"""
GRIPPER = """\
name: hand
fingers:
  - {name: one, base: {position: [0, 0, 0]}, file: finger.yaml}
  - name: two
    base: {position: [0.5, 0, 0]}
    finger:
"""


def test_stl_files_are_found_beside_the_file_that_names_them(wedge, tmp_path, monkeypatch):
    monkeypatch.chdir("/")
    path = tmp_path / "finger.yaml"
    path.write_text(FINGER)
    (mesh,) = load_finger(path).obstacles
    corner = np.array([[0.1, 0.005, 0.005]])
    np.testing.assert_allclose(mesh.signed_distance(corner), 0, atol=1e-9)
    inline = "".join(f"      {line}\n" for line in FINGER.splitlines()[1:])
    (tmp_path / "hand.yaml").write_text(GRIPPER + inline)
    for finger in load_gripper(tmp_path / "hand.yaml").fingers:
        np.testing.assert_allclose(finger.finger.obstacles[0].signed_distance(corner), 0, atol=1e-9)
    path.write_text(FINGER.replace("scale: 0.001, ", ""))
    with pytest.raises(
        InvalidValue, match=r"meshes/wedge\.stl: scale: .*millimetres: scale 0\.001"
    ):
        load_finger(path)
    wedge.unlink()
    with pytest.raises(InvalidFile, match=r"wedge\.stl: cannot be read.*obstacles\[0\]\.file"):
        load_finger(path)


def test_stl_files_with_all_their_options(wedge):
    entry = {"type": "mesh", "file": str(wedge), "scale": 0.001, "hull": True, "centred": True,
             "edge_radius": 0.001, "position": [0, 0, 1], "name": "thing"}  # fmt: skip
    (mesh,) = obstacles_from_list([entry])
    assert (mesh.name, mesh.edge_radius, mesh.position.tolist()) == ("thing", 0.001, [0, 0, 1])
    np.testing.assert_allclose(mesh.centroid, 0, atol=1e-9)
    assert obstacles_from_list([{**entry, "name": None}])[0].name == "mesh_0"


@pytest.mark.parametrize(
    ("change", "place"),
    [
        ({"file": 3}, "obstacles[0].file"),
        ({"scale": -1}, "obstacles[0].scale"),
        ({"hull": "yes"}, "obstacles[0].hull"),
        ({"centred": 1}, "obstacles[0].centred"),
        ({"position": [0, 0]}, "obstacles[0].position"),
        ({"edge_radius": -1}, "edge_radius"),
        ({"scale": 1.0}, "scale"),
        ({"vertices": []}, "obstacles[0]"),
        ({"file": None}, "obstacles[0].file"),
        ({"size": 3}, "obstacles[0].size"),
    ],
)
def test_bad_stl_entries_are_refused(wedge, change, place):
    entry = {"type": "mesh", "file": str(wedge), "scale": 0.001}
    assert refused([{**entry, **change}]).place == place


def test_a_mesh_needs_a_file_or_vertices():
    assert refused([{"type": "mesh"}]).place == "obstacles[0]"
    faces = {key: MESH[key] for key in ("type", "faces")}
    assert "'file' or 'vertices'" in str(refused([faces]))
    vertices = {key: MESH[key] for key in ("type", "vertices")}
    assert isinstance(refused([vertices]), MissingKey)
    assert isinstance(refused([{**MESH, "scale": 1}]), UnknownKey)
