# SPDX-License-Identifier: Apache-2.0
"""All tensions at which a finger's cables have the lengths that the pulls ask for."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from .rest_statics import RestStatics

_SAMPLES = 8  # of one cable's tension, values and slopes
_STARTS = 3  # per cable, where there are several
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

    def missing(t: float) -> tuple[float, float]:
        values, slopes = statics.missing(t * unit)
        return float(values[cable]), float(slopes[cable, cable])

    nodes = [(float(t), *missing(float(t))) for t in grid]
    found: list[np.ndarray] = []
    for low, high in itertools.pairwise(nodes):
        for part in _parts(low, high, missing):
            root = _bracketed(missing, *part) * unit
            if not any(_same(root, other) for other in found):
                found.append(root)
    return found


_Node = tuple[float, float, float]  # tension, value, slope


def _parts(
    low: _Node, high: _Node, missing: Callable[[float], tuple[float, float]]
) -> list[tuple[_Node, _Node]]:
    """Parts of a step on which the value changes its sign; two where it comes back in between.

    It may do so where the slopes at both ends are unlike and point to 0: the turning point of the
    cubic through values and slopes then splits the step.
    """
    if low[1] * high[1] < 0:
        return [(low, high)]
    if low[2] * low[1] < 0 and high[2] * high[1] > 0:
        h = high[0] - low[0]
        d = (high[1] - low[1]) / h
        a, b = low[2] + high[2] - 2 * d, 3 * d - 2 * low[2] - high[2]
        for root in np.roots([3 * a, 2 * b, low[2]]):
            if abs(root.imag) < 1e-12 and 0 < root.real < 1:
                t = low[0] + h * float(root.real)
                middle = (t, *missing(t))
                if middle[1] * low[1] < 0:
                    return [(low, middle), (middle, high)]
    return []


def _bracketed(missing: Callable[[float], tuple[float, float]], low: _Node, high: _Node) -> float:
    """Newton's method kept between a change of sign, from where the chord is 0."""
    a, b = low[0], high[0]
    t = (a * high[1] - b * low[1]) / (high[1] - low[1])
    for _ in range(_NEWTON):
        value, slope = missing(t)
        if abs(value) < _ZERO:
            break
        a, b = (t, b) if value * low[1] > 0 else (a, t)
        step = t - value / slope if slope else a
        t = step if a < step < b else 0.5 * (a + b)
    return t


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
