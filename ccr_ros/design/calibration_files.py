# SPDX-License-Identifier: Apache-2.0
"""Measurements from a CSV file: pulls, positions and loads by the names of their columns."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ccr_ros.model.errors import CcrError, InvalidFile, InvalidValue
from ccr_ros.model.finger import Finger
from ccr_ros.model.solver import FingerSolver
from ccr_ros.model.yaml_reader import read_text

from .calibration_model import Measurement
from .curve_files import UNITS

_LARGEST = 20_000_000  # bytes
GRAM = 9.80665e-3  # N, standard gravity

#: For help texts: what the columns of a file may be.
COLUMNS = """\
  finger                          the finger of the row: a file or a name in config/
  pull_CABLE, pull_CABLE_percent  [m], or [%] of the cable's rest length; the cable's far end
  tip_x, tip_y, tip_z             the tip's centre [m, or --unit], in the frame of the base
  disk3_x, disk3_y, disk3_z       the same of disk 3 (0 is the base)
  load_CABLE, load_CABLE_gram     tension of the cable [N], or the weight that pulls it [g]"""

_POSITION = re.compile(r"(tip|disk(\d{1,4}))_([xyz])")


def read_measurements(
    path: str | Path, load: Callable[[str], Finger], finger: Finger | None, unit: str = "m"
) -> list[Measurement]:
    """Read measured rows; an empty cell is not measured.

    Args:
        path: CSV with a header of names as in `COLUMNS`; lines that begin with ``#`` are comments.
        load: Finds the finger that a cell of the column ``finger`` names.
        finger: Of the rows without such a cell.
        unit: Of positions, ``"m"`` or ``"mm"``.

    Raises:
        InvalidFile: It cannot be read, a column or a value is not what it may be, or a row has
            no finger: says which line and column.
    """
    text = read_text(path, _LARGEST)
    lines = [
        (i, s) for i, s in enumerate(text.splitlines(), 1) if s.strip() and s.strip()[0] != "#"
    ]
    if len(lines) < 2:
        raise InvalidFile(path, "a header and at least one row are wanted")
    try:
        cells = [next(csv.reader([line], strict=True, skipinitialspace=True)) for _, line in lines]
    except csv.Error as error:
        raise InvalidFile(path, f"is not valid CSV: {error}") from None
    header = [name.strip() for name in cells[0]]
    for name in header:
        if header.count(name) > 1:
            raise InvalidFile(path, f"column {name!r} is there more than once")
    fingers: dict[str, Finger] = {}
    rows = []
    for (number, _), values in zip(lines[1:], cells[1:], strict=True):
        if len(values) != len(header):
            wanted = f"{len(header)} values as in the header are wanted"
            raise InvalidFile(path, f"line {number}: {len(values)} values; {wanted}")
        given = {n: v.strip() for n, v in zip(header, values, strict=True) if v.strip()}
        try:
            name = given.pop("finger", "")
            if name and name not in fingers:
                fingers[name] = load(name)
            one = fingers[name] if name else finger
            if one is None:
                raise InvalidValue("finger", None, "named in the row, or for all rows")
            rows.append(_row(one, given, UNITS[unit], f"line {number}"))
        except InvalidFile:
            raise
        except CcrError as error:
            text = str(error)
            place = "" if text.startswith(f"line {number}") else f"line {number}: "
            raise InvalidFile(path, f"{place}{text}") from None
    return rows


def _row(finger: Finger, given: dict[str, str], unit: float, label: str) -> Measurement:
    cables = finger.cable_names
    lengths = dict(zip(cables, FingerSolver(finger).rest_lengths, strict=True))
    pulls: dict[str, float] = {}
    loads: dict[str, float] = {}
    places: dict[int, dict[str, float]] = {}
    for name, text in given.items():
        value = _number(name, text)
        kind, _, rest = name.partition("_")
        cable = rest if rest in cables else rest.removesuffix("_percent").removesuffix("_gram")
        suffix = rest.removeprefix(cable)
        position = _POSITION.fullmatch(name)
        if position:
            disk = finger.segments if position[1] == "tip" else int(position[2])
            axes = places.setdefault(disk, {})
            if position[3] in axes:
                raise InvalidValue(name, value, "given once: tip and last disk are the same")
            axes[position[3]] = value * unit
        elif kind == "pull" and cable in cables and suffix in ("", "_percent"):
            scale = lengths[cable] / 100 if suffix else 1.0
            _once(pulls, cable, name, value)
            pulls[cable] = value * scale
        elif kind == "load" and cable in cables and suffix in ("", "_gram"):
            _once(loads, cable, name, value)
            loads[cable] = value * (GRAM if suffix else 1.0)
        else:
            allowed = f"a column as of `ccr design fit --help`; cables: {', '.join(cables)}"
            raise InvalidValue("column", name, allowed)
    positions = {}
    for disk, axes in places.items():
        if set(axes) != set("xyz"):
            missing = ", ".join(sorted(set("xyz") - set(axes)))
            raise InvalidValue(
                f"position of disk {disk}", None, f"given in full ({missing} missing)"
            )
        positions[disk] = np.array([axes["x"], axes["y"], axes["z"]])
    return Measurement(finger, pulls, positions, loads, label)


def _once(values: dict[str, float], cable: str, column: str, value: float) -> None:
    if cable in values:
        raise InvalidValue(column, value, f"the only column of cable {cable}")


def _number(column: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InvalidValue(column, text, "a finite number")
    return value
