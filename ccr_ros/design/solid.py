# SPDX-License-Identifier: Apache-2.0
"""A finger's parts as one printable solid: a watertight mesh, and its STL file.

Manifold (manifold3d) makes it: its booleans give a manifold mesh for any input. Millimetres, as
slicers take STL. Circles are polygons inside the rims and outside the holes, so that a rim is
never larger and a hole never smaller than wanted.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.errors import InvalidFile, MissingPackage
from .parts import FingerParts

if TYPE_CHECKING:
    from manifold3d import CrossSection, Manifold

_MM = 1e3
_RIM, _HOLE, _ROD = 96, 32, 48  # corners of the polygons


@dataclass(frozen=True, eq=False)
class Solid:
    """A closed surface.

    Attributes:
        vertices: (v, 3) [mm].
        triangles: (t, 3) indices of their corners, counter-clockwise from outside.
        volume: [mm^3].
    """

    vertices: np.ndarray
    triangles: np.ndarray
    volume: float


def finger_solid(parts: FingerParts) -> Solid:
    """Unite backbone, disks and base plate, and drill the holes.

    Raises:
        MissingPackage: manifold3d is not installed.
    """
    m3 = _library()
    union = m3.OpType.Add
    thickness = parts.options.disk_thickness * _MM
    blank = m3.CrossSection.circle(parts.outer_radius * _MM, _RIM)
    bodies = [_rod(m3, parts)]
    for disk in range(len(parts.disks)):
        cut = blank - _drill(m3, parts, disk)
        plate = cut.extrude(thickness).translate((0, 0, -thickness / 2))
        bodies.append(plate.transform(_placed(parts, int(parts.disks[disk]))))
    if parts.options.plate_diameter > 0:
        bodies.append(_plate(m3, parts))
    solid = m3.Manifold.batch_boolean(bodies, union)
    mesh = solid.to_mesh64()
    vertices = np.asarray(mesh.vert_properties)[:, :3].copy()
    return Solid(vertices, np.asarray(mesh.tri_verts).astype(int), float(solid.volume()))


def write_stl(solid: Solid, path: str | Path) -> Path:
    """Write a solid as binary STL, in millimetres, and return the path.

    Raises:
        MissingPackage: trimesh is not installed.
        InvalidFile: The file cannot be written.
    """
    try:
        import trimesh
    except ImportError:
        raise MissingPackage("an STL file", "trimesh", "print") from None
    mesh = trimesh.Trimesh(solid.vertices, solid.triangles, process=False)
    out = Path(path)
    try:
        mesh.export(out, file_type="stl")
    except OSError as error:
        raise InvalidFile(path, f"cannot be written: {error.strerror}") from None
    return out


def _rod(m3: Any, parts: FingerParts) -> Manifold:
    """The backbone: a round section carried along the rest shape."""
    radius = parts.finger.backbone_diameter / 2 * _MM
    last = len(parts.centers) - 1
    section = m3.CrossSection.circle(radius, _ROD)

    def along(points: np.ndarray) -> np.ndarray:
        at = np.clip(np.rint(points[:, 2]), 0, last).astype(int)
        flat = np.column_stack([points[:, :2], np.zeros(len(points))])
        return parts.centers[at] * _MM + np.einsum("kij,kj->ki", parts.frames[at], flat)

    return section.extrude(last, last - 1).warp_batch(along)


def _drill(m3: Any, parts: FingerParts, disk: int) -> CrossSection:
    """All holes of a disk, as a section to cut away."""
    radius = parts.finger.disk_radius * _MM
    bit = parts.options.hole_diameter / 2 * _MM / math.cos(math.pi / _HOLE)
    hole = m3.CrossSection.circle(bit, _HOLE)
    tools = [
        hole.translate((radius * math.cos(h.angle), radius * math.sin(h.angle)))
        for h in parts.holes
        if h.disk == disk
    ]
    return m3.CrossSection.compose(tools)


def _plate(m3: Any, parts: FingerParts) -> Manifold:
    """The base plate: from the base disk's middle plane down, with the base disk's holes."""
    below = (parts.options.plate_thickness + parts.options.disk_thickness / 2) * _MM
    section = m3.CrossSection.circle(parts.options.plate_diameter / 2 * _MM, _RIM)
    return (section - _drill(m3, parts, 0)).extrude(below).translate((0, 0, -below))


def _placed(parts: FingerParts, at: int) -> np.ndarray:
    """The pose of a disk as manifold3d takes it (3, 4) [mm]."""
    return np.column_stack([parts.frames[at], parts.centers[at] * _MM])


def _library() -> Any:
    try:
        import manifold3d
    except ImportError:
        raise MissingPackage("a solid to print", "manifold3d", "print") from None
    return manifold3d
