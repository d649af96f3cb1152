# SPDX-License-Identifier: Apache-2.0
"""Rows of a Newton step that fingers share: gaps of disks, and how pairs' forces join fingers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .disks import NearDisks


@dataclass(frozen=True, eq=False)
class Shared:
    """The s rows that several fingers have a part in; in the hand's units.

    The Hessian that joins fingers, ways' stiffness ways, is put in as rows with a compliance: a row
    r with force m such that r.step = m / stiffness.

    Attributes:
        rows: Per finger (s, N).
        values: (s,) room of gaps; 0 of ways.
        active: (s,) as a guess.
        along: (s,) no inequalities: ways.
        yields: (s,) compliances; 0 of gaps.
        gaps: (k,) which pairs of disks the first k rows are.
    """

    rows: tuple[np.ndarray, ...]
    values: np.ndarray
    active: np.ndarray
    along: np.ndarray
    yields: np.ndarray
    gaps: np.ndarray

    def __len__(self) -> int:
        return len(self.values)


def shared_rows(
    near_disks: NearDisks | None, sizes: Sequence[int], gaps: np.ndarray, convex: bool = False
) -> Shared:
    """Return the rows of some pairs' gaps and of all pairs' ways.

    Args:
        near_disks: Disks near each other; None: they do not count.
        sizes: Number of coordinates of each finger.
        gaps: Which pairs enter with their gap.
        convex: Only the part of the joining Hessian that is positive.
    """
    if near_disks is None or not len(near_disks):
        none, no = np.zeros(0), np.zeros(0, dtype=bool)
        rows = tuple(np.zeros((0, size)) for size in sizes)
        return Shared(rows, none, no, no, none, np.zeros(0, dtype=int))
    kept = np.flatnonzero(near_disks.stiffness > 0) if convex else slice(None)
    stiffness = near_disks.stiffness[kept]
    count, ways = len(gaps), len(stiffness)
    return Shared(
        rows=tuple(
            np.concatenate([row[gaps], way[kept]])
            for row, way in zip(near_disks.rows, near_disks.ways, strict=True)
        ),
        values=np.concatenate([near_disks.near.gaps[gaps], np.zeros(ways)]),
        active=np.concatenate([near_disks.active[gaps], np.ones(ways, dtype=bool)]),
        along=np.arange(count + ways) >= count,
        yields=np.concatenate([np.zeros(count), 1.0 / stiffness]),
        gaps=gaps,
    )
