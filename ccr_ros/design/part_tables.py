# SPDX-License-Identifier: Apache-2.0
"""A finger's parts as CSV tables, in millimetres and degrees, for CAD programs and workshops."""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path

import numpy as np

from ..model.errors import InvalidFile
from .parts import FingerParts

_MM = 1e3
_XYZ = ("x", "y", "z")


def backbone_table(parts: FingerParts) -> str:
    """Return the centreline: x, y, z [mm] from the base to the tip; ``--curve`` reads it again."""
    return _csv(_XYZ, [_numbers(point * _MM) for point in parts.centers])


def disk_table(parts: FingerParts) -> str:
    """Return the disks' middle planes: index, centre [mm], normal, and direction of hole 1."""
    header = ("disk", *_XYZ, "normal_x", "normal_y", "normal_z", "hole1_x", "hole1_y", "hole1_z")
    rows = []
    for disk, at in enumerate(parts.disks):
        frame = parts.frames[at]
        rows.append(
            [
                str(disk),
                *_numbers(parts.centers[at] * _MM),
                *_numbers(frame[:, 2]),
                *_numbers(frame[:, 0]),
            ]
        )
    return _csv(header, rows)


def hole_table(parts: FingerParts) -> str:
    """Return the holes: disk, clock number, angle [deg], the cables in it, axis point [mm], axis.

    The clock number is 0 where a cable runs at an angle between the clock positions.
    """
    header = ("disk", "hole", "angle", "cables", *_XYZ, "axis_x", "axis_y", "axis_z")
    rows = []
    for hole in parts.holes:
        point, axis = parts.hole_axis(hole)
        rows.append(
            [
                str(hole.disk),
                str(hole.number),
                *_numbers([math.degrees(hole.angle)]),
                " ".join(hole.cables),
                *_numbers(point * _MM),
                *_numbers(axis),
            ]
        )
    return _csv(header, rows)


def write_tables(parts: FingerParts, folder: str | Path, stem: str) -> list[Path]:
    """Write the three tables as STEM_backbone.csv, STEM_disks.csv and STEM_holes.csv.

    Raises:
        InvalidFile: A file cannot be written.
    """
    tables = {"backbone": backbone_table, "disks": disk_table, "holes": hole_table}
    written = []
    for name, make in tables.items():
        path = Path(folder) / f"{stem}_{name}.csv"
        try:
            path.write_text(make(parts), encoding="utf-8")
        except OSError as error:
            raise InvalidFile(path, f"cannot be written: {error.strerror}") from None
        written.append(path)
    return written


def _numbers(values: np.ndarray | list[float]) -> list[str]:
    """Numbers to a nanometre, without a minus sign before zero."""
    return [f"{round(float(v), 6) + 0.0:.6f}" for v in values]


def _csv(header: tuple[str, ...], rows: list[list[str]]) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return out.getvalue()
