# SPDX-License-Identifier: Apache-2.0
"""Segments between pairs of hole choices, solved near given tensions and kept.

A state is the choice of a hole for each of the C cables at one disk: with H holes on a disk there
are S = H^C. The states at both ends of a segment decide its shape (see `segments`). Lengths are
in units of L, tensions are T L^2 / EI.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .segments import SegmentModel

_TOLERANCE = 1e-7  # of y: far less than a micrometre at the tip


@dataclass(frozen=True, eq=False)
class Pieces:
    """Segments between hole choices at the table's tensions, and their change with each tension.

    Attributes:
        rotation, shift: (..., 3, 3) and (..., 3) from start to end.
        turn, drift: (..., C, 3) angular velocity and velocity of the end per tension.
        lengths: (..., C) of the spans; slack: (..., C) their lengths at rest.
        stretch: (..., C, C) of each length (first) per tension (last).
    """

    rotation: np.ndarray
    shift: np.ndarray
    turn: np.ndarray
    drift: np.ndarray
    lengths: np.ndarray
    slack: np.ndarray
    stretch: np.ndarray


class SegmentTable:
    """The segments of a finger between all hole choices; only what is asked for is solved."""

    def __init__(self, model: SegmentModel, angles: np.ndarray, tensions: np.ndarray) -> None:
        """Prepare a table for states with hole angles (S, C) [rad] at tensions (C,)."""
        self.tensions = tensions
        self._model = model
        self._angles = angles
        self._kinds, kind = np.unique(model.rest, axis=0, return_inverse=True)
        self._kind = kind.reshape(-1)
        states, cables = angles.shape
        self._states = states
        self._row: dict[int, int] = {}  # of a pair
        # One row a pair: rotation, shift, turn, drift, lengths, slack, stretch.
        self._ends = np.cumsum([9, 3, 3 * cables, 3 * cables, cables, cables, cables * cables])
        self._rows = np.empty((0, self._ends[-1]))

    def pieces(self, index: int | np.ndarray, start: np.ndarray, end: np.ndarray) -> Pieces:
        """Return segments ``index`` (from the base) between states; all three are broadcast."""
        keys = (self._kind[index] * self._states + start) * self._states + end
        each, which = np.unique(keys, return_inverse=True)
        known = self._row
        missing = [key for key in each.tolist() if key not in known]
        if missing:
            self._solve(np.array(missing))
        place = np.array([known[key] for key in each.tolist()])
        rows = self._rows[place[which.reshape(keys.shape)]]
        parts = np.split(rows, self._ends[:-1], axis=-1)
        shape, cables = keys.shape, len(self.tensions)
        forms = [(3, 3), (3,), (cables, 3), (cables, 3), (cables,), (cables,), (cables, cables)]
        return Pieces(*(p.reshape(*shape, *f) for p, f in zip(parts, forms, strict=True)))

    def _solve(self, keys: np.ndarray) -> None:
        kind, pair = np.divmod(keys, self._states**2)
        start, end = (self._angles[s] for s in np.divmod(pair, self._states))
        rest = self._kinds[kind]
        model, count = self._model, len(keys)
        at, hessian, good = model.solve(
            rest, start, end, np.broadcast_to(self.tensions, start.shape), tolerance=_TOLERANCE
        )
        slack = model.evaluate(rest, start, end).lengths
        change = model.per_tension(at, hessian)
        stretch = at.gradient @ change
        twists = (at.twists @ change).transpose(0, 2, 1)
        flat = [at.rotation, at.translation, twists[:, :, :3], twists[:, :, 3:], at.lengths, slack]
        rows = np.concatenate([a.reshape(count, -1) for a in (*flat, stretch)], axis=1)
        rows[~good] = np.nan  # no routing with this segment is among the nearest
        self._row.update((key, len(self._rows) + i) for i, key in enumerate(keys.tolist()))
        self._rows = np.concatenate([self._rows, rows])
