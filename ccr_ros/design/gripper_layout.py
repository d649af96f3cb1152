# SPDX-License-Identifier: Apache-2.0
"""Where the fingers of a gripper stand around an object, and what of it each one faces."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ..model import checks
from ..model.errors import InvalidValue
from ..model.finger import Finger
from ..model.obstacles import Box, Cylinder, Obstacle, Sphere
from ..model.rotation import Pose
from .curve_text import SizedObject
from .section import Section

MOST_FINGERS = 12
_FACING = 1e-6  # rad


@dataclass(frozen=True)
class GripperLayout:
    """A body on the gripper's axis and the bases around it; z along the axis, bases at z = 0.

    Around a sphere or a cylinder the bases stand evenly, at ``base_radius`` from the axis, each
    facing it. Around a box each faces a side squarely, ``base_radius`` from the plane through the
    box's middle: 2 fingers stand at +x and -x; a third stands beside the one at -x, both moved
    along y by a quarter of the side; 4 stand at all sides.

    Attributes:
        body: The object, upright.
        center_height: Of its centre above the base plane [m].
        base_radius: [m].
        fingers: How many.

    Raises:
        InvalidValue: A value out of its range, or an object that reaches below the base plane.
    """

    body: SizedObject
    center_height: float
    base_radius: float
    fingers: int

    def __post_init__(self) -> None:
        checks.real("base_radius", self.base_radius, above=0, high=1e3, unit="m")
        height = checks.real("center_height", self.center_height, low=-1e3, high=1e3, unit="m")
        most = 4 if self.body.kind == "box" else MOST_FINGERS
        checks.integer("fingers", self.fingers, low=2, high=most)
        below = self.body.extent[2] / 2 - height
        if below > 0:
            raise InvalidValue(
                "center_height",
                height,
                f">= {self.body.extent[2] / 2:.6g} m, half of the object's height (it reaches"
                f" {below * 1e3:.4g} mm below the base plane)",
            )

    @property
    def bases(self) -> tuple[Pose, ...]:
        """Poses of the bases in the gripper's frame; +x of each points to the object."""
        r = self.base_radius
        if self.body.kind == "box":
            quarter = self.body.extent[1] / 4
            places = {
                2: [(0.0, 0.0), (180.0, 0.0)],
                3: [(0.0, 0.0), (180.0, quarter), (180.0, -quarter)],
                4: [(0.0, 0.0), (90.0, 0.0), (180.0, 0.0), (270.0, 0.0)],
            }[self.fingers]
        else:
            places = [(360 / self.fingers * k, 0.0) for k in range(self.fingers)]
        return tuple(_base(math.radians(degrees), r, aside) for degrees, aside in places)

    def section(self, finger: int) -> Section:
        """Return the object's section in the plane of a finger, seen from its base."""
        across = self.body.kind == "box" and self.fingers == 4 and finger % 2 == 1
        return self.body.section(self.base_radius, self.center_height, across)

    def obstacle(self) -> Obstacle:
        """Return the object as an obstacle in the gripper's frame."""
        center = np.array([0.0, 0.0, self.center_height])
        x, y, z = self.body.extent
        if self.body.kind == "sphere":
            return Sphere(center, x / 2, name="object")
        if self.body.kind == "cylinder":
            return Cylinder(center, np.array([0.0, 0.0, 1.0]), x / 2, name="object")
        size = np.array([x, y, z])
        return Box(center, size, edge_radius=self.body.corner_radius, name="object")

    def check_room(self, disk_radius: float) -> None:
        """Check that the base disks stand beside each other, and beside an infinite cylinder.

        Raises:
            InvalidValue: They do not, saying by how much.
        """
        positions = [base.position for base in self.bases]
        nearest = min(float(np.linalg.norm(a - b)) for a, b in combinations(positions, 2))
        if nearest < 2 * disk_radius:
            raise InvalidValue(
                "base_radius",
                self.base_radius,
                f"larger, or there must be fewer fingers: two bases are {nearest * 1e3:.4g} mm"
                f" apart, their disks {2e3 * disk_radius:.4g} mm wide",
            )
        least = self.body.extent[0] / 2 + disk_radius
        if self.body.kind == "cylinder" and self.base_radius < least:
            raise InvalidValue(
                "base_radius",
                self.base_radius,
                f">= {least:.6g} m, the cylinder's radius and the disks': the model's cylinder is"
                " infinite, and these bases would stand in it",
            )


