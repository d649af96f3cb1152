# SPDX-License-Identifier: Apache-2.0
"""The description of a cable-driven continuum finger: geometry, material, routing, rest shape."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import checks
from .errors import InvalidValue, UnknownName
from .obstacles import Obstacle
from .rest_curvature import checked_rest_curvature

MAX_SEGMENTS = 1000
_TINY, _HUGE = 1e-6, 1e3  # m; between these a length is believed


@dataclass(frozen=True, eq=False)
class Cable:
    """One cable and its routing.

    Attributes:
        name: Unique in its finger.
        angles: (k+1,) hole angle [rad] at disks 0 (base) to k, about +z from +x of the disk;
            the cable ends at disk k, which may lie before the tip.
    """

    name: str
    angles: np.ndarray

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", checks.name("name", self.name))
        count = len(self.angles) if checks.is_list(self.angles) else 0
        if count < 2:
            raise InvalidValue("angles", self.angles, "a list of at least 2 hole angles [rad]")
        object.__setattr__(self, "angles", checks.vector("angles", self.angles, count, unit="rad"))

    @property
    def last_disk(self) -> int:
        """Index of the disk at which the cable ends."""
        return len(self.angles) - 1

    @classmethod
    def from_holes(cls, name: str, holes: Sequence[int], holes_per_disk: int = 12) -> Cable:
        """Make a cable from clock holes 1..holes_per_disk: k at 2 pi (k - 1) / holes_per_disk."""
        if not checks.is_list(holes):
            raise InvalidValue("holes", holes, "a list of hole numbers, one per disk from the base")
        if len(holes) < 2:
            raise InvalidValue("holes", holes, "a list of at least 2 hole numbers")
        numbers = [
            checks.integer(f"holes[{i}]", h, low=1, high=holes_per_disk)
            for i, h in enumerate(holes)
        ]
        return cls(name, np.array([2 * math.pi * (h - 1) / holes_per_disk for h in numbers]))


@dataclass(frozen=True, eq=False)
class Finger:
    """A cable-driven continuum finger at rest; its frame is the base disk's, z along the backbone.

    Attributes:
        name: Name of the finger.
        length: Backbone length L0 [m].
        segments: Number n of segments, each of length L0 / n; there are n + 1 disks.
        disk_radius: Distance a of the cable holes from the backbone [m].
        backbone_diameter: Of the circular backbone [m].
        poisson_ratio: nu of the backbone; GJ / EI = 1 / (1 + nu).
        cables: The cables, in the order in which pulls are given.
        youngs_modulus: E [Pa], or ``None``: forces are then per EI.
        rest_curvature: (n, 3) curvature [1/m] of each segment at rest, in the frame that is carried
            along it; or (n, 2 k, 3): at the start and at the end of each of its k equal pieces,
            linear between.
        holes_per_disk: Number of clock holes on a disk.
        obstacles: What the finger may touch, in the frame of its base.
    """

    name: str
    length: float
    segments: int
    disk_radius: float
    backbone_diameter: float
    poisson_ratio: float
    cables: tuple[Cable, ...]
    youngs_modulus: float | None = None
    rest_curvature: np.ndarray | None = None
    holes_per_disk: int = 12
    obstacles: tuple[Obstacle, ...] = ()

    def __post_init__(self) -> None:
        def put(key: str, value: Any) -> None:
            object.__setattr__(self, key, value)

        put("name", checks.label("name", self.name))
        put("length", checks.real("length", self.length, low=_TINY, high=_HUGE, unit="m"))
        put("segments", checks.integer("segments", self.segments, low=2, high=MAX_SEGMENTS))
        radius = checks.real(
            "disk_radius", self.disk_radius, low=_TINY, below=self.length, unit="m"
        )
        put("disk_radius", radius)
        put(
            "backbone_diameter",
            checks.real(
                "backbone_diameter", self.backbone_diameter, low=_TINY, below=2 * radius, unit="m"
            ),
        )
        put("poisson_ratio", checks.real("poisson_ratio", self.poisson_ratio, above=-1, high=0.5))
        if self.youngs_modulus is not None:
            modulus = checks.real(
                "youngs_modulus", self.youngs_modulus, low=1, high=1e15, unit="Pa"
            )
            put("youngs_modulus", modulus)
        put(
            "holes_per_disk",
            checks.integer("holes_per_disk", self.holes_per_disk, low=1, high=3600),
        )
        rest = checked_rest_curvature(
            self.rest_curvature, self.segments, *self.largest_rest_curvature
        )
        put("rest_curvature", rest)
        put("cables", self._checked_cables())
        put("obstacles", self._checked_obstacles())

    def _checked_cables(self) -> tuple[Cable, ...]:
        if not isinstance(self.cables, list | tuple) or not self.cables:
            raise InvalidValue("cables", self.cables, "a list of at least one cable")
        cables = tuple(self.cables)
        seen: set[str] = set()
        for j, cable in enumerate(cables):
            if not isinstance(cable, Cable):
                raise InvalidValue(f"cables[{j}]", cable, "a Cable")
            if cable.last_disk > self.segments:
                raise InvalidValue(
                    f"cables[{j}].angles",
                    cable.angles,
                    f"a list of 2..{self.segments + 1} numbers, one per disk from the base"
                    f" (got {len(cable.angles)})",
                )
            if cable.name in seen:
                raise InvalidValue(f"cables[{j}].name", cable.name, "unique in its finger")
            seen.add(cable.name)
        return cables

    def _checked_obstacles(self) -> tuple[Obstacle, ...]:
        if not isinstance(self.obstacles, list | tuple):
            raise InvalidValue("obstacles", self.obstacles, "a list of obstacles")
        for i, obstacle in enumerate(self.obstacles):
            if not isinstance(obstacle, Obstacle):
                allowed = "an obstacle (Sphere, Box, Cylinder, ConvexMesh, ...)"
                raise InvalidValue(f"obstacles[{i}]", obstacle, allowed)
            self.check_clear_of_base(obstacle, f"obstacles[{i}]")
        return tuple(self.obstacles)

    def check_clear_of_base(self, obstacle: Obstacle, place: str) -> None:
        """Check that an obstacle, in the frame of the base, leaves the base disk's points free.

        Raises:
            InvalidValue: It does not; the error is located at ``place``.
        """
        angles = np.array([cable.angles[0] for cable in self.cables])
        holes = self.disk_radius * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
        points = np.concatenate([np.zeros((1, 3)), holes, -holes])
        deepest = float(obstacle.signed_distance(points).min())
        if deepest < 0:
            raise InvalidValue(
                place,
                f"{type(obstacle).__name__.lower()} {obstacle.name}",
                f"clear of the base disk of finger {self.name!r}"
                f" (it overlaps the disk by {-deepest * 1e3:.3g} mm)",
            )

    @property
    def segment_length(self) -> float:
        """Length l0 of a segment [m]."""
        return self.length / self.segments

    @property
    def largest_rest_curvature(self) -> tuple[float, float]:
        """Bending and twist [1/m] that the rest curvature stays below, anywhere."""
        half_turn = math.pi / self.segment_length
        return min(1.0 / self.disk_radius, half_turn), half_turn

    @property
    def rest_varies(self) -> bool:
        """Whether the rest curvature varies along segments."""
        return np.asarray(self.rest_curvature).ndim == 3

    @property
    def rest_pieces(self) -> int:
        """Number k of pieces of a segment along which the rest curvature is linear."""
        return np.asarray(self.rest_curvature).shape[1] // 2 if self.rest_varies else 1

    @property
    def rest_curvature_ends(self) -> np.ndarray:
        """Rest curvature (n, k, 2, 3) [1/m] at the start and the end of each segment's pieces."""
        rest = np.asarray(self.rest_curvature)
        if self.rest_varies:
            return rest.reshape(self.segments, -1, 2, 3)
        return np.repeat(rest[:, None, None, :], 2, axis=2)

    @property
    def second_moment(self) -> float:
        """Second moment of area I = pi d^4 / 64 of the backbone [m^4]."""
        return math.pi * self.backbone_diameter**4 / 64

    @property
    def bending_stiffness(self) -> float:
        """EI [N m^2]; 1 when no Young's modulus is given, so that forces come out per EI."""
        return 1.0 if self.youngs_modulus is None else self.youngs_modulus * self.second_moment

    @property
    def torsion_ratio(self) -> float:
        """GJ / EI = 1 / (1 + nu) of a circular section (Eq. 3's D)."""
        return 1.0 / (1.0 + self.poisson_ratio)

    @property
    def forces_are(self) -> str:
        """``"newton"`` or ``"per_EI"`` [1/m^2]."""
        return "per_EI" if self.youngs_modulus is None else "newton"

    @property
    def cable_names(self) -> tuple[str, ...]:
        """Names of the cables, in the order in which pulls are given."""
        return tuple(c.name for c in self.cables)

    def pulls_array(self, pulls: Mapping[str, float] | Sequence[float] | np.ndarray) -> np.ndarray:
        """Return checked pulls (m,) [m] from a mapping by cable name (absent: 0) or a sequence.

        Raises:
            UnknownName: A name that is no cable of this finger.
            InvalidValue: Wrong count, or a pull that is not finite or beyond twice the finger's
                length either way; the solver knows each cable's own limit.
        """
        if isinstance(pulls, Mapping):
            for key in pulls:
                if key not in self.cable_names:
                    raise UnknownName("cable", key, self.cable_names)
            values: list[Any] = [pulls.get(c, 0.0) for c in self.cable_names]
        else:
            if not checks.is_list(pulls) or getattr(pulls, "ndim", 1) != 1:
                raise InvalidValue("pulls", pulls, f"{len(self.cables)} numbers [m], one per cable")
            values = list(pulls)
            if len(values) != len(self.cables):
                raise InvalidValue(
                    "pulls",
                    values,
                    f"{len(self.cables)} numbers [m], one per cable (got {len(values)})",
                )
        limit = 2 * self.length
        return np.array(
            [
                checks.real(f"pulls.{c}", v, low=-limit, high=limit, unit="m")
                for c, v in zip(self.cable_names, values, strict=True)
            ]
        )
