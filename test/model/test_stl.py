# SPDX-License-Identifier: Apache-2.0
"""STL files as CAD programs write them, and as they should not be."""

import struct
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ccr_ros.model import Box, CcrError, ConvexMesh, InvalidFile, InvalidValue
from ccr_ros.model.errors import MissingPackage

trimesh = pytest.importorskip("trimesh")

SIZE = np.array([0.06, 0.08, 0.10])


def box_mesh(size=1e3 * SIZE):
    mesh = trimesh.creation.box(size)
    mesh.apply_translation([5.0, 0.0, 0.0])
    return mesh


@pytest.fixture
def stl(tmp_path):
    """Return a function that writes a trimesh or bytes as an STL file."""

    def write(content, name="thing.stl", text=False):
        path = tmp_path / name
        if isinstance(content, bytes):
            path.write_bytes(content)
        else:
            content.export(path, file_type="stl_ascii" if text else "stl")
        return path

    return write


@pytest.mark.parametrize("text", [False, True], ids=["binary", "text"])
def test_a_box_in_millimetres(stl, text):
    mesh = ConvexMesh.from_stl(stl(box_mesh(), text=text), 0.001, edge_radius=0.004)
    box = Box([0.005, 0, 0], SIZE, edge_radius=0.004)
    points = np.random.default_rng(0).uniform(-0.1, 0.1, (200, 3))
    np.testing.assert_allclose(mesh.signed_distance(points), box.signed_distance(points), atol=1e-8)
    assert (mesh.name, len(mesh.vertices), len(mesh.faces)) == ("thing", 8, 12)
    centred = ConvexMesh.from_stl(stl(box_mesh(), text=text), 0.001, centred=True, name="box")
    np.testing.assert_allclose(centred.vertices, mesh.vertices - [0.005, 0, 0], atol=1e-8)
    assert centred.name == "box"


def test_a_text_may_bear_a_name_in_an_older_encoding(stl):
    text = stl(box_mesh(), text=True).read_bytes().split(b"\n", 1)[1]
    mesh = ConvexMesh.from_stl(stl("solid W\u00fcrfel\n".encode("latin-1") + text), 0.001)
    assert len(mesh.vertices) == 8


def test_a_turned_body_of_many_triangles_has_distances_like_trimesh(stl):
    ball = trimesh.creation.icosphere(subdivisions=2, radius=40)
    ball.apply_transform(trimesh.transformations.rotation_matrix(0.7, [1, 2, 3]))
    mesh = ConvexMesh.from_stl(stl(ball), 0.001, edge_radius=1e-7)
    directions = np.random.default_rng(1).normal(size=(100, 3))
    points = 0.06 * directions / np.linalg.norm(directions, axis=1)[:, None]
    triangles = mesh.vertices[mesh.faces]
    for point, distance in zip(points, mesh.signed_distance(points), strict=True):
        there = np.tile(point, (len(triangles), 1))
        nearest = trimesh.triangles.closest_point(triangles, there)
        brute = np.linalg.norm(nearest - point, axis=1).min()
        assert distance == pytest.approx(brute, abs=1e-7)


@pytest.mark.parametrize(
    ("scale", "hint"),
    [
        (1.0, "100 m; it looks like millimetres: scale 0.001"),
        (1e-6, "0.0001 m; it looks like metres: scale 0.001"),
        (1e-9, "1e-07 m"),
        (100.0, "1e+04 m"),
    ],
)
def test_sizes_that_cannot_be_meant_are_told(stl, scale, hint):
    with pytest.raises(InvalidValue, match=r"thing\.stl: scale: .*1 mm to 2 m long") as caught:
        ConvexMesh.from_stl(stl(box_mesh()), scale)
    assert hint in str(caught.value)
    if scale in (1e-9, 100.0):
        assert "looks like" not in str(caught.value)


@pytest.mark.parametrize("scale", [0, -1, np.nan, np.inf, "mm", None])
def test_a_scale_is_a_positive_number(stl, scale):
    with pytest.raises(InvalidValue, match="scale"):
        ConvexMesh.from_stl(stl(box_mesh()), scale)


