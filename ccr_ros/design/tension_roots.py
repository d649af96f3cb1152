# SPDX-License-Identifier: Apache-2.0
"""All tensions at which a finger's cables have the lengths that the pulls ask for."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np

from .rest_statics import RestStatics

_SAMPLES = 24  # of one cable's tension, values and slopes
_STARTS = 4  # per cable, where there are several
_MOST_STARTS = 64
_NEWTON = 40
_ZERO = 1e-13  # of the finger's length
_SAME = 1e-6  # relative; roots nearer to each other are one
_TRY_UP_TO = 1e4  # T L^2 / EI, where no bound on curvature ends the search


def taut_sets(count: int) -> Iterator[tuple[int, ...]]:
    """Yield the sets of cables that may be taut, largest first."""
    for size in range(count, -1, -1):
        yield from itertools.combinations(range(count), size)


def tension_roots(statics: RestStatics, taut: Sequence[int], count: int) -> list[np.ndarray]:
    """Return the tensions (m,) for which equation (2) holds for the taut cables, others slack.

    One cable's are all there are between 0 and the bound on the rest curvature, by scanning values
    and slopes; several cables' are those that Newton's method finds from a grid of starts.
    Tensions may come out negative there; sorted by the largest tension.
    """
    index = np.array(taut, dtype=int)
    if not len(index):
        return [np.zeros(count)]
    if len(index) == 1:
        return _scan(statics, int(index[0]), count)
    found: list[np.ndarray] = []
    for start in _starts(statics, index, count):
        root = _newton(statics, index, start)
        if root is not None and not any(_same(root, other) for other in found):
            found.append(root)
    return sorted(found, key=lambda t: float(np.abs(t).max()))


def _scan(statics: RestStatics, cable: int, count: int) -> list[np.ndarray]:
    unit = np.eye(count)[cable]
    end = min(statics.reach(np.zeros(count), unit), _TRY_UP_TO)
    if end <= 0:
        return []
    # Quadratic spacing: the first root, at a small tension, is the one that is mostly wanted.
    grid = end * (np.arange(_SAMPLES + 1) / _SAMPLES) ** 2
    values = [statics.missing(t * unit) for t in grid]
    g = np.array([v[cable] for v, _ in values])
    slope = np.array([j[cable, cable] for _, j in values])
    found: list[np.ndarray] = []
    for k in range(_SAMPLES):
        for low, high in _brackets(grid[k : k + 2], g[k : k + 2], slope[k : k + 2]):
            root = _bracketed(statics, cable, unit, low, high)
            if root is not None and not any(_same(root, other) for other in found):
                found.append(root)
    return found


def _brackets(t: np.ndarray, g: np.ndarray, slope: np.ndarray) -> list[tuple[float, float]]:
    """Parts of a step on which g changes its sign; two where it comes back in between.

    It may do so where the slopes at both ends are unlike and point to 0: the turning point of the
    cubic through values and slopes then splits the step.
    """
    if g[0] * g[1] < 0:
        return [(float(t[0]), float(t[1]))]
    if slope[0] * g[0] < 0 and slope[1] * g[1] > 0:
        h = t[1] - t[0]
        d = (g[1] - g[0]) / h
        a, b = slope[0] + slope[1] - 2 * d, 3 * d - 2 * slope[0] - slope[1]
        roots = np.roots([3 * a, 2 * b, slope[0]])
        inside = [float(r.real) for r in roots if abs(r.imag) < 1e-12 and 0 < r.real < 1]
        return [(float(t[0]), t[0] + h * r) for r in inside] + [
            (t[0] + h * r, float(t[1])) for r in inside
        ]
    return []


def _bracketed(
    statics: RestStatics, cable: int, unit: np.ndarray, low: float, high: float
) -> np.ndarray | None:
    """Newton's method kept between a change of sign; None if there is none."""
    sign = math.copysign(1.0, statics.missing(low * unit)[0][cable])
    value = statics.missing(high * unit)[0][cable]
    if sign * value > 0:
        return None
    t = 0.5 * (low + high)
    for _ in range(_NEWTON):
        values, slopes = statics.missing(t * unit)
        g, slope = float(values[cable]), float(slopes[cable, cable])
        if abs(g) < _ZERO:
            break
        low, high = (t, high) if g * sign > 0 else (low, t)
        step = t - g / slope if slope else low
        t = step if low < step < high else 0.5 * (low + high)
    return t * unit


def _starts(statics: RestStatics, index: np.ndarray, count: int) -> Iterator[np.ndarray]:
    """Tensions within the bound on the rest curvature, the smallest first."""
    units = np.eye(count)[index]
    ends = [min(statics.reach(np.zeros(count), u), _TRY_UP_TO) for u in units]
    per_cable = max(2, min(_STARTS, int(_MOST_STARTS ** (1 / len(index)))))
    steps = (np.arange(per_cable) / per_cable) ** 2
    for fractions in sorted(itertools.product(steps, repeat=len(index)), key=sum):
        way = sum(f * e * u for f, e, u in zip(fractions, ends, units, strict=True))
        start = np.asarray(way, dtype=float)
        if statics.reach(start, np.zeros(count)) > 0:
            yield start


def _newton(statics: RestStatics, index: np.ndarray, start: np.ndarray) -> np.ndarray | None:
    t = start.copy()
    values, jacobian = statics.missing(t)
    for _ in range(_NEWTON):
        g = values[index]
        size = float(np.abs(g).max())
        if size < _ZERO:
            return t if statics.reach(t, np.zeros(len(t))) > 0 else None
        try:
            step = np.linalg.solve(jacobian[np.ix_(index, index)], -g)
        except np.linalg.LinAlgError:
            return None
        # Roots with too much curvature at rest are not wanted, and beyond all shapes are wild.
        way = np.zeros(len(t))
        way[index] = step
        step = step * min(1.0, 0.9 * statics.reach(t, way))
        for _ in range(8):
            trial = t.copy()
            trial[index] += step
            values, jacobian = statics.missing(trial)
            if float(np.abs(values[index]).max()) < size:
                break
            step = 0.5 * step
        else:
            return t if size < 10 * _ZERO else None
        t = trial
    return None


def _same(a: np.ndarray, b: np.ndarray) -> bool:
    scale = max(float(np.abs(a).max()), float(np.abs(b).max()), 1e-9)
    return float(np.abs(a - b).max()) < _SAME * scale
