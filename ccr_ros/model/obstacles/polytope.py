# SPDX-License-Identifier: Apache-2.0
"""Convex polyhedra: flat faces out of points, faces moved inwards, and distances to them.

Qhull (scipy) makes hulls and intersects half-spaces. The nearest point of a convex polyhedron to a
point outside lies in a face where the point's foot is within the face's walls (half-planes through
its edges, at right angles to it), and else on the nearest edge, which may be at its end.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InvalidValue, MissingPackage

MAX_FACES = 2000  # flat ones; a disk's distance takes time in proportion
FLAT = 1e-6  # of the size: triangles that are flat to this are one face
_SAME = 1e-10  # of the size: corners closer than this are one
_CHUNK = 200_000  # pairs of points and edges in memory at once
_TINY = 1e-15  # m; outside of all faces by rounding alone


@dataclass(frozen=True, eq=False)
class HalfSpaces:
    """The points x with normals x <= offsets: unit normals (F, 3), offsets (F,) [m]."""

    normals: np.ndarray
    offsets: np.ndarray

    def depth(self, points: np.ndarray) -> np.ndarray:
        """Return how far points (P, 3) are inside the nearest plane (P,) [m]."""
        return (self.offsets - points @ self.normals.T).min(axis=1)


@dataclass(frozen=True, eq=False)
class Nearest:
    """Points against a polyhedron.

    Attributes:
        distance: (P,) signed, positive outside [m].
        normals: (P, 3) unit gradients.
        hessians: (P, 3, 3) [1/m].
    """

    distance: np.ndarray
    normals: np.ndarray
    hessians: np.ndarray


@dataclass(frozen=True, eq=False)
class Polytope:
    """A bounded convex polyhedron, ready for distances.

    Attributes:
        faces: Its planes, one per face.
        walls: (H, 3), wall_offsets: (H,) half-planes through the faces' edges, face by face.
        first_wall: (F,) where each face's begin.
        tails: (E, 3), directions: (E, 3), lengths: (E,) of its edges.
    """

    faces: HalfSpaces
    walls: np.ndarray
    wall_offsets: np.ndarray
    first_wall: np.ndarray
    tails: np.ndarray
    directions: np.ndarray
    lengths: np.ndarray

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return the signed distance (P,) of points (P, 3) [m]."""
        return self.nearest(points).distance

    def nearest(self, points: np.ndarray) -> Nearest:
        """Return distances of points (P, 3) with their derivatives."""
        points = np.asarray(points, dtype=float)
        many = max(1, _CHUNK // max(len(self.tails), 1))
        if len(points) <= many:
            return self._nearest(points)
        parts = [self._nearest(points[i : i + many]) for i in range(0, len(points), many)]
        return Nearest(
            np.concatenate([p.distance for p in parts]),
            np.concatenate([p.normals for p in parts]),
            np.concatenate([p.hessians for p in parts]),
        )

    def _nearest(self, points: np.ndarray) -> Nearest:
        over = points @ self.faces.normals.T - self.faces.offsets
        face = over.argmax(axis=1) if len(points) else np.zeros(0, int)
        distance = over[np.arange(len(points)), face]
        normals = self.faces.normals[face].copy()
        hessians = np.zeros((len(points), 3, 3))
        outside = np.flatnonzero(distance > _TINY)
        if len(outside):
            beyond = points[outside] @ self.walls.T - self.wall_offsets
            above = np.maximum.reduceat(beyond, self.first_wall, axis=1) <= 0
            over = np.where(above & (over[outside] > 0), over[outside], -np.inf)
            face = over.argmax(axis=1)
            height = over[np.arange(len(outside)), face]
            at_face = height > 0
            distance[outside[at_face]] = height[at_face]
            normals[outside[at_face]] = self.faces.normals[face[at_face]]
            self._edges(points, outside[~at_face], distance, normals, hessians)
        return Nearest(distance, normals, hessians)

    def _edges(
        self,
        points: np.ndarray,
        which: np.ndarray,
        distance: np.ndarray,
        normals: np.ndarray,
        hessians: np.ndarray,
    ) -> None:
        """Fill in the points whose nearest point is on an edge or a corner."""
        here = points[which]
        along = here @ self.directions.T - np.einsum("ej,ej->e", self.tails, self.directions)
        stop = np.clip(along, 0.0, self.lengths)
        square = stop * (stop - 2 * along) - 2 * here @ self.tails.T
        square += np.einsum("ej,ej->e", self.tails, self.tails)  # less that of the point itself
        edge = square.argmin(axis=1) if len(which) else np.zeros(0, int)
        # Which edge it is bears rounding; where on it, and how far, is calculated without loss.
        ways = self.directions[edge]
        offset = here - self.tails[edge]
        along = np.einsum("ej,ej->e", offset, ways)
        stop = np.clip(along, 0.0, self.lengths[edge])
        offset -= stop[:, None] * ways
        gap = np.linalg.norm(offset, axis=1)
        solid = gap > _TINY
        which, gap = which[solid], gap[solid]
        normal = offset[solid] / gap[:, None]
        within = (along == stop)[solid, None]
        direction = np.where(within, ways[solid], 0.0)  # a corner is round both ways
        distance[which], normals[which] = gap, normal
        hessians[which] = (
            np.eye(3)
            - normal[:, :, None] * normal[:, None, :]
            - direction[:, :, None] * direction[:, None, :]
        ) / gap[:, None, None]


@dataclass(frozen=True, eq=False)
class Hull:
    """The convex hull of points.

    Attributes:
        planes: Its faces, flat ones as one; all points are inside.
        triangles: (T, 3) numbers of the points at the corners of its surface's triangles.
        volume: [m^3].
        area: Of its surface [m^2].
    """

    planes: HalfSpaces
    triangles: np.ndarray
    volume: float
    area: float


def convex_hull(place: str, points: np.ndarray) -> Hull:
    """Return the convex hull of points (V, 3) [m].

    Raises:
        InvalidValue: The points have no volume, or the hull has too many faces.
        MissingPackage: scipy is not installed.
    """
    spatial = _spatial()
    try:
        hull = spatial.ConvexHull(points)
    except (spatial.QhullError, ValueError):
        allowed = "at least 4 points that are not in one plane"
        raise InvalidValue(place, f"{len(points)} points", allowed) from None
    normals, offsets = hull.equations[:, :3], -hull.equations[:, 3]
    corners = points[hull.simplices]
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = np.linalg.norm(np.cross(u, v), axis=1)
    tolerance = FLAT * float(np.ptp(points, axis=0).max())
    free, kept = np.ones(len(area), bool), []
    for i in np.argsort(-area, kind="stable"):  # the largest say how a face lies
        if not free[i]:
            continue
        flat = np.abs(corners @ normals[i] - offsets[i]).max(axis=1) <= tolerance
        free &= ~(flat & (normals @ normals[i] > 0))
        kept.append(i)
        if len(kept) > MAX_FACES:
            allowed = f"points whose hull has at most {MAX_FACES} flat faces: simplify the mesh"
            raise InvalidValue(place, f"{len(points)} points", allowed)
    planes = HalfSpaces(normals[kept], (points @ normals[kept].T).max(axis=0))
    return Hull(planes, hull.simplices.astype(int), float(hull.volume), float(hull.area))


def polytope(planes: HalfSpaces, inside: np.ndarray) -> Polytope:
    """Return the polyhedron within half-spaces, around a point (3,) that is inside of all.

    Planes that do not touch it are left out.

    Raises:
        MissingPackage: scipy is not installed.
    """
    spatial = _spatial()
    stacked = np.column_stack([planes.normals, -planes.offsets])
    found = spatial.HalfspaceIntersection(stacked, inside)
    corner, corners = _merged(found.intersections, _SAME)
    at_plane: list[set[int]] = [set() for _ in planes.offsets]
    for plane_ids, k in zip(found.dual_facets, corner, strict=True):
        for i in plane_ids:
            at_plane[i].add(int(k))
    kept: list[int] = []
    walls: list[list[float]] = []
    first_wall: list[int] = []
    edges: set[tuple[int, int]] = set()
    for i, members in enumerate(at_plane):
        if len(members) < 3:
            continue
        normal = planes.normals[i]
        ring = _around(normal, corners, sorted(members))
        kept.append(i)
        first_wall.append(len(walls))
        for a, b in zip(ring, [*ring[1:], ring[0]], strict=True):
            out = np.cross(corners[b] - corners[a], normal)
            out /= np.linalg.norm(out)
            walls.append([*out, out @ corners[a]])
            edges.add((min(a, b), max(a, b)))
    heads_and_tails = np.array(sorted(edges))
    tails = corners[heads_and_tails[:, 0]]
    ways = corners[heads_and_tails[:, 1]] - tails
    lengths = np.linalg.norm(ways, axis=1)
    wall = np.array(walls)
    faces = HalfSpaces(planes.normals[kept], planes.offsets[kept])
    return Polytope(
        faces,
        wall[:, :3],
        wall[:, 3],
        np.array(first_wall),
        tails,
        ways / lengths[:, None],
        lengths,
    )


def _merged(points: np.ndarray, closeness: float) -> tuple[np.ndarray, np.ndarray]:
    """Return for each point the number of its corner, and the corners (V, 3)."""
    spatial = _spatial()
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    near = closeness * float(np.ptp(points, axis=0).max())
    pairs = spatial.cKDTree(points).query_pairs(near, output_type="ndarray")
    links = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=[len(points)] * 2)
    _, corner = connected_components(links, directed=False)
    _, first = np.unique(corner, return_index=True)
    return corner, points[first]


def _around(normal: np.ndarray, corners: np.ndarray, members: list[int]) -> list[int]:
    """Return a face's corners in order, counter-clockwise as seen from outside."""
    own = corners[members] - corners[members].mean(axis=0)
    x = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    angles = np.arctan2(own @ np.cross(normal, x), own @ x)
    return [members[i] for i in np.argsort(angles)]


def _spatial() -> Any:
    try:
        import scipy.spatial
    except ImportError:
        raise MissingPackage("a convex mesh", "scipy", "mesh") from None
    return scipy.spatial
