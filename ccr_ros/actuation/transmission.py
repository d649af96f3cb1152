# SPDX-License-Identifier: Apache-2.0
"""Between a cable's pull and its servo's angle."""

from __future__ import annotations

import math
from dataclasses import dataclass

from .rack import ServoJoint


@dataclass(frozen=True)
class Transmission:
    """Pull and tension of a cable against angle and torque of its servo.

    The spool takes up what the finger gives (the pull) and what the cable stretches::

        angle = zero + direction gear / spool_radius (pull - offset + tension / cable_stiffness)
        torque = direction tension spool_radius / (gear efficiency)

    Attributes:
        joint: The servo and its spool.
        zero: Angle of the servo where the cable is just taut [rad]; NaN: not known, and then what
            follows from it is NaN.
    """

    joint: ServoJoint
    zero: float = math.nan

    @property
    def angle_per_pull(self) -> float:
        """Angle of the servo per metre of cable [rad/m], with its sign."""
        return self.joint.direction * self.joint.gear / self.joint.spool_radius

    def angle(self, pull: float, tension: float) -> float:
        """Return the servo's angle [rad] for a pull [m] under a tension [N]."""
        return self.zero + self.angle_per_pull * (pull - self.joint.offset + self._stretch(tension))

    def pull(self, angle: float, tension: float) -> float:
        """Return the pull [m] at a servo's angle [rad] under a tension [N]."""
        wound = (angle - self.zero) / self.angle_per_pull
        return wound + self.joint.offset - self._stretch(tension)

    def torque(self, tension: float) -> float:
        """Return the torque [N m] at the servo's shaft that a tension [N] takes."""
        return tension / (self.angle_per_pull * self.joint.efficiency)

    def tension(self, torque: float) -> float:
        """Return the tension [N] that a torque [N m] at the servo's shaft holds; negative: none."""
        return torque * self.angle_per_pull * self.joint.efficiency

    def _stretch(self, tension: float) -> float:
        # A tension that is not known, or that noise makes negative, stretches nothing.
        return tension / self.joint.cable_stiffness if tension > 0.0 else 0.0
