# SPDX-License-Identifier: Apache-2.0
"""Bodies of revolution of finite length: capsules, and cylinders with rounded edges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np

from .. import checks
from ..errors import InvalidValue
from ..rotation import Pose
from .base import FAR, TINY, Obstacle, default_edge_radius, radial


@dataclass(frozen=True, eq=False)
class Capsule(Obstacle):
    """All points within ``radius`` of a segment from ``start`` (3,) to ``end`` (3,), metres.

    Raises:
        InvalidValue: A value is out of range, or the segment has no length.
    """

    start: np.ndarray
    end: np.ndarray
    radius: float

    def __post_init__(self) -> None:
        super().__post_init__()
        start = checks.vector("start", self.start, 3, unit="m", largest=FAR)
        end = checks.vector("end", self.end, 3, unit="m", largest=FAR)
        radius = checks.real("radius", self.radius, above=0, high=FAR, unit="m")
        if float(np.linalg.norm(end - start)) < 1e-9 * radius:
            raise InvalidValue("end", end, "apart from start (without a length it is a Sphere)")
        self._set(start=start, end=end, radius=radius)

    @property
    def length(self) -> float:
        """Length of the segment, between the centres of the two half balls [m]."""
        return float(np.linalg.norm(self.end - self.start))

    @property
    def axis(self) -> np.ndarray:
        """Unit vector (3,) from start to end."""
        return (self.end - self.start) / self.length

    @property
    def center(self) -> np.ndarray:
        """Middle of the segment (3,) [m]."""
        return 0.5 * (self.start + self.end)

    def _offset(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Ways (P, 3) from the segment's nearest points, and whether these are its ends (P,)."""
        along = (points - self.start) @ self.axis
        nearest = np.clip(along, 0.0, self.length)
        return points - self.start - nearest[:, None] * self.axis, along != nearest

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        return np.linalg.norm(self._offset(points)[0], axis=1) - self.radius

    def derivatives(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        offset, at_end = self._offset(points)
        normals, hessians = radial(offset, np.eye(3) - np.outer(self.axis, self.axis))
        normals[at_end], hessians[at_end] = radial(offset[at_end], np.eye(3))
        return normals, hessians

    def moved(self, pose: Pose) -> Capsule:
        return self._carried(start=pose.points(self.start), end=pose.points(self.end))


@dataclass(frozen=True, eq=False)
class FiniteCylinder(Obstacle):
    """A cylinder with flat ends and slightly rounded edges.

    The edges are rounded by ``edge_radius`` (default: 5 % of the smaller of diameter and height,
    at most 1 mm), as those of a `Box` are; ends and side stay where they are.

    Attributes:
        center: (3,) its middle [m].
        axis: (3,) direction; is made a unit vector.
        height: From end to end [m].
        radius: [m].
        edge_radius: [m]; less than the radius and than half the height.

    Raises:
        InvalidValue: A value is out of range.
    """

    center: np.ndarray
    axis: np.ndarray
    height: float
    radius: float
    edge_radius: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        height = checks.real("height", self.height, above=0, high=FAR, unit="m")
        radius = checks.real("radius", self.radius, above=0, high=FAR, unit="m")
        shortest = min(height, 2 * radius)
        edge = default_edge_radius(shortest) if self.edge_radius is None else self.edge_radius
        self._set(
            center=checks.vector("center", self.center, 3, unit="m", largest=FAR),
            axis=checks.direction("axis", self.axis),
            height=height,
            radius=radius,
            edge_radius=checks.real("edge_radius", edge, above=0, below=shortest / 2, unit="m"),
        )

    @property
    def _edge(self) -> float:
        return cast(float, self.edge_radius)  # set by __post_init__

    def _profile(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Heights over the middle (P,), ways from the axis (P, 3), excess over the core (P, 2).

        The core is the cylinder less its rounding; excess is radial and along the axis.
        """
        offset = points - self.center
        along = offset @ self.axis
        away = offset - along[:, None] * self.axis
        core = np.array([self.radius, self.height / 2]) - self._edge
        return along, away, np.stack([np.linalg.norm(away, axis=1), np.abs(along)], axis=1) - core

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        excess = self._profile(points)[2]
        outside = np.linalg.norm(np.maximum(excess, 0.0), axis=1)
        return outside + np.minimum(excess.max(axis=1), 0.0) - self._edge

    def derivatives(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        along, away, excess = self._profile(points)
        outward, bend = radial(away, np.eye(3) - np.outer(self.axis, self.axis))
        up = np.where(along < 0, -1.0, 1.0)[:, None] * self.axis
        # The gradient in the half plane of radius and axis; in the core the nearest side decides.
        clipped = np.maximum(excess, 0.0)
        r = np.linalg.norm(clipped, axis=1)
        side = np.eye(2)[np.argmax(excess, axis=1)]
        steep = np.where((r < TINY)[:, None], side, clipped / np.maximum(r, TINY)[:, None])
        normals = steep[:, :1] * outward + steep[:, 1:] * up
        # Around the axis it bends with the radius, and around the edge with the rounding.
        hessians = steep[:, 0, None, None] * bend
        at_edge = (excess > 0).all(axis=1) & (r >= TINY)
        across = steep[at_edge, :1] * up[at_edge] - steep[at_edge, 1:] * outward[at_edge]
        hessians[at_edge] += across[:, :, None] * across[:, None, :] / r[at_edge, None, None]
        return normals, hessians

    def moved(self, pose: Pose) -> FiniteCylinder:
        return self._carried(center=pose.points(self.center), axis=pose.vectors(self.axis))
