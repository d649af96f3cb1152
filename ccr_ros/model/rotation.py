# SPDX-License-Identifier: Apache-2.0
"""Rotations and rigid poses: quaternions are (x, y, z, w), as in ROS."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from . import checks


def skew(v: np.ndarray) -> np.ndarray:
    """Return the cross-product matrices of vectors (..., 3) -> (..., 3, 3): skew(v) @ x = v x x."""
    out = np.zeros((*v.shape, 3))
    out[..., 0, 1], out[..., 0, 2] = -v[..., 2], v[..., 1]
    out[..., 1, 0], out[..., 1, 2] = v[..., 2], -v[..., 0]
    out[..., 2, 0], out[..., 2, 1] = -v[..., 1], v[..., 0]
    return out


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return a x b of vectors (..., 3); several times faster than numpy.cross on small arrays."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    a0, a1, a2 = a[..., 0], a[..., 1], a[..., 2]
    b0, b1, b2 = b[..., 0], b[..., 1], b[..., 2]
    out[..., 0] = a1 * b2 - a2 * b1
    out[..., 1] = a2 * b0 - a0 * b2
    out[..., 2] = a0 * b1 - a1 * b0
    return out


def matrix_from_quaternion(q: np.ndarray) -> np.ndarray:
    """Return the rotation matrix (3, 3) of a unit quaternion (x, y, z, w)."""
    v, w = np.asarray(q[:3], dtype=float), float(q[3])
    k = skew(v)
    return np.eye(3) + 2.0 * w * k + 2.0 * (k @ k)


def quaternion_from_matrix(rotation: np.ndarray) -> np.ndarray:
    """Return unit quaternions (..., 4) as (x, y, z, w), w >= 0, of rotation matrices (..., 3, 3).

    Source: Bar-Itzhack (2000): the quaternion is the dominant eigenvector of a symmetric matrix,
    here by picking the largest of the four diagonal candidates (Shepperd 1978), free of branches
    on the angle.
    """
    m = np.asarray(rotation, dtype=float)
    flat = m.reshape(-1, 3, 3)
    xx, yy, zz = flat[:, 0, 0], flat[:, 1, 1], flat[:, 2, 2]
    # rows of 4 q q^T, one candidate per row
    k = np.empty((len(flat), 4, 4))
    k[:, 0, 0], k[:, 1, 1] = 1 + xx - yy - zz, 1 - xx + yy - zz
    k[:, 2, 2], k[:, 3, 3] = 1 - xx - yy + zz, 1 + xx + yy + zz
    k[:, 0, 1] = k[:, 1, 0] = flat[:, 1, 0] + flat[:, 0, 1]
    k[:, 0, 2] = k[:, 2, 0] = flat[:, 2, 0] + flat[:, 0, 2]
    k[:, 1, 2] = k[:, 2, 1] = flat[:, 2, 1] + flat[:, 1, 2]
    k[:, 0, 3] = k[:, 3, 0] = flat[:, 2, 1] - flat[:, 1, 2]
    k[:, 1, 3] = k[:, 3, 1] = flat[:, 0, 2] - flat[:, 2, 0]
    k[:, 2, 3] = k[:, 3, 2] = flat[:, 1, 0] - flat[:, 0, 1]
    best = np.argmax(np.diagonal(k, axis1=1, axis2=2), axis=1)
    q = k[np.arange(len(flat)), best]
    q = q / np.linalg.norm(q, axis=1, keepdims=True)
    q = np.where(q[:, 3:] < 0, -q, q)
    return q.reshape(*m.shape[:-2], 4)


def quaternion_product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the quaternion (4,), w >= 0, of the rotation b followed by a, both (x, y, z, w)."""
    ax, ay, az, aw = a.tolist()
    bx, by, bz, bw = b.tolist()
    product = (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )
    size = math.copysign(math.hypot(*product), product[3])
    return np.array([value / size for value in product])


@dataclass(frozen=True, eq=False)
class Pose:
    """A rigid pose: the position and orientation of one frame in another.

    Attributes:
        position: (3,) in metres.
        orientation: (4,) unit quaternion (x, y, z, w).
    """

    position: np.ndarray = field(default_factory=lambda: np.zeros(3))
    orientation: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, 0.0, 1.0]))

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "position", checks.vector("position", self.position, 3, unit="m", largest=1e6)
        )
        object.__setattr__(self, "orientation", checks.quaternion("orientation", self.orientation))

    @cached_property
    def rotation(self) -> np.ndarray:
        """Rotation matrix (3, 3): columns are the frame's axes in the outer frame."""
        rotation = matrix_from_quaternion(self.orientation)
        rotation.setflags(write=False)  # it is kept
        return rotation

    def points(self, points: np.ndarray) -> np.ndarray:
        """Map points (..., 3) from this frame to the outer one."""
        return points @ self.rotation.T + self.position

    def vectors(self, vectors: np.ndarray) -> np.ndarray:
        """Rotate vectors (..., 3) from this frame to the outer one."""
        return vectors @ self.rotation.T

    def inverse(self) -> Pose:
        """Return the pose of the outer frame in this one."""
        x, y, z, w = self.orientation
        return Pose(-(self.position @ self.rotation), np.array([-x, -y, -z, w]))

    def __matmul__(self, other: Pose) -> Pose:
        """Compose: ``a @ b`` is the pose of b's frame in a's outer frame."""
        turned = quaternion_product(self.orientation, other.orientation)
        return Pose(self.points(other.position), turned)
