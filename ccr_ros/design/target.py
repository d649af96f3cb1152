# SPDX-License-Identifier: Apache-2.0
"""The wanted shape of a finger: where its disks shall be once the cables are pulled.

A curve (`curves`) gives one by placing the disks along its arc; every inverse problem takes one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ccr_ros.model import checks
from ccr_ros.model.errors import InvalidValue
from ccr_ros.model.finger import MAX_SEGMENTS, Finger
from ccr_ros.model.solution import Solution

_AT_BASE = 1e-9  # m; the first disk is the base disk
_START = math.radians(1.0)  # a curve read from measured points may start so far off +z
_UNIT = 1e-6  # of a unit vector's length, and of a frame's orthogonality
_LONGER = 1e-9  # relative; by this much two disks may be farther apart than a segment is long


@dataclass(frozen=True, eq=False)
class DesiredShape:
    """Where the n + 1 disks shall be, in the frame of the finger's base; read-only arrays.

    Attributes:
        points: (n+1, 3) disk centres [m], base to tip, at arc lengths i * l0 of the wanted curve;
            the first is the origin.
        frames: (n+1, 3, 3) disk frames (columns are the axes, z along the backbone), or ``None``:
            the twist is free.
        tangents: (n+1, 3) unit tangents of the wanted curve at the disks, or ``None``: unknown.
            Where frames are given, their z axes.

    Raises:
        InvalidValue: Wrong shapes, numbers that are not finite, a first point off the origin, a
            first tangent off +z or a first frame that is not the base's, saying by how much.
    """

    points: np.ndarray
    frames: np.ndarray | None = None
    tangents: np.ndarray | None = None

    def __post_init__(self) -> None:
        points = _array("points", self.points, (3,), "m")
        off = float(np.linalg.norm(points[0]))
        if off > _AT_BASE:
            raise InvalidValue(
                "points[0]",
                points[0],
                f"at the base, the origin (it is {off * 1e3:.6g} mm away)",
            )
        frames, tangents = self.frames, self.tangents
        if frames is not None:
            frames = _array("frames", frames, (3, 3), "", len(points))
            _check_frames(frames)
            if tangents is not None:
                raise InvalidValue("tangents", tangents, "left out where frames are given")
            tangents = frames[:, :, 2].copy()
        if tangents is not None:
            tangents = _array("tangents", tangents, (3,), "", len(points))
            _check_tangents(tangents)
        for name, value in (("points", points), ("frames", frames), ("tangents", tangents)):
            if value is not None:
                value.setflags(write=False)
            object.__setattr__(self, name, value)

    @classmethod
    def of(cls, solution: Solution, frames: bool = True) -> DesiredShape:
        """Return the shape of a solved pose, with its frames or with its tangents alone."""
        if frames:
            return cls(solution.backbone, solution.frames)
        return cls(solution.backbone, tangents=solution.frames[:, :, 2])

    @property
    def segments(self) -> int:
        """Number n of segments; there are n + 1 points."""
        return len(self.points) - 1

    def errors(self, backbone: np.ndarray) -> np.ndarray:
        """Return the distances (n+1,) [m] of disk centres (n+1, 3) [m] from the wanted ones."""
        return np.linalg.norm(np.asarray(backbone) - self.points, axis=1)

    def squared_error(self, backbone: np.ndarray) -> float:
        """Return the paper's Eq. 7, the sum of the squared disk errors [m^2]."""
        return float(np.sum((np.asarray(backbone) - self.points) ** 2))

    def check_count(self, finger: Finger) -> None:
        """Check that there is one point for each disk of the finger.

        Raises:
            InvalidValue: There is not.
        """
        if self.segments != finger.segments:
            raise InvalidValue(
                "points",
                self.points,
                f"{finger.segments + 1} points, one per disk of finger {finger.name!r}"
                f" (got {len(self.points)})",
            )

    def check_fits(self, finger: Finger) -> None:
        """Check that the finger's inextensible segments can span the points.

        Raises:
            InvalidValue: Another number of disks, or neighbours farther apart than a segment is
                long, saying which and by how much.
        """
        self.check_count(finger)
        spans = np.linalg.norm(np.diff(self.points, axis=0), axis=1)
        over = spans / finger.segment_length - 1.0
        worst = int(np.argmax(over))
        if over[worst] > _LONGER:
            raise InvalidValue(
                f"points[{worst + 1}]",
                self.points[worst + 1],
                f"within a segment's length, {finger.segment_length * 1e3:.6g} mm, of the point"
                f" before (it is {over[worst] * finger.segment_length * 1e3:.6g} mm farther)",
            )


def _array(
    place: str, value: Any, item: tuple[int, ...], unit: str, count: int | None = None
) -> np.ndarray:
    """Return a writable copy (count, *item) of nested lists or an array of finite numbers."""
    shape = " x ".join(str(k) for k in item)
    number = "at least 3" if count is None else str(count)
    allowed = f"{number} items of {shape} finite numbers" + (f" [{unit}]" if unit else "")
    if not checks.is_list(value):
        raise InvalidValue(place, value, allowed)
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise InvalidValue(place, value, allowed) from None
    wrong_count = not 3 <= len(array) <= MAX_SEGMENTS + 1 if count is None else len(array) != count
    if array.shape[1:] != item or wrong_count:
        raise InvalidValue(place, value, f"{allowed} (got an array of shape {array.shape})")
    bad = np.argwhere(~np.isfinite(array))
    if len(bad):
        where = "".join(f"[{i}]" for i in bad[0])
        raise InvalidValue(f"{place}{where}", float(array[tuple(bad[0])]), "a finite number")
    return array


def _check_tangents(tangents: np.ndarray) -> None:
    lengths = np.linalg.norm(tangents, axis=1)
    worst = int(np.argmax(np.abs(lengths - 1.0)))
    if abs(lengths[worst] - 1.0) > _UNIT:
        raise InvalidValue(
            f"tangents[{worst}]", tangents[worst], f"of length 1 (it is {lengths[worst]:.9g})"
        )
    angle = math.atan2(math.hypot(tangents[0, 0], tangents[0, 1]), tangents[0, 2])
    if angle > _START:
        raise InvalidValue(
            "tangents[0]",
            tangents[0],
            "along +z, as the finger leaves its base"
            f" (it is {math.degrees(angle):.3g} deg off, {math.degrees(_START):g} are allowed)",
        )


def _check_frames(frames: np.ndarray) -> None:
    off = np.abs(frames.transpose(0, 2, 1) @ frames - np.eye(3)).max(axis=(1, 2))
    off = np.maximum(off, np.abs(np.linalg.det(frames) - 1.0))
    worst = int(np.argmax(off))
    if off[worst] > _UNIT:
        raise InvalidValue(
            f"frames[{worst}]", frames[worst], f"a rotation matrix (it is {off[worst]:.3g} off)"
        )
    turn = math.acos(min(1.0, max(-1.0, (float(np.trace(frames[0])) - 1.0) / 2)))
    if turn > _START:
        raise InvalidValue(
            "frames[0]",
            frames[0],
            f"the base's own frame, the identity (it is turned by {math.degrees(turn):.3g} deg)",
        )
