# SPDX-License-Identifier: Apache-2.0
"""From a wanted curve to a wanted shape: where on it the disks of a finger shall sit."""

from __future__ import annotations

import math

import numpy as np

from ..model.errors import InvalidValue
from ..model.finger import Finger
from ..model.result import disk_overlap
from .curves import Curve
from .target import DesiredShape

LENGTH_TOLERANCE = 1e-3  # of the finger's length: by so much a curve may be longer or shorter
START_TOLERANCE = 1e-3  # of the finger's length: by so much it may start beside the base
ANGLE_TOLERANCE = math.radians(1.0)  # by so much it may leave the base off +z
_SAMPLES = 32  # per segment, for the tightest bend and for where the curve meets itself


def place(curve: Curve, finger: Finger) -> DesiredShape:
    """Put the n + 1 disks of a finger on a curve, i * l0 of its arc length from the base.

    A curve that starts beside the base, within the tolerance, is moved there; one that is too
    short, within the tolerance, goes on straight, and one that is too long is cut.

    Returns:
        Disk centres and tangents; the twist is free.

    Raises:
        InvalidValue: The curve is not as long as the finger, within 0.1 %; does not start at the
            base, within 0.1 % of the length; does not leave it along +z, within 1 degree; is bent
            so tightly that neighbouring disks would cut each other; or comes round and runs
            through a disk. Says by how much.
    """
    what = f"curve {curve.name!r}"
    over = curve.length - finger.length
    if abs(over) > LENGTH_TOLERANCE * finger.length:
        raise InvalidValue(
            f"{what}: length",
            curve.length,
            f"the finger's, {finger.length:.6g} m, within {LENGTH_TOLERANCE:.1%}"
            f" (it is {abs(over) * 1e3:.4g} mm too {'long' if over > 0 else 'short'})",
        )
    _check_start(curve, finger, what)
    s = np.arange(finger.segments + 1) * finger.segment_length
    on_curve = np.minimum(s, curve.length)
    tangents = curve.tangents(on_curve)
    points = curve.points(on_curve) - curve.points(0.0) + (s - on_curve)[:, None] * tangents
    _check_bend(curve, finger, what)
    overlap = disk_overlap(points, tangents, finger.disk_radius)
    worst = int(np.argmax(overlap))
    if overlap[worst] > 0:
        raise InvalidValue(
            f"{what}: disks {worst} and {worst + 1}",
            points[worst : worst + 2],
            f"apart (they cut each other by {overlap[worst] * 1e3:.3g} mm: bend less tightly there,"
            " or take smaller or fewer disks)",
        )
    _check_crossing(curve, points, tangents, finger, what)
    return DesiredShape(points, tangents=tangents)


def _check_start(curve: Curve, finger: Finger, what: str) -> None:
    start, tangent = curve.points(0.0), curve.tangents(0.0)
    off = float(np.linalg.norm(start))
    if off > START_TOLERANCE * finger.length:
        raise InvalidValue(
            f"{what}: first point",
            start,
            f"at the base, the origin, within {START_TOLERANCE * finger.length * 1e3:.3g} mm"
            f" (it is {off * 1e3:.4g} mm away)",
        )
    angle = math.atan2(math.hypot(tangent[0], tangent[1]), tangent[2])
    if angle > ANGLE_TOLERANCE:
        raise InvalidValue(
            f"{what}: first tangent",
            tangent,
            f"along +z, within {math.degrees(ANGLE_TOLERANCE):g} deg, as the finger leaves its"
            f" base (it is {math.degrees(angle):.3g} deg off)",
        )


def _check_bend(curve: Curve, finger: Finger, what: str) -> None:
    s = np.linspace(0.0, curve.length, _SAMPLES * finger.segments + 1)
    curvature = curve.curvatures(s)
    worst = int(np.argmax(curvature))
    if curvature[worst] * finger.disk_radius >= 1.0:
        raise InvalidValue(
            f"{what}: curvature at {s[worst] * 1e3:.4g} mm",
            float(curvature[worst]),
            f"< {1 / finger.disk_radius:.6g} 1/m: bent to a radius of"
            f" {1e3 / curvature[worst]:.4g} mm there, the disks, of {finger.disk_radius * 1e3:.4g}"
            " mm, would meet",
        )


def _check_crossing(
    curve: Curve, points: np.ndarray, tangents: np.ndarray, finger: Finger, what: str
) -> None:
    step = finger.segment_length
    s = np.linspace(0.0, curve.length, _SAMPLES * finger.segments + 1)
    backbone = curve.points(s) - curve.points(0.0)
    for disk, (centre, axis) in enumerate(zip(points, tangents, strict=True)):
        height = (backbone - centre) @ axis
        through = np.flatnonzero((height[:-1] <= 0) != (height[1:] <= 0))
        # The segments that end at this disk are `disk_overlap`'s and the bend's.
        through = through[np.abs(s[through] - disk * step) > 1.5 * step]
        if not len(through):
            continue
        part = height[through] / (height[through] - height[through + 1])
        places = backbone[through] + part[:, None] * (backbone[through + 1] - backbone[through])
        aside = np.linalg.norm(places - centre, axis=1)
        nearest = int(np.argmin(aside))
        if aside[nearest] < finger.disk_radius:
            raise InvalidValue(
                f"{what}: at {s[through[nearest]] * 1e3:.4g} mm",
                places[nearest],
                f"clear of the finger itself: it runs through disk {disk} there,"
                f" {aside[nearest] * 1e3:.3g} mm from its centre; the disk's radius is"
                f" {finger.disk_radius * 1e3:.4g} mm",
            )
