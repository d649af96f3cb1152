# SPDX-License-Identifier: Apache-2.0
"""The printable solid: closed, of the right volume and size, with the holes where they belong."""

from __future__ import annotations

import math
import sys
from dataclasses import replace

import numpy as np
import pytest
from model.fingers import make_finger, straight_cable

from ccr_ros.design.parts import FingerParts, PrintOptions, finger_parts
from ccr_ros.design.solid import Solid, finger_solid, write_stl
from ccr_ros.model import InvalidFile, load_finger
from ccr_ros.model.errors import MissingPackage
from ccr_ros.resources import find_config

pytest.importorskip("manifold3d", reason="manifold3d, of the extra 'print', is not installed")
trimesh = pytest.importorskip("trimesh", reason="trimesh, of the extra 'print', is not installed")

STRAIGHT = make_finger(straight_cable(4))
BENT = load_finger(find_config("sphere_finger"))
TWISTED = replace(
    load_finger(find_config("helical")),
    rest_curvature=np.tile([6.0, -4.0, 9.0], (9, 1)),
)
PLATE = PrintOptions(plate_diameter=0.05, plate_thickness=0.003)


@pytest.fixture(scope="module")
def bent() -> tuple[FingerParts, Solid]:
    parts = finger_parts(BENT)
    return parts, finger_solid(parts)


def crossings(solid: Solid, start: np.ndarray, end: np.ndarray) -> int:
    """How often a line [mm] from start to end crosses the surface (Moeller and Trumbore)."""
    a, b, c = (solid.vertices[solid.triangles[:, k]] for k in range(3))
    way = end - start
    h = np.cross(way, c - a)
    determinant = np.einsum("ij,ij->i", b - a, h)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = start - a
        u = np.einsum("ij,ij->i", s, h) / determinant
        q = np.cross(s, b - a)
        v = q @ way / determinant
        t = np.einsum("ij,ij->i", c - a, q) / determinant
        return int(np.sum((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (t < 1)))


def part_near(solid: Solid, point: np.ndarray) -> Solid:
    """The triangles near a disk's centre [mm]."""
    corners = solid.vertices[solid.triangles]
    near = np.linalg.norm(corners - point, axis=2).min(axis=1) < 11
    return replace(solid, triangles=solid.triangles[near])


@pytest.mark.parametrize("finger", [STRAIGHT, BENT, TWISTED], ids=["straight", "bent", "twisted"])
def test_it_is_watertight_also_as_a_file(finger, tmp_path):
    solid = finger_solid(finger_parts(finger, PLATE))
    mesh = trimesh.load(write_stl(solid, tmp_path / "f.stl"))
    assert mesh.is_watertight and mesh.is_winding_consistent and mesh.is_volume
    assert mesh.body_count == 1
    assert mesh.volume == pytest.approx(solid.volume, rel=1e-5)
    holes = 10 * 12
    assert mesh.euler_number == 2 - 2 * holes  # every hole is a handle


def polygon(corners: int, radius: float, outside: bool = False) -> float:
    """Area of a regular polygon inside, or outside, of a circle."""
    half = math.pi / corners
    return corners * radius**2 * (math.tan(half) if outside else math.sin(2 * half) / 2)


def test_volume_of_a_straight_finger():
    solid = finger_solid(finger_parts(STRAIGHT, PLATE))
    disk = polygon(96, 9.25) - 12 * polygon(32, 0.625, outside=True)
    plate = polygon(96, 25) - 12 * polygon(32, 0.625, outside=True)
    rod = polygon(48, 1.25)
    # Inside the disks there is no rod of its own: the first and last are entered by half.
    volume = 9 * disk * 2 + disk * 1 + plate * 4 + rod * (182 - 8 * 2 - 1 - 1)
    assert solid.volume == pytest.approx(volume, rel=1e-9)
    # The polygons are as good as circles.
    circles = math.pi * (9.25**2 - 12 * 0.625**2) * 19 + math.pi * (25**2 - 12 * 0.625**2) * 4
    assert volume == pytest.approx(circles + math.pi * 1.25**2 * 164, rel=2e-3)


def test_bending_keeps_the_volume(bent):
    _, solid = bent
    # Pappus: a rod's volume is its section times its length, however it is bent.
    straight = finger_solid(finger_parts(replace(BENT, rest_curvature=None)))
    assert solid.volume == pytest.approx(straight.volume, rel=1e-4)


def test_holes_are_open_where_cables_run_and_closed_beside(bent):
    parts, solid = bent
    near = [part_near(solid, 1e3 * parts.centers[at]) for at in parts.disks]
    aside = np.array([0.013, 0.007, 0.0])  # off the corners of the mesh
    for hole in parts.holes:
        disk = near[hole.disk]
        center, axis = parts.hole_axis(hole)
        frame = parts.frames[parts.disks[hole.disk]]
        middle = 1e3 * center + frame @ aside
        way = 1.2 * axis  # the disk is 2 mm thick
        assert crossings(disk, middle - way, middle + way) == 0
        for angle in (0.3, 2.4, 4.5):
            inside = 0.59 * (frame @ [math.cos(angle), math.sin(angle), 0])
            assert crossings(disk, middle + inside - way, middle + inside + way) == 0
            beside = 0.66 * (frame @ [math.cos(angle), math.sin(angle), 0])
            assert crossings(disk, middle + beside - way, middle + beside + way) == 2


def test_disks_are_where_the_rest_shape_has_them(bent):
    parts, solid = bent
    for at in parts.disks:
        center, frame = 1e3 * parts.centers[at], parts.frames[at]
        for angle in np.radians([14.0, 127.0, 255.0]):
            out = frame @ [math.cos(angle), math.sin(angle), 0]
            normal = frame[:, 2]
            rim = center + 9.2 * out
            assert crossings(solid, rim, rim + 0.1 * out) == 1
            flat = center + 5 * out  # between the rod and the holes
            assert crossings(solid, flat, flat + 0.99 * normal) == 0
            assert crossings(solid, flat, flat + 1.01 * normal) == 1
            assert crossings(solid, flat, flat - 1.01 * normal) == 1


def test_size_of_a_straight_finger_with_a_plate():
    solid = finger_solid(finger_parts(STRAIGHT, PLATE))
    low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    assert np.allclose(low, [-25, -25, -4]) and np.allclose(high, [25, 25, 183])
    thick = PrintOptions(disk_thickness=0.003, outer_radius=0.012, routed_only=True)
    bare = finger_solid(finger_parts(STRAIGHT, thick))
    assert np.allclose(bare.vertices.min(axis=0), [-12, -12, -1.5])
    assert np.allclose(bare.vertices.max(axis=0), [12, 12, 183.5])


def test_refused(bent, tmp_path, monkeypatch):
    parts, solid = bent
    with pytest.raises(InvalidFile, match="cannot be written"):
        write_stl(solid, tmp_path / "none" / "f.stl")
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(MissingPackage, match="needs trimesh"):
        write_stl(solid, tmp_path / "f.stl")
    monkeypatch.setitem(sys.modules, "manifold3d", None)
    with pytest.raises(MissingPackage, match=r"needs manifold3d.*extra 'print'"):
        finger_solid(parts)