def check_facing(finger: Finger, first_disk: int) -> None:
    """Check that a finger touches with modelled points: a hole, or the rim opposite to one.

    Raises:
        InvalidValue: From ``first_disk`` on, a disk has no cable hole that faces +x or -x.
    """
    for disk in range(first_disk, finger.segments + 1):
        angles = [float(c.angles[disk]) for c in finger.cables if disk <= c.last_disk]
        if not any(abs((a + math.pi / 2) % math.pi - math.pi / 2) <= _FACING for a in angles):
            raise InvalidValue(
                "finger",
                [round(math.degrees(a), 3) for a in angles],
                f"with a cable hole at 0 or 180 deg of disk {disk}: the model's contacts are at"
                " holes and opposite to them, and this disk faces the object with neither",
            )


def check_apart(shapes: list[np.ndarray], disk_radius: float, when: str) -> None:
    """Check that disks of different fingers do not come nearer than their diameter.

    Args:
        shapes: Disk centres (n+1, 3) of each finger in the gripper's frame [m].
        disk_radius: [m].
        when: Said in the error.

    Raises:
        InvalidValue: Two do; says which, and how near.
    """
    for (i, a), (j, b) in combinations(enumerate(shapes, 1), 2):
        gaps = np.linalg.norm(a[:, None] - b[None], axis=2)
        p, q = np.unravel_index(np.argmin(gaps), gaps.shape)
        if gaps[p, q] < 2 * disk_radius:
            raise InvalidValue(
                f"fingers {i} and {j}",
                float(gaps[p, q]),
                f"apart {when}: disk {p} of one and disk {q} of the other come within"
                f" {gaps[p, q] * 1e3:.3g} mm, less than a disk is wide, {2e3 * disk_radius:.4g} mm;"
                " take shorter fingers, a larger base radius, or fewer fingers",
            )


def check_above_bases(shapes: list[np.ndarray], disk_radius: float, when: str) -> None:
    """Check that fingers do not bend back down to what they stand on.

    Args:
        shapes: Disk centres (n+1, 3) of each finger in the gripper's frame [m].
        disk_radius: So far above the bases' plane disks must stay, or as far as the first one is
            if that is less [m].
        when: Said in the error.

    Raises:
        InvalidValue: One does not; says which disk, and how low.
    """
    for i, shape in enumerate(shapes, 1):
        height = shape[1:, 2]
        disk = 1 + int(np.argmin(height))
        least = min(disk_radius, float(height[0]))
        if shape[disk, 2] < least or least <= 0:
            raise InvalidValue(
                f"finger {i}",
                float(shape[disk, 2]),
                f">= {least:.4g} m above the plane of the bases {when}: disk {disk} comes down to"
                f" {shape[disk, 2] * 1e3:.3g} mm; take a smaller pull, or a higher object",
            )


def _base(azimuth: float, radius: float, aside: float) -> Pose:
    position = [
        radius * math.cos(azimuth) - aside * math.sin(azimuth),
        radius * math.sin(azimuth) + aside * math.cos(azimuth),
        0.0,
    ]
    half = math.remainder(azimuth + math.pi, 2 * math.pi) / 2  # x points back to the axis
    return Pose(
        np.array([round(v, 12) + 0.0 for v in position]),
        np.array([0.0, 0.0, math.sin(half), math.cos(half)]),
    )
