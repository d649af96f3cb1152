# SPDX-License-Identifier: Apache-2.0
"""Balls, infinite cylinders, half-spaces and boxes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import cast

import numpy as np

from .. import checks
from ..rotation import Pose, matrix_from_quaternion, quaternion_product
from .base import FAR, TINY, Obstacle, default_edge_radius, radial

_EYE = np.eye(3)


@dataclass(frozen=True, eq=False)
class Sphere(Obstacle):
    """A ball: center (3,) and radius, metres."""

    center: np.ndarray
    radius: float

    def __post_init__(self) -> None:
        super().__post_init__()
        self._set(
            center=checks.vector("center", self.center, 3, unit="m", largest=FAR),
            radius=checks.real("radius", self.radius, above=0, high=FAR, unit="m"),
        )

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        offset = points - self.center
        return np.sqrt(np.einsum("pi,pi->p", offset, offset)) - self.radius

    def derivatives(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return radial(points - self.center, _EYE)

    def moved(self, pose: Pose) -> Sphere:
        return self._carried(center=pose.points(self.center))


@dataclass(frozen=True, eq=False)
class Cylinder(Obstacle):
    """An infinite cylinder: a point on its axis (3,), the axis direction (3,), and the radius."""

    point: np.ndarray
    axis: np.ndarray
    radius: float

    def __post_init__(self) -> None:
        super().__post_init__()
        self._set(
            point=checks.vector("point", self.point, 3, unit="m", largest=FAR),
            axis=checks.direction("axis", self.axis),
            radius=checks.real("radius", self.radius, above=0, high=FAR, unit="m"),
        )

    def _across(self) -> np.ndarray:
        return np.eye(3) - np.outer(self.axis, self.axis)

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        return np.linalg.norm((points - self.point) @ self._across(), axis=1) - self.radius

    def derivatives(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        across = self._across()
        return radial((points - self.point) @ across, across)

    def moved(self, pose: Pose) -> Cylinder:
        return self._carried(point=pose.points(self.point), axis=pose.vectors(self.axis))


@dataclass(frozen=True, eq=False)
class Plane(Obstacle):
    """A half-space: a point on its surface (3,) and the outward normal (3,)."""

    point: np.ndarray
    normal: np.ndarray

    def __post_init__(self) -> None:
        super().__post_init__()
        self._set(
            point=checks.vector("point", self.point, 3, unit="m", largest=FAR),
            normal=checks.direction("normal", self.normal),
        )

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        return (points - self.point) @ self.normal

    def derivatives(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.tile(self.normal, (len(points), 1)), np.zeros((len(points), 3, 3))

    def moved(self, pose: Pose) -> Plane:
        return self._carried(point=pose.points(self.point), normal=pose.vectors(self.normal))


@dataclass(frozen=True, eq=False)
class Box(Obstacle):
    """A box with slightly rounded edges: center (3,), orientation (x, y, z, w), full size (3,).

    The edges are rounded by ``edge_radius`` (default: 5 % of the shortest side, at most 1 mm), so
    that the distance has a continuous normal at the surface; the faces stay where they are.
    """

    center: np.ndarray
    size: np.ndarray
    orientation: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, 0.0, 1.0]))
    edge_radius: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        size = checks.vector("size", self.size, 3, unit="m", largest=FAR)
        for i, side in enumerate(size):
            checks.real(f"size[{i}]", float(side), above=0, unit="m")
        shortest = float(size.min())
        edge = default_edge_radius(shortest) if self.edge_radius is None else self.edge_radius
        self._set(
            center=checks.vector("center", self.center, 3, unit="m", largest=FAR),
            size=size,
            orientation=checks.quaternion("orientation", self.orientation),
            edge_radius=checks.real("edge_radius", edge, above=0, high=shortest / 2, unit="m"),
        )

    @property
    def _edge(self) -> float:
        return cast(float, self.edge_radius)  # set by __post_init__

    def _local(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rotation, points in the box's frame, their excess over the core (box less rounding)."""
        rotation = matrix_from_quaternion(self.orientation)
        local = (points - self.center) @ rotation
        return rotation, local, np.abs(local) - (self.size / 2 - self._edge)

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        _, _, excess = self._local(points)
        outside = np.linalg.norm(np.maximum(excess, 0.0), axis=1)
        inside = np.minimum(excess.max(axis=1), 0.0)
        return outside + inside - self._edge

    def derivatives(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rotation, local, excess = self._local(points)
        sign = np.where(local < 0, -1.0, 1.0)
        clipped = np.maximum(excess, 0.0)
        r = np.linalg.norm(clipped, axis=1)
        deep = r < TINY  # in the core: the nearest face decides
        face = np.eye(3)[np.argmax(excess, axis=1)]
        normal = np.where(deep[:, None], face, clipped / np.maximum(r, TINY)[:, None])
        active = (excess > 0).astype(float)
        hessian = active[:, :, None] * np.eye(3) - normal[:, :, None] * normal[:, None, :]
        hessian *= np.where(deep, 0.0, 1.0 / np.maximum(r, TINY))[:, None, None]
        hessian *= sign[:, :, None] * sign[:, None, :]
        return (sign * normal) @ rotation.T, rotation @ hessian @ rotation.T

    def moved(self, pose: Pose) -> Box:
        turned = quaternion_product(pose.orientation, self.orientation)
        return self._carried(center=pose.points(self.center), orientation=turned)
