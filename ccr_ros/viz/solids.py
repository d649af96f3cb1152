# SPDX-License-Identifier: Apache-2.0
"""Bodies to be shown: obstacles and objects as primitives or triangles, each at its pose."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..model import checks
from ..model.errors import InvalidValue
from ..model.obstacles import (
    Box,
    Capsule,
    ConvexMesh,
    Cylinder,
    FiniteCylinder,
    Obstacle,
    Plane,
    Sphere,
)
from ..model.obstacles.triangles import turned_outward
from ..model.rotation import Pose, quaternion_from_matrix

DIMENSIONS = {
    "sphere": ("radius",),
    "box": ("x", "y", "z"),
    "cylinder": ("height", "radius"),
    "capsule": ("length", "radius"),
    "mesh": (),
}


@dataclass(frozen=True, eq=False)
class SolidObject:
    """A body in the gripper's frame, with the dimensions of shape_msgs/SolidPrimitive.

    Attributes:
        name: Unique in its recording.
        kind: ``"sphere"``, ``"box"``, ``"cylinder"``, ``"capsule"`` or ``"mesh"``.
        dimensions: [m]: sphere (radius,); box (x, y, z) full sizes; cylinder (height, radius) and
            capsule (length between the centres of its half balls, radius), along z; mesh ().
        pose: Of the body's centre, or of a mesh's frame, in the gripper's frame.
        vertices: (V, 3) of a mesh, in its frame [m]; else None.
        faces: (F, 3) numbers of the vertices of a (convex) mesh's triangles; they are put
            counter-clockwise as seen from outside. Else None.
    """

    name: str
    kind: str
    dimensions: tuple[float, ...]
    pose: Pose = field(default_factory=Pose)
    vertices: np.ndarray | None = None
    faces: np.ndarray | None = None

    def __post_init__(self) -> None:
        label("name", self.name)
        if self.kind not in DIMENSIONS:
            raise InvalidValue("kind", self.kind, f"one of {', '.join(DIMENSIONS)}")
        names = DIMENSIONS[self.kind]
        sizes = checks.vector("dimensions", self.dimensions, len(names), unit="m")
        for name, size in zip(names, sizes, strict=True):
            checks.real(f"dimensions.{name}", float(size), above=0, unit="m")
        object.__setattr__(self, "dimensions", tuple(sizes.tolist()))
        if self.kind == "mesh":
            vertices = checks.rows("vertices", self.vertices, 3, unit="m", largest=1e6)
            faces = checks.index_rows("faces", self.faces, 3, len(vertices))
            if not len(faces):
                raise InvalidValue("faces", [], "at least one triangle")
            faces = turned_outward(vertices, faces, vertices[np.unique(faces)].mean(axis=0))
            for name, numbers in (("vertices", vertices), ("faces", faces)):
                numbers.setflags(write=False)
                object.__setattr__(self, name, numbers)
        elif self.vertices is not None or self.faces is not None:
            raise InvalidValue("vertices", f"those of a {self.kind}", "given for a mesh only")

    @property
    def shape(self) -> Hashable:
        """What two bodies have in common that differ in name and pose alone."""
        if self.vertices is None or self.faces is None:
            return self.kind, self.dimensions
        return self.kind, self.vertices.tobytes(), self.faces.tobytes()

    @classmethod
    def from_obstacle(
        cls, obstacle: Obstacle, base: Pose | None = None, extent: float = 0.3
    ) -> SolidObject:
        """Make the body that shows an obstacle; rounded edges are shown sharp.

        Args:
            obstacle: In the frame whose pose in the gripper is ``base``.
            base: Pose of the obstacle's frame; default: the gripper's own.
            extent: How much of an infinite cylinder or of a plane is shown [m].
        """
        body = obstacle.moved(base) if base is not None else obstacle
        name = body.name
        if isinstance(body, Sphere):
            return cls(name, "sphere", (body.radius,), Pose(body.center))
        if isinstance(body, Box):
            return cls(name, "box", tuple(body.size), Pose(body.center, body.orientation))
        if isinstance(body, Cylinder):
            return cls(name, "cylinder", (extent, body.radius), Pose(body.point, along(body.axis)))
        if isinstance(body, FiniteCylinder):
            pose = Pose(body.center, along(body.axis))
            return cls(name, "cylinder", (body.height, body.radius), pose)
        if isinstance(body, Capsule):
            pose = Pose(body.center, along(body.axis))
            return cls(name, "capsule", (body.length, body.radius), pose)
        if isinstance(body, ConvexMesh):
            return cls(name, "mesh", (), body.pose, body.vertices, body.faces)
        if isinstance(body, Plane):
            thickness = extent / 100
            center = body.point - body.normal * thickness / 2
            return cls(name, "box", (extent, extent, thickness), Pose(center, along(body.normal)))
        raise InvalidValue("obstacle", type(obstacle).__name__, "an obstacle that can be shown")


def along(axis: np.ndarray) -> np.ndarray:
    """Return the quaternion (4,) of a frame whose z is the given unit vector."""
    side = np.eye(3)[int(np.argmin(np.abs(axis)))]
    x = np.cross(side, axis)
    x /= np.linalg.norm(x)
    return quaternion_from_matrix(np.column_stack([x, np.cross(axis, x), axis]))


def label(place: str, value: Any) -> str:
    """Return ``value`` as a name to show: any text that is not empty."""
    if not isinstance(value, str) or not value.strip():
        raise InvalidValue(place, value, "a text that is not empty")
    return value


def array(place: str, value: Any, shape: tuple[int | None, ...], unit: str = "") -> np.ndarray:
    """Return a read-only finite float copy of the given shape; ``None`` stands for any length."""
    words = " x ".join("any" if s is None else str(s) for s in shape)
    allowed = f"finite numbers of shape {words}" + (f" [{unit}]" if unit else "")
    try:
        out = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise InvalidValue(place, value, allowed) from None
    if out.ndim != len(shape) or any(
        s not in (None, n) for s, n in zip(shape, out.shape, strict=True)
    ):
        raise InvalidValue(place, f"shape {out.shape}", allowed)
    if not np.isfinite(out).all():
        raise InvalidValue(place, float(out[~np.isfinite(out)][0]), allowed)
    out.setflags(write=False)
    return out
