# SPDX-License-Identifier: Apache-2.0
"""Wanted curves from a file of points."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..model.errors import InvalidFile, InvalidValue, MissingPackage
from .curves import NODES, WEIGHTS, Curve
from .table_file import read_table

UNITS = {"m": 1.0, "mm": 1e-3}
_FEWEST = 4
_NEWTON = 8


class SplineCurve(Curve):
    """A cubic spline (not-a-knot) through points, in the order given, by its arc length.

    The spline's parameter is the length along the chords; its arc length is Gauss and Legendre's
    quadrature on each piece, inverted by Newton's method.

    Args:
        name: What it is.
        points: (k, 3), k >= 4, no two neighbours the same [m].

    Raises:
        MissingPackage: SciPy is not installed.
    """

    def __init__(self, name: str, points: np.ndarray) -> None:
        try:
            from scipy.interpolate import CubicSpline
        except ImportError:
            raise MissingPackage("a curve through points", "scipy", "design") from None

        self.name = name
        chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
        self._knots = np.concatenate([[0.0], np.cumsum(chords)])
        self._spline = CubicSpline(self._knots, points)
        self._first, self._second = self._spline.derivative(1), self._spline.derivative(2)
        self._sums = np.concatenate([[0.0], np.cumsum(self._stretch(self._knots[:-1], chords))])
        self.length = float(self._sums[-1])

    def _stretch(self, start: np.ndarray, size: np.ndarray) -> np.ndarray:
        """Arc lengths (k,) of parts of pieces, from a parameter on."""
        slopes = self._first(start[:, None] + size[:, None] * NODES)
        return size * (np.linalg.norm(slopes, axis=2) @ WEIGHTS)

    def _parameters(self, s: np.ndarray) -> np.ndarray:
        """Parameters (k,) at arc lengths (k,)."""
        piece = np.clip(np.searchsorted(self._sums, s, side="right") - 1, 0, len(self._sums) - 2)
        start, size = self._knots[piece], np.diff(self._knots)[piece]
        part = size * (s - self._sums[piece]) / np.diff(self._sums)[piece]
        for _ in range(_NEWTON):
            error = self._stretch(start, part) - (s - self._sums[piece])
            part = part - error / np.linalg.norm(self._first(start + part), axis=1)
            part = np.clip(part, 0.0, size)
        return start + part

    def _points(self, s: np.ndarray) -> np.ndarray:
        return self._spline(self._parameters(s))

    def _tangents(self, s: np.ndarray) -> np.ndarray:
        slopes = self._first(self._parameters(s))
        return slopes / np.linalg.norm(slopes, axis=1, keepdims=True)

    def _curvatures(self, s: np.ndarray) -> np.ndarray:
        t = self._parameters(s)
        slopes = self._first(t)
        speed = np.linalg.norm(slopes, axis=1)
        return np.linalg.norm(np.cross(slopes, self._second(t)), axis=1) / speed**3


def load_curve(path: str | Path, unit: str = "m") -> Curve:
    """Read a curve from a CSV file: x, y, z of one point a line, from the base to the tip.

    The points are joined by a cubic spline; they should lie so densely that it does not matter
    which. A header is allowed.

    Args:
        path: The file.
        unit: Of its numbers, ``"m"`` or ``"mm"``.

    Raises:
        InvalidValue: An unknown unit.
        InvalidFile: The file cannot be read, a line is malformed, there are fewer than 4 points,
            a point is the one before again, or is more than 1 km away; says
            which line.
        MissingPackage: SciPy is not installed.
    """
    if unit not in UNITS:
        raise InvalidValue("unit", unit, f"one of {', '.join(UNITS)}")
    table = read_table(path, columns=3)
    points = table.values * UNITS[unit]
    if len(points) < _FEWEST:
        raise InvalidFile(path, f"holds {len(points)} points; at least {_FEWEST} are wanted")
    far = np.flatnonzero(np.abs(points).max(axis=1) > 1e3)
    if len(far):
        row = table.values[far[0]].tolist()
        raise InvalidFile(path, f"line {table.lines[far[0]]}: {row} is more than 1 km away")
    chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
    same = np.flatnonzero(chords <= 1e-9 * chords.sum())
    if len(same):
        row = table.values[same[0] + 1].tolist()
        raise InvalidFile(path, f"line {table.lines[same[0] + 1]}: {row} is the point before again")
    return SplineCurve(Path(path).name, points)
