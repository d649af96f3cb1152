# SPDX-License-Identifier: Apache-2.0
"""Surfaces of obstacles and objects as polygons, for drawing; lengths in metres."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..model.obstacles import Obstacle
from ..model.rotation import Pose
from .solids import SolidObject

_AROUND = 64  # corners of a circle
_RINGS = 7  # of each half ball of a capsule


@dataclass(frozen=True, eq=False)
class Surface:
    """A convex body's surface: faces, each a polygon (k, 3)."""

    faces: tuple[np.ndarray, ...]

    @property
    def vertices(self) -> np.ndarray:
        """All corners (v, 3); some of them appear in more than one face."""
        return np.vstack(self.faces)

    def outline(self, axes: tuple[int, int]) -> np.ndarray:
        """Return the silhouette (k, 2) seen along the remaining axis."""
        return hull(self.vertices[:, list(axes)])


def obstacle_surface(obstacle: Obstacle, center: np.ndarray, extent: float) -> Surface:
    """Return the surface of an obstacle; of an infinite one, the part about ``center``.

    Args:
        obstacle: The obstacle.
        center: (3,) what the drawing is about [m].
        extent: Length of an infinite cylinder's part, side of a plane's [m].
    """
    body = SolidObject.from_obstacle(obstacle, extent=extent)
    along = body.pose.rotation[:, 2]
    offset = np.asarray(center) - body.pose.position
    name = type(obstacle).__name__
    if name == "Cylinder":  # slides along its axis, and a plane within itself
        shift = along * (offset @ along)
    elif name == "Plane":
        shift = offset - along * (offset @ along)
    else:
        shift = np.zeros(3)
    pose = Pose(body.pose.position + shift, body.pose.orientation)
    return surface(replace(body, pose=pose))


def surface(body: SolidObject) -> Surface:
    """Return the surface of a body, in the frame its pose is given in."""
    turn = body.pose.rotation.T
    return Surface(tuple(face @ turn + body.pose.position for face in _faces(body)))


def triangles(body: SolidObject) -> np.ndarray:
    """Return a body's surface in its own frame as triangles (t, 3, 3), outside counter-clockwise.

    Faces are convex, and cut into fans.
    """
    if body.vertices is not None and body.faces is not None:
        return body.vertices[body.faces]
    cut = [
        np.stack([np.tile(face[0], (len(face) - 2, 1)), face[1:-1], face[2:]], axis=1)
        for face in _faces(body)
    ]
    found = np.concatenate(cut)
    normals = np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0])
    inward = np.einsum("ij,ij->i", normals, found.mean(axis=1)) < 0  # the body is around 0
    found[inward] = found[inward][:, ::-1]
    return found[np.linalg.norm(normals, axis=1) > 0]  # fans about a pole have some of no area


def _faces(body: SolidObject) -> list[np.ndarray]:
    if body.vertices is not None and body.faces is not None:
        return list(body.vertices[body.faces])
    makers: dict[str, Callable[..., list[np.ndarray]]]
    makers = {"sphere": _sphere, "box": _box, "cylinder": _cylinder, "capsule": _capsule}
    return makers[body.kind](*body.dimensions)


def hull(points: np.ndarray) -> np.ndarray:
    """Return the convex hull (k, 2) of points (p, 2), counter-clockwise (Andrew's chains)."""
    ordered = sorted({(float(x), float(y)) for x, y in np.round(points, 9)})
    if len(ordered) < 3:
        return np.array(ordered)

    def chain(run: list[tuple[float, float]]) -> list[tuple[float, float]]:
        out: list[tuple[float, float]] = []
        for x, y in run:
            while len(out) > 1:
                (x0, y0), (x1, y1) = out[-2:]
                if (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0) > 0:
                    break
                out.pop()
            out.append((x, y))
        return out[:-1]

    return np.array(chain(ordered) + chain(ordered[::-1]))


def circle(center: np.ndarray, x_axis: np.ndarray, y_axis: np.ndarray, radius: float) -> np.ndarray:
    """Return a closed circle (k, 3) in the plane of two unit vectors."""
    a = np.linspace(0, 2 * np.pi, _AROUND + 1)
    return center + radius * (np.cos(a)[:, None] * x_axis + np.sin(a)[:, None] * y_axis)


def smooth(points: np.ndarray, tangents: np.ndarray, pieces: int = 4) -> np.ndarray:
    """Return a curve through disk centres (n+1, 3) along unit tangents there (cubic Hermite)."""
    t = np.linspace(0, 1, pieces, endpoint=False)[:, None]
    parts = []
    for a, b, u, v in zip(points[:-1], points[1:], tangents[:-1], tangents[1:], strict=True):
        span = float(np.linalg.norm(b - a))
        h = (2 * t**3 - 3 * t**2 + 1, 3 * t**2 - 2 * t**3, t**3 - 2 * t**2 + t, t**3 - t**2)
        parts.append(h[0] * a + h[1] * b + span * (h[2] * u + h[3] * v))
    return np.vstack([*parts, points[-1:]])


def _sphere(radius: float) -> list[np.ndarray]:
    lat = np.linspace(-np.pi / 2, np.pi / 2, _AROUND // 2 + 1)
    lon = np.linspace(0, 2 * np.pi, _AROUND + 1)
    x = np.cos(lat)[:, None] * np.cos(lon)
    y = np.cos(lat)[:, None] * np.sin(lon)
    z = np.repeat(np.sin(lat)[:, None], len(lon), axis=1)
    return _quads(radius * np.stack([x, y, z], axis=-1))


def _cylinder(height: float, radius: float) -> list[np.ndarray]:
    ring = circle(np.zeros(3), np.eye(3)[0], np.eye(3)[1], radius)
    up = np.array([0.0, 0.0, height / 2])
    return [*_quads(np.stack([ring - up, ring + up])), (ring - up)[:-1], (ring + up)[:-1]]


def _capsule(length: float, radius: float) -> list[np.ndarray]:
    rise = np.linspace(0, np.pi / 2, _RINGS)
    heights = length / 2 + radius * np.sin(rise)
    around = np.linspace(0, 2 * np.pi, 4 * _RINGS + 1)
    wide = radius * np.concatenate([np.cos(rise)[::-1], np.cos(rise)])[:, None]
    high = np.concatenate([-heights[::-1], heights])[:, None]
    grid = [wide * np.cos(around), wide * np.sin(around), np.repeat(high, len(around), axis=1)]
    return _quads(np.stack(grid, axis=-1))


def _box(x: float, y: float, z: float) -> list[np.ndarray]:
    faces = []
    for axis in range(3):
        a, b = [k for k in range(3) if k != axis]
        for side in (-0.5, 0.5):
            face = np.full((4, 3), side)
            face[:, a], face[:, b] = (-0.5, 0.5, 0.5, -0.5), (-0.5, -0.5, 0.5, 0.5)
            faces.append(face * (x, y, z))
    return faces


def _quads(grid: np.ndarray) -> list[np.ndarray]:
    """Faces of a grid of points (r, c, 3)."""
    return [
        np.array([grid[i, j], grid[i + 1, j], grid[i + 1, j + 1], grid[i, j + 1]])
        for i in range(len(grid) - 1)
        for j in range(grid.shape[1] - 1)
    ]
