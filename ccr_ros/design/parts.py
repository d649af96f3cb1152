# SPDX-License-Identifier: Apache-2.0
"""The parts of a finger at rest, as they are made: backbone, disks, and holes where cables run."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..model import checks
from ..model.equilibrium import EquilibriumProblem
from ..model.errors import InvalidValue
from ..model.finger import Finger
from ..model.result import disk_overlap
from ..model.settings import SolverSettings

_STEPS = 16  # backbone points per segment, at least
_SAME = 1e-9  # rad; holes no farther apart are one


@dataclass(frozen=True)
class PrintOptions:
    """What a finger file does not say of the parts; the defaults are the paper's prototypes'.

    Attributes:
        disk_thickness: [m].
        hole_diameter: Of the cable holes [m].
        outer_radius: Of the disks [m]; ``None``: one hole diameter beyond the holes' centres.
        plate_diameter: Of a round base plate under the base disk [m]; 0: none.
        plate_thickness: Of the base plate [m].
        routed_only: Only the holes that a cable runs through, instead of all clock holes.

    Raises:
        InvalidValue: A value out of its range.
    """

    disk_thickness: float = 0.002
    hole_diameter: float = 0.00125
    outer_radius: float | None = None
    plate_diameter: float = 0.0
    plate_thickness: float = 0.004
    routed_only: bool = False

    def __post_init__(self) -> None:
        for key in ("disk_thickness", "hole_diameter", "plate_thickness"):
            checks.real(key, getattr(self, key), low=1e-5, high=1.0, unit="m")
        if self.outer_radius is not None:
            checks.real("outer_radius", self.outer_radius, low=1e-5, high=1.0, unit="m")
        checks.real("plate_diameter", self.plate_diameter, low=0, high=1.0, unit="m")


@dataclass(frozen=True)
class Hole:
    """A hole through a disk.

    Attributes:
        disk: Index of the disk, 0 = base.
        angle: About the disk's z axis from its x axis [rad], in [0, 2 pi).
        number: Clock number, 1 at angle 0; 0 if it is at no clock position.
        cables: Names of the cables that run through it.
    """

    disk: int
    angle: float
    number: int
    cables: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class FingerParts:
    """A finger at rest, in the frame of its base.

    Attributes:
        finger: The finger.
        options: How it is made; ``outer_radius`` is set.
        centers: (k, 3) points of the backbone [m], close together; the disks' are among them.
        frames: (k, 3, 3) frames there; columns are the axes, z along the backbone.
        disks: (n+1,) index of each disk's point.
        holes: All holes, by disk and angle.
    """

    finger: Finger
    options: PrintOptions
    centers: np.ndarray
    frames: np.ndarray
    disks: np.ndarray
    holes: tuple[Hole, ...]

    @property
    def outer_radius(self) -> float:
        """Radius of the disks [m]."""
        return self.options.outer_radius or self.finger.disk_radius + self.options.hole_diameter

    def hole_axis(self, hole: Hole) -> tuple[np.ndarray, np.ndarray]:
        """Return a hole's centre on its disk's middle plane (3,) [m], and its direction (3,)."""
        at = self.disks[hole.disk]
        radius = self.finger.disk_radius
        offset = radius * np.array([math.cos(hole.angle), math.sin(hole.angle), 0.0])
        return self.centers[at] + self.frames[at] @ offset, self.frames[at][:, 2]


def finger_parts(finger: Finger, options: PrintOptions | None = None) -> FingerParts:
    """Lay out the parts of a finger.

    Raises:
        InvalidValue: Holes that cut each other, the backbone or the rim of their disk, disks that
            cut each other, or a base plate smaller than the base disk; says by how much.
    """
    options = options or PrintOptions()
    if options.outer_radius is None:
        options = replace(options, outer_radius=finger.disk_radius + options.hole_diameter)
    problem = EquilibriumProblem(
        replace(finger, obstacles=()), SolverSettings(arcs_per_segment=_STEPS)
    )
    rest = problem.rest.rod
    parts = FingerParts(
        finger=finger,
        options=options,
        centers=rest.positions * finger.length,
        frames=rest.rotations,
        disks=np.arange(finger.segments + 1) * problem.arcs_per_segment,
        holes=_holes(finger, options),
    )
    _check_disk(parts)
    _check_gaps(parts)
    return parts


def _holes(finger: Finger, options: PrintOptions) -> tuple[Hole, ...]:
    """All holes: the cables', and the clock holes that do not cut one of these."""
    holes: list[Hole] = []
    count = finger.holes_per_disk
    apart = 2 * math.asin(min(1.0, options.hole_diameter / (2 * finger.disk_radius)))
    for disk in range(finger.segments + 1):
        used: dict[float, tuple[str, ...]] = {}
        for cable in finger.cables:
            if disk <= cable.last_disk:
                angle = float(cable.angles[disk]) % (2 * math.pi)
                same = next((a for a in used if _between(a, angle) <= _SAME), angle)
                used[same] = (*used.get(same, ()), cable.name)
        clock = [] if options.routed_only else [2 * math.pi * k / count for k in range(count)]
        free = [a for a in clock if all(_between(a, b) > apart for b in used)]
        for angle in sorted([*used, *free]):
            turns = angle * count / (2 * math.pi)
            at_clock = abs(turns - round(turns)) * 2 * math.pi / count <= _SAME
            number = round(turns) % count + 1 if at_clock else 0
            holes.append(Hole(disk, angle, number, used.get(angle, ())))
    return tuple(holes)


def _between(a: float, b: float) -> float:
    return abs((a - b + math.pi) % (2 * math.pi) - math.pi)


def _check_disk(parts: FingerParts) -> None:
    finger, options, outer = parts.finger, parts.options, parts.outer_radius
    widest = 2 * finger.disk_radius - finger.backbone_diameter
    if options.hole_diameter >= widest:
        raise InvalidValue(
            "hole_diameter",
            options.hole_diameter,
            f"< {widest:.6g} m, or holes cut the backbone",
        )
    rim = finger.disk_radius + options.hole_diameter / 2
    if outer <= rim:
        raise InvalidValue("outer_radius", outer, f"> {rim:.6g} m, or holes cut the disk's rim")
    if 0 < options.plate_diameter < 2 * outer:
        raise InvalidValue(
            "plate_diameter", options.plate_diameter, f">= {2 * outer:.6g} m, the disks' diameter"
        )
    for a, b in zip(parts.holes, parts.holes[1:] + parts.holes[:1], strict=True):
        gap = 2 * finger.disk_radius * math.sin(_between(a.angle, b.angle) / 2)
        if a.disk == b.disk and a is not b and gap <= options.hole_diameter:
            raise InvalidValue(
                "hole_diameter",
                options.hole_diameter,
                f"< {gap:.6g} m: two holes of disk {a.disk} are no farther apart; drill only those"
                " that cables run through, or make them smaller",
            )


def _check_gaps(parts: FingerParts) -> None:
    axes = parts.frames[parts.disks][:, :, 2]
    overlap = disk_overlap(parts.centers[parts.disks], axes, parts.outer_radius)
    overlap = overlap + parts.options.disk_thickness
    worst = int(np.argmax(overlap))
    if overlap[worst] >= 0:
        raise InvalidValue(
            "disk_thickness",
            parts.options.disk_thickness,
            f"less by {overlap[worst] * 1e3:.3g} mm, or the disks smaller: at rest disks {worst}"
            f" and {worst + 1} would touch",
        )
