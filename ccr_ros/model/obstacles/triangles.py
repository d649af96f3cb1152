# SPDX-License-Identifier: Apache-2.0
"""Closed meshes of triangles: checks that they are closed and convex, volume, outward turn."""

from __future__ import annotations

import numpy as np

from ..errors import InvalidValue
from .polytope import Hull

_DENT = 1e-4  # of the size: how far the rounded numbers of an STL file may be off


def check_watertight(faces: np.ndarray) -> None:
    """Check that every edge of triangles (F, 3) belongs to two of them.

    Raises:
        InvalidValue: One does not, or a triangle has a corner twice.
    """
    for i in np.flatnonzero((faces == np.roll(faces, 1, axis=1)).any(axis=1)):
        raise InvalidValue(f"faces[{i}]", faces[i], "three corners that differ")
    edges = np.sort(np.concatenate([faces, np.roll(faces, -1, axis=1)]).reshape(2, -1).T, axis=1)
    edges, counts = np.unique(edges, axis=0, return_counts=True)
    for k in np.flatnonzero(counts != 2):
        a, b = edges[k]
        given = f"the edge of the vertices {a} and {b}, in {counts[k]} faces"
        raise InvalidValue("faces", given, "watertight: every edge in two faces")


def mass_center(vertices: np.ndarray, faces: np.ndarray) -> tuple[float, np.ndarray]:
    """Return volume [m^3] and centre of mass (3,) [m] of a convex mesh, however its faces turn."""
    inside = vertices[np.unique(faces)].mean(axis=0)
    corners = vertices[faces] - inside
    parts = np.abs(np.linalg.det(corners)) / 6
    volume = float(parts.sum())
    if not volume > 0:
        return 0.0, inside
    return volume, inside + parts @ corners.sum(axis=1) / (4 * volume)


def check_convex(vertices: np.ndarray, faces: np.ndarray, hull: Hull, volume: float) -> None:
    """Check that a closed mesh of this volume [m^3] is as good as its convex hull.

    Raises:
        InvalidValue: It is not; says which vertex is inside the hull, or how much volume lacks.
    """
    used = np.unique(faces)
    size = float(np.ptp(vertices[used], axis=0).max())
    depth = hull.planes.depth(vertices[used])
    worst = int(np.argmax(depth))
    allowed = "convex (a mesh's convex hull is taken only if asked for)"
    dent = _DENT * size
    if depth[worst] > dent:
        k = int(used[worst])
        given = f"a mesh whose vertex {k} is {depth[worst] * 1e3:.3g} mm inside of its hull"
        raise InvalidValue(f"vertices[{k}]", given, allowed)
    if abs(volume - hull.volume) > dent * hull.area:
        given = f"a mesh that fills {volume / hull.volume:.1%} of its hull"
        raise InvalidValue("faces", given, allowed)


def turned_outward(vertices: np.ndarray, faces: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Return a convex mesh's triangles, counter-clockwise as seen from outside."""
    inward = np.linalg.det(vertices[faces] - inside) < 0
    turned = faces.copy()
    turned[inward, 1:] = faces[inward, :0:-1]
    return turned
