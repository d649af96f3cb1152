# SPDX-License-Identifier: Apache-2.0
"""An object's section in a finger's plane, whose contour the finger may follow."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..model import checks


@dataclass(frozen=True)
class Section:
    """An object's section in the finger's plane: a rectangle with rounded corners, or a circle.

    Attributes:
        half_width: Half of its extent across z, away from the base [m].
        half_height: Half of its extent along z [m].
        corner_radius: [m]; a circle's is its radius, and half of both extents.
        forward: How far its centre is in front of the base [m].
        up: How far its centre is above the base [m].

    Raises:
        InvalidValue: A value out of its range.
    """

    half_width: float
    half_height: float
    corner_radius: float
    forward: float
    up: float

    def __post_init__(self) -> None:
        width = checks.real("half_width", self.half_width, above=0, high=1e3, unit="m")
        height = checks.real("half_height", self.half_height, above=0, high=1e3, unit="m")
        largest = min(width, height) * (1 + 1e-12)
        checks.real("corner_radius", self.corner_radius, low=0, high=largest, unit="m")
        checks.real("forward", self.forward, low=-1e3, high=1e3, unit="m")
        checks.real("up", self.up, low=-1e3, high=1e3, unit="m")

    @classmethod
    def circle(cls, radius: float, forward: float, up: float) -> Section:
        """Return the section of a sphere, or of a cylinder square to the plane."""
        return cls(radius, radius, radius, forward, up)

    def grown(self, by: float) -> Section:
        """Return the section grown by a distance [m] on all sides."""
        grown = (self.half_width + by, self.half_height + by, self.corner_radius + by)
        return Section(*grown, self.forward, self.up)

    @property
    def core(self) -> tuple[float, float]:
        """Half extents of the rectangle of the corners' centres: across z, and along it [m]."""
        across, along = self.half_width - self.corner_radius, self.half_height - self.corner_radius
        return max(0.0, across), max(0.0, along)

    def signed_distance(self, points: np.ndarray) -> np.ndarray:
        """Return distances (k,) [m] of points (k, 2), forward and up; positive outside."""
        excess = np.abs(points - [self.forward, self.up]) - self.core
        outside = np.linalg.norm(np.maximum(excess, 0.0), axis=1)
        return outside + np.minimum(excess.max(axis=1), 0.0) - self.corner_radius

    def knots(self) -> tuple[np.ndarray, np.ndarray]:
        """Return positions (k,) along the contour [m] and headings (k,) there, linear between.

        Positions count from the middle of the side that faces the base, upwards; from the lower
        end of its lower corner, round to the lower end of the far side.
        """
        across, along = self.core
        quarter = self.corner_radius * math.pi / 2
        steps = [quarter, 2 * along, quarter, 2 * across, quarter, 2 * along]
        positions = np.concatenate([[0.0], np.cumsum(steps)]) - quarter - along
        return positions, np.radians([-90, 0, 0, 90, 90, 180, 180])

    def at(self, position: float) -> tuple[float, float, float, float]:
        """Return forward, up, heading and curvature of the near side or its corners."""
        across, along = self.core
        rho = self.corner_radius
        beyond = math.copysign(max(0.0, abs(position) - along), position)
        heading = beyond / rho
        forward = self.forward - across - rho * math.cos(heading)
        up = self.up + max(-along, min(along, position)) + rho * math.sin(heading)
        return forward, up, heading, 1 / rho if beyond else 0.0
