# SPDX-License-Identifier: Apache-2.0
"""Wanted backbone curves: points and tangents along their arc length, in the finger's base frame.

A curve starts at the base; z is along the finger there and x is forward. The named families (arc,
S, helix) stand here; curves from a file are in `curve_files`, contours of objects in `contours`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np

from ..model import checks
from ..model.errors import InvalidValue

# Nodes and weights of Gauss and Legendre on [0, 1]: exact for polynomials of degree 15.
NODES, WEIGHTS = (x / 2 for x in np.polynomial.legendre.leggauss(8))
NODES = NODES + 0.5
_PANELS = 64
_SLACK = 1e-9  # of the length: arc lengths that rounding has put beyond an end


class Curve(ABC):
    """A smooth curve, known by its arc length.

    Attributes:
        name: What it is, for messages and plots.
        length: Arc length of the whole curve [m].
    """

    name: str
    length: float

    @abstractmethod
    def _points(self, s: np.ndarray) -> np.ndarray:
        """Points (k, 3) at checked arc lengths (k,)."""

    @abstractmethod
    def _tangents(self, s: np.ndarray) -> np.ndarray:
        """Unit tangents (k, 3) at checked arc lengths (k,)."""

    @abstractmethod
    def _curvatures(self, s: np.ndarray) -> np.ndarray:
        """Curvatures (k,), >= 0, at checked arc lengths (k,)."""

    def points(self, s: np.ndarray | float) -> np.ndarray:
        """Return the points (..., 3) [m] at arc lengths ``s`` (...) [m].

        Raises:
            InvalidValue: An arc length is not in 0..``length``.
        """
        flat, shape = self._checked(s)
        return self._points(flat).reshape(*shape, 3)

    def tangents(self, s: np.ndarray | float) -> np.ndarray:
        """Return the unit tangents (..., 3) at arc lengths ``s`` (...); errors as in `points`."""
        flat, shape = self._checked(s)
        return self._tangents(flat).reshape(*shape, 3)

    def curvatures(self, s: np.ndarray | float) -> np.ndarray:
        """Return the curvature (...), >= 0 [1/m], at arc lengths ``s`` (...); errors as above."""
        flat, shape = self._checked(s)
        return self._curvatures(flat).reshape(shape)

    def _checked(self, s: np.ndarray | float) -> tuple[np.ndarray, tuple[int, ...]]:
        array = np.asarray(s, dtype=float)
        slack = _SLACK * self.length
        bad = ~((array >= -slack) & (array <= self.length + slack))
        if bad.any():
            allowed = f"an arc length 0..{self.length:.6g} [m]"
            raise InvalidValue("s", float(array[bad].flat[0]), allowed)
        return np.clip(array.ravel(), 0.0, self.length), array.shape


class PlanarCurve(Curve):
    """A curve in a plane that holds the z axis, given by its heading along the arc length.

    The heading is the tangent's angle from z towards the plane's own forward direction. Positions
    are its quadrature by Gauss and Legendre, in panels that end at the breaks.

    Args:
        name: What it is.
        length: Arc length [m].
        heading: Heading [rad] at arc lengths (k,) -> (k,), continuous.
        bend: Its derivative, the signed curvature [1/m], (k,) -> (k,).
        direction: Angle [rad] of the plane's forward direction about z from x.
        breaks: Arc lengths [m] at which the curvature or a derivative of it jumps.
    """

    def __init__(
        self,
        name: str,
        length: float,
        heading: Callable[[np.ndarray], np.ndarray],
        bend: Callable[[np.ndarray], np.ndarray],
        direction: float = 0.0,
        breaks: tuple[float, ...] = (),
    ) -> None:
        self.name, self.length = name, length
        self._heading, self._bend = heading, bend
        self._forward = np.array([math.cos(direction), math.sin(direction), 0.0])
        inner = [b for b in breaks if 0 < b < length]
        self._grid = np.unique(np.concatenate([np.linspace(0, length, _PANELS + 1), inner]))
        steps = self._stretch(self._grid[:-1], np.diff(self._grid))
        self._sums = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])

    def _stretch(self, start: np.ndarray, size: np.ndarray) -> np.ndarray:
        """Advance (k, 2), forward and up, over stretches without a break inside."""
        psi = self._heading((start[:, None] + size[:, None] * NODES).ravel()).reshape(
            -1, len(NODES)
        )
        return size[:, None] * np.stack([np.sin(psi) @ WEIGHTS, np.cos(psi) @ WEIGHTS], axis=1)

    def _space(self, forward: np.ndarray, up: np.ndarray) -> np.ndarray:
        return forward[:, None] * self._forward + up[:, None] * np.array([0.0, 0.0, 1.0])

    def _points(self, s: np.ndarray) -> np.ndarray:
        panel = np.clip(np.searchsorted(self._grid, s, side="right") - 1, 0, len(self._grid) - 2)
        start = self._grid[panel]
        return self._space(*(self._sums[panel] + self._stretch(start, s - start)).T)

    def _tangents(self, s: np.ndarray) -> np.ndarray:
        psi = self._heading(s)
        return self._space(np.sin(psi), np.cos(psi))

    def _curvatures(self, s: np.ndarray) -> np.ndarray:
        return np.abs(self._bend(s))


class Helix(Curve):
    """A helix of constant curvature and torsion that leaves the base along z.

    Its axis is square to the principal normal at the base and inclined to z by the pitch angle,
    so that the tangent there is z. Source: the closed form of the SE(3) exponential.
    """

    def __init__(
        self, name: str, length: float, curvature: float, torsion: float, direction: float
    ) -> None:
        self.name, self.length = name, length
        self._curvature = curvature
        # The Darboux vector tau t + kappa b, at the base: the axis about which the frame turns.
        normal = np.array([math.cos(direction), math.sin(direction), 0.0])
        along = np.array([0.0, 0.0, 1.0])
        self._turn = torsion * along + curvature * np.cross(along, normal)

    def _angles(self, s: np.ndarray) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
        rate = float(np.linalg.norm(self._turn))
        axis = self._turn / rate
        across = np.cross(axis, [0.0, 0.0, 1.0])
        return rate, rate * s[:, None], across, np.cross(axis, across)

    def _points(self, s: np.ndarray) -> np.ndarray:
        rate, angle, across, back = self._angles(s)
        up = s[:, None] * np.array([0.0, 0.0, 1.0])
        return up + ((1 - np.cos(angle)) * across + (angle - np.sin(angle)) * back) / rate

    def _tangents(self, s: np.ndarray) -> np.ndarray:
        _, angle, across, back = self._angles(s)
        return np.array([0.0, 0.0, 1.0]) + np.sin(angle) * across + (1 - np.cos(angle)) * back

    def _curvatures(self, s: np.ndarray) -> np.ndarray:
        return np.full(len(s), self._curvature)


def arc(length: float, angle: float, direction: float = 0.0) -> Curve:
    """Return a circular arc.

    Args:
        length: Arc length [m].
        angle: How far the tip is turned from the base [rad], not 0, at most a whole turn.
        direction: Angle about z from x of the direction it bends to [rad].

    Raises:
        InvalidValue: A value out of its range.
    """
    length, direction = _shared(length, direction)
    angle = _bend("angle", angle, 2 * math.pi)
    rate = angle / length
    name = f"arc of {math.degrees(angle):g}°"
    return PlanarCurve(name, length, lambda s: rate * s, lambda s: np.full(len(s), rate), direction)


def s_curve(length: float, angle: float, direction: float = 0.0) -> Curve:
    """Return an S: its curvature is one period of a sine, so the tip looks the base's way again.

    The paper's pre-bent fingers of section 3 have this rest shape.

    Args:
        length: Arc length [m].
        angle: How far its middle is turned from the base [rad], not 0, at most half a turn.
        direction: Angle about z from x of the direction it first bends to [rad].

    Raises:
        InvalidValue: A value out of its range.
    """
    length, direction = _shared(length, direction)
    angle = _bend("angle", angle, math.pi)
    rate = 2 * math.pi / length
    return PlanarCurve(
        f"S of {math.degrees(angle):g}°",
        length,
        lambda s: angle / 2 * (1 - np.cos(rate * s)),
        lambda s: angle / 2 * rate * np.sin(rate * s),
        direction,
    )


def helix(length: float, radius: float, turns: float, direction: float = 0.0) -> Curve:
    """Return a helix that leaves the base along z.

    Args:
        length: Arc length [m].
        radius: Of the cylinder it lies on [m].
        turns: How often it goes round; positive: right-handed.
        direction: Angle about z from x of the direction it first bends to [rad].

    Raises:
        InvalidValue: A value out of its range, or a length too short for that many turns.
    """
    length, direction = _shared(length, direction)
    radius = checks.real("radius", radius, above=0, high=1e3, unit="m")
    turns = checks.real("turns", turns, low=-100, high=100)
    round_trip = 2 * math.pi * abs(turns) * radius
    if not 0 < round_trip < length:
        allowed = f"not 0, and |turns| < {length / (2 * math.pi * radius):.4g}: a length of"
        allowed += f" {length * 1e3:.4g} mm goes round a radius of {radius * 1e3:.4g} mm no oftener"
        raise InvalidValue("turns", turns, allowed)
    rate = 2 * math.pi * turns / length  # of the frame about the helix's axis, per arc length
    curvature = rate * rate * radius
    torsion = math.copysign(math.sqrt(rate * rate - curvature * curvature), turns)
    name = f"helix of {turns:g} turns, radius {radius * 1e3:g} mm"
    return Helix(name, length, curvature, torsion, direction)


def _shared(length: float, direction: float) -> tuple[float, float]:
    checked = checks.real("length", length, above=0, high=1e3, unit="m")
    return checked, checks.real("direction", direction, unit="rad")


def _bend(place: str, value: float, largest: float) -> float:
    angle = checks.real(place, value, low=-largest, high=largest, unit="rad")
    if abs(angle) < 1e-9:
        raise InvalidValue(place, value, f"not 0, from {-largest:.4g} to {largest:.4g} [rad]")
    return angle
