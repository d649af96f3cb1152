# SPDX-License-Identifier: Apache-2.0
"""The object in the gripper: a rigid body with a shape, a weight and a pose."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ccr_ros.model import checks
from ccr_ros.model.errors import InvalidValue
from ccr_ros.model.obstacles import Box, Cylinder, Obstacle, Sphere
from ccr_ros.model.rotation import Pose

GRAVITY = np.array([0.0, 0.0, -9.80665])  # m/s^2, of a gripper that points up


@dataclass(frozen=True, eq=False)
class Body:
    """A rigid object.

    Attributes:
        shape: Its surface, in its own frame, whose origin is the centre of mass: a `Sphere` about
            the origin, a `Box`, or a `Cylinder` (infinite along its axis).
        mass: [kg].
        pose: Of its frame in the gripper's.

    Raises:
        InvalidValue: A value is out of range, or the shape is none of these.
    """

    shape: Obstacle
    mass: float = 0.0
    pose: Pose = field(default_factory=Pose)

    def __post_init__(self) -> None:
        if not isinstance(self.shape, Sphere | Box | Cylinder):
            raise InvalidValue("shape", type(self.shape).__name__, "a Sphere, a Box or a Cylinder")
        object.__setattr__(self, "mass", checks.real("mass", self.mass, low=0, high=1e3, unit="kg"))

    @property
    def name(self) -> str:
        """Name of the shape."""
        return self.shape.name

    def free_directions(self) -> np.ndarray:
        """Return (6, k) rigid motions about the body's centre that leave its surface as it is.

        Columns are (translation, rotation vector) in the body's own frame; a ball turns about any
        axis, an infinite cylinder about and along its own.
        """
        if isinstance(self.shape, Sphere) and not np.any(self.shape.center):
            return np.eye(6)[:, 3:]
        if isinstance(self.shape, Cylinder):
            axis, arm = self.shape.axis, self.shape.point
            along = np.concatenate([axis, np.zeros(3)])
            about = np.concatenate([np.cross(arm, axis), axis])  # x -> axis x (x - arm)
            return np.column_stack([along, about / np.linalg.norm(about)])
        return np.zeros((6, 0))


def sphere_body(diameter: float, mass: float = 0.0, pose: Pose | None = None) -> Body:
    """Return a ball of this diameter [m], mass [kg] and pose of its centre."""
    radius = checks.real("diameter", diameter, above=0, unit="m") / 2
    ball = Sphere(np.zeros(3), radius, name="ball")
    return Body(ball, mass, Pose() if pose is None else pose)
