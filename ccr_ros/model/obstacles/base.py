# SPDX-License-Identifier: Apache-2.0
"""What every obstacle is: a signed distance, positive outside, with gradient and Hessian.

The paper's Eq. 6 asks for a function f(x) >= 0 outside the obstacle. A signed distance is the
one whose multiplier is the contact's normal force, because its gradient is the unit normal.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np

from ..rotation import Pose

FAR = 1e6  # m; beyond, rounding errors of a distance would exceed the solver's tolerance
TINY = 1e-12  # m; where a normal is undefined (a sphere's centre), any unit vector serves
_ROUNDING, _LARGEST_ROUNDING = 0.05, 0.001  # of the shortest side; m


@dataclass(frozen=True, eq=False)
class Obstacle(ABC):
    """A rigid body that disks and cables may touch but not enter, in the finger's base frame."""

    name: str = field(default="obstacle", kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", str(self.name))

    def _set(self, **values: Any) -> None:
        for key, value in values.items():
            object.__setattr__(self, key, value)

    def _carried(self, **values: np.ndarray) -> Self:
        """Return a copy with what a rigid motion changes, which needs no checks anew."""
        other = object.__new__(type(self))
        for value in values.values():
            value.setflags(write=False)
        other.__dict__.update(self.__dict__, **values)
        return other

    @abstractmethod
    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        """Return the distance (P,) in metres of points (P, 3); positive outside."""

    @abstractmethod
    def derivatives(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return outward unit normals (P, 3) and Hessians (P, 3, 3) [1/m] at points (P, 3)."""

    @abstractmethod
    def moved(self, pose: Pose) -> Obstacle:
        """Return the obstacle carried by a rigid motion, given as the pose of its frame."""


def radial(offset: np.ndarray, span: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return normals and Hessians of |offset|, offset (P, 3) in what ``span`` projects on."""
    r = np.sqrt(np.einsum("pi,pi->p", offset, offset))
    central = r < TINY
    r = np.maximum(r, TINY)
    normal = offset / r[:, None]
    hessian = (span - normal[:, :, None] * normal[:, None, :]) / r[:, None, None]
    if central.any():
        any_way = span[np.argmax(np.diagonal(span))]
        normal[central] = any_way / np.linalg.norm(any_way)
        hessian[central] = 0.0
    return normal, hessian


def default_edge_radius(shortest: float) -> float:
    """Return the rounding of edges [m] that goes with a body's shortest side [m]."""
    return min(_ROUNDING * shortest, _LARGEST_ROUNDING)