def test_open_and_hollow_meshes_are_refused_unless_their_hull_is_wanted(stl):
    opened = box_mesh()
    opened.update_faces(np.arange(12) != 3)
    path = stl(opened)
    with pytest.raises(InvalidValue, match=r"thing\.stl: faces: .*watertight"):
        ConvexMesh.from_stl(path, 0.001)
    mesh = ConvexMesh.from_stl(path, 0.001, hull=True, edge_radius=0.004)
    box = Box([0.005, 0, 0], SIZE, edge_radius=0.004)
    points = np.random.default_rng(0).uniform(-0.1, 0.1, (200, 3))
    np.testing.assert_allclose(mesh.signed_distance(points), box.signed_distance(points), atol=1e-8)
    ring = stl(trimesh.creation.annulus(10, 30, 20), "ring.stl")
    with pytest.raises(InvalidValue, match=r"ring\.stl: .*convex"):
        ConvexMesh.from_stl(ring, 0.001)
    disk = ConvexMesh.from_stl(ring, 0.001, hull=True)
    np.testing.assert_allclose(disk.signed_distance(np.zeros((1, 3))), -0.01, atol=1e-8)


def test_other_bad_meshes_name_the_file(stl):
    flat = box_mesh([60, 80, 1e-3])
    for content, words in [(flat, "flat"), (two_boxes(), "convex")]:
        with pytest.raises(InvalidValue, match=rf"thing\.stl: .*{words}"):
            ConvexMesh.from_stl(stl(content), 0.001)
    with pytest.raises(InvalidValue, match=r"thing\.stl: edge_radius"):
        ConvexMesh.from_stl(stl(box_mesh()), 0.001, edge_radius=0.05)


def two_boxes():
    other = box_mesh()
    other.apply_translation([200, 0, 0])
    return trimesh.util.concatenate([box_mesh(), other])


def binary(count, records, header=b"\0" * 80):
    return header + struct.pack("<I", count) + records


RECORD = struct.pack("<12fH", *range(12), 0)
MALFORMED = {
    "empty": b"",
    "short": b"\0" * 20,
    "header alone": binary(0, b""),
    "cut off": binary(12, RECORD),
    "too long": binary(1, RECORD * 3),
    "huge count": binary(2**32 - 1, RECORD),
    "text": b"hello, world\n" * 20,
    "solid alone": b"solid thing\nendsolid thing\n",
    "text cut off": b"solid thing\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0",
    "text with words": b"solid thing\n facet normal 0 0 1\n  outer loop\n   vertex a b c\n"
    b"   vertex 1 0 0\n   vertex 0 1 0\n  endloop\n endfacet\nendsolid thing\n",
    "html": b"<!DOCTYPE html><html><body>404 not found</body></html>",
    "zip": b"PK\x03\x04" + bytes(range(256)) * 4,
    "not utf-8": b"solid \xff\xfe\nfacet normal 0 0 \xff\n",
}


@pytest.mark.parametrize("content", MALFORMED.values(), ids=MALFORMED)
def test_what_is_no_stl_is_told(stl, content):
    with pytest.raises(InvalidFile, match=r"thing\.stl: .*STL file") as caught:
        ConvexMesh.from_stl(stl(content), 0.001)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 500


def test_numbers_that_are_not_finite_are_told(stl):
    records = np.frombuffer(stl(box_mesh()).read_bytes()[84:], np.uint8).copy().reshape(12, 50)
    for bad in (np.nan, np.inf):
        records[3, 16:20] = np.frombuffer(np.float32(bad).tobytes(), np.uint8)
        with pytest.raises(CcrError, match=r"thing\.stl: "):
            ConvexMesh.from_stl(stl(binary(12, records.tobytes())), 0.001)


@settings(derandomize=True, max_examples=60, deadline=None)
@given(st.binary(max_size=300), st.booleans())
def test_whatever_a_file_holds_is_taken_or_refused_in_one_line(tmp_path_factory, content, solid):
    path = tmp_path_factory.getbasetemp() / "any.stl"
    path.write_bytes(b"solid " * solid + content)
    with pytest.raises(CcrError) as caught:
        ConvexMesh.from_stl(path, 0.001)
    assert "\n" not in str(caught.value)


def test_files_that_cannot_be_read_are_told(tmp_path):
    with pytest.raises(InvalidFile, match="No such file"):
        ConvexMesh.from_stl(tmp_path / "none.stl")
    with pytest.raises(InvalidFile, match="directory"):
        ConvexMesh.from_stl(tmp_path)
    with pytest.raises(InvalidFile, match="cannot be read"):
        ConvexMesh.from_stl("a\0b.stl")


def test_without_trimesh_the_extra_is_named(stl, monkeypatch):
    path = stl(box_mesh())
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(MissingPackage, match=r"trimesh.*extra 'mesh'"):
        ConvexMesh.from_stl(path, 0.001)
