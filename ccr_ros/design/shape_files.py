# SPDX-License-Identifier: Apache-2.0
"""Wanted shapes from files: disk centres as CSV, or a pose that `ccr solve --json` printed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from ..model import checks
from ..model.errors import InvalidFile, InvalidValue
from ..model.rotation import matrix_from_quaternion
from ..model.yaml_reader import read_text
from .curve_files import UNITS
from .table_file import read_table
from .target import DesiredShape

_LARGEST = 20_000_000  # bytes
_BASE = 0.01  # of the length along the points: a measured base disk may lie so far off the origin


def load_shape(path: str | Path, unit: str = "m", frames: bool = True) -> DesiredShape:
    """Read where the disks shall be, from base to tip, in the frame of the base.

    A ``.json`` file holds a pose as ``ccr solve --json`` prints it: ``backbone``, the disk centres
    [m], and ``frames``, quaternions (x, y, z, w). Any other is CSV: x, y, z of one disk a line. The
    base disk is at the origin: where it was measured beside it, by up to 1 % of the length, it
    is put there.

    Args:
        path: The file.
        unit: Of the numbers in a CSV file, ``"m"`` or ``"mm"``.
        frames: Whether to use the frames of a JSON file; else the twist is free.

    Raises:
        InvalidFile: It cannot be read, or is not what it should be.
        InvalidValue: What it holds is no shape (see `DesiredShape`); the file is named.
    """
    if unit not in UNITS:
        raise InvalidValue("unit", unit, f"one of {', '.join(UNITS)}")
    quaternions = None
    if Path(path).suffix.lower() == ".json":
        pose = _pose(path)
        points, quaternions = pose["backbone"], pose.get("frames") if frames else None
    else:
        points = _at_base(read_table(path, columns=3).values * UNITS[unit])
    try:
        return DesiredShape(points, None if quaternions is None else _matrices(quaternions))
    except InvalidValue as error:
        raise error.located("", str(path)) from None


def _pose(path: str | Path) -> dict[str, Any]:
    try:
        pose = json.loads(read_text(path, _LARGEST))
    except (ValueError, RecursionError) as error:
        raise InvalidFile(path, f"is not JSON: {error}") from None
    if not isinstance(pose, dict) or "backbone" not in pose:
        raise InvalidFile(path, "has no 'backbone'; a pose of 'ccr solve --json' is wanted")
    return pose


def _matrices(quaternions: Any) -> np.ndarray:
    if not checks.is_list(quaternions):
        raise InvalidValue("frames", quaternions, "a list of quaternions (x, y, z, w)")
    return np.array(
        [
            matrix_from_quaternion(checks.quaternion(f"frames[{i}]", q))
            for i, q in enumerate(quaternions)
        ]
    )


def _at_base(points: np.ndarray) -> np.ndarray:
    length = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    if 0 < np.linalg.norm(points[0]) <= _BASE * length:
        points = np.concatenate([np.zeros((1, 3)), points[1:]])
    return points
