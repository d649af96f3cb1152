# SPDX-License-Identifier: Apache-2.0
"""Convex polyhedra with slightly rounded edges, given as triangles, points, or an STL file."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from .. import checks
from ..errors import InvalidValue
from ..rotation import Pose, matrix_from_quaternion, quaternion_product
from .base import FAR, Obstacle, default_edge_radius
from .polytope import HalfSpaces, Polytope, convex_hull, polytope
from .stl import read_stl
from .triangles import check_convex, check_watertight, mass_center, turned_outward

_THIN = 1e-4  # of the size: what is thinner counts as flat


@dataclass(frozen=True, eq=False)
class ConvexMesh(Obstacle):
    """A convex polyhedron with slightly rounded edges, from a closed mesh of triangles.

    As a `Box` it is a core, its faces moved inwards by ``edge_radius``, and all points within
    that radius of the core: the faces stay where they are, the normal at the surface is
    continuous, and what is smaller than the rounding (a chamfer, say) is lost in it.

    Attributes:
        vertices: (V, 3) in the mesh's own frame [m].
        faces: (F, 3) numbers of the vertices at the corners of each triangle; they are put
            counter-clockwise as seen from outside.
        position: (3,) origin of the mesh's frame [m].
        orientation: (x, y, z, w) of the mesh's frame.
        edge_radius: [m], less than the distance of the centre of mass from the nearest face;
            default: 5 % of twice that distance, at most 1 mm.

    Raises:
        InvalidValue: Numbers that are not finite, indices out of range, a mesh that is not
            watertight, not convex, flat, or of too many faces; says where.
        MissingPackage: scipy is not installed (the extra ``mesh``).
    """

    vertices: np.ndarray
    faces: np.ndarray
    position: np.ndarray = field(default_factory=lambda: np.zeros(3))
    orientation: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, 0.0, 1.0]))
    edge_radius: float | None = None
    _core: Polytope = field(init=False, repr=False)
    _centroid: np.ndarray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        self._set(
            position=checks.vector("position", self.position, 3, unit="m", largest=FAR),
            orientation=checks.quaternion("orientation", self.orientation),
        )
        vertices = checks.rows("vertices", self.vertices, 3, unit="m", largest=FAR)
        if len(vertices) < 4:
            raise InvalidValue("vertices", f"{len(vertices)} points", "at least 4 points")
        faces = checks.index_rows("faces", self.faces, 3, len(vertices))
        if len(faces) < 4:
            raise InvalidValue("faces", f"{len(faces)} triangles", "at least 4 triangles")
        check_watertight(faces)
        used = vertices[np.unique(faces)]
        hull = convex_hull("vertices", used)
        volume, centroid = mass_center(vertices, faces)
        room = float(hull.planes.depth(centroid[None])[0])
        if 2 * room < _THIN * float(np.ptp(used, axis=0).max()):
            raise InvalidValue("vertices", f"{len(used)} points", "a body that is not flat")
        check_convex(vertices, faces, hull, volume)
        edge = default_edge_radius(2 * room) if self.edge_radius is None else self.edge_radius
        edge = checks.real("edge_radius", edge, above=0, below=room, unit="m")
        planes = HalfSpaces(hull.planes.normals, hull.planes.offsets - edge)
        faces = turned_outward(vertices, faces, centroid)
        for array in (vertices, faces, centroid):
            array.setflags(write=False)
        self._set(vertices=vertices, faces=faces, edge_radius=edge)
        self._set(_core=polytope(planes, centroid), _centroid=centroid)

    @classmethod
    def hull_of(
        cls, points: Any, *, edge_radius: float | None = None, name: str = "obstacle"
    ) -> ConvexMesh:
        """Return the convex hull of points (V, 3) [m], in their frame.

        Raises:
            InvalidValue, MissingPackage: As for the class.
        """
        points = checks.rows("points", points, 3, unit="m", largest=FAR)
        corners, faces = np.unique(convex_hull("points", points).triangles, return_inverse=True)
        return cls(points[corners], faces.reshape(-1, 3), edge_radius=edge_radius, name=name)

    @classmethod
    def from_stl(
        cls,
        path: str | Path,
        scale: float = 1.0,
        *,
        hull: bool = False,
        centred: bool = False,
        edge_radius: float | None = None,
        name: str | None = None,
    ) -> ConvexMesh:
        """Read an STL file, binary or text.

        Args:
            path: The file.
            scale: Its unit in metres; 0.001 for a file in millimetres, as most are.
            hull: Take the convex hull; else a mesh that is not convex, or not closed, is an error.
            centred: Put the origin of the frame at the centre of mass; else it is the file's.
            edge_radius: [m]; default as for the class.
            name: Default: the file's name without its suffix.

        Raises:
            MissingPackage: trimesh or scipy is not installed (the extra ``mesh``).
            InvalidFile: The file cannot be read or is no STL.
            InvalidValue: As for the class, or a size that cannot be meant; names the file.
        """
        vertices, faces = read_stl(path, scale)
        name = Path(path).stem if name is None else name
        try:
            if hull:
                mesh = cls.hull_of(vertices, edge_radius=edge_radius, name=name)
            else:
                mesh = cls(vertices, faces, edge_radius=edge_radius, name=name)
        except InvalidValue as error:
            raise error.located("", str(path)) from None
        return replace(mesh, vertices=mesh.vertices - mesh.centroid) if centred else mesh

    @property
    def pose(self) -> Pose:
        """Pose of the mesh's frame."""
        return Pose(self.position, self.orientation)

    @property
    def centroid(self) -> np.ndarray:
        """Centre of mass (3,) [m] of a solid of even density, in the mesh's own frame."""
        return self._centroid

    def centred(self) -> ConvexMesh:
        """Return the same body where it is, its frame's origin put at its centre of mass."""
        return replace(
            self,
            vertices=self.vertices - self.centroid,
            position=self.pose.points(self.centroid),
        )

    def _local(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rotation = matrix_from_quaternion(self.orientation)
        return rotation, (points - self.position) @ rotation

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        return self._core.nearest(self._local(points)[1]).distance - self.edge_radius

    def derivatives(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rotation, local = self._local(points)
        near = self._core.nearest(local)
        return near.normals @ rotation.T, rotation @ near.hessians @ rotation.T

    def moved(self, pose: Pose) -> ConvexMesh:
        # The polyhedron is the same in its own frame: it is kept.
        turned = quaternion_product(pose.orientation, self.orientation)
        return self._carried(position=pose.points(self.position), orientation=turned)
