# SPDX-License-Identifier: Apache-2.0
"""Friction's part in a Newton step: the ways along the surface that are constrained."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from .assembly import FingerBlock
from .friction import RHO


@dataclass(frozen=True, eq=False)
class Surface:
    """A finger's friction in a step: rows beside those of its lengths and normals.

    Attributes:
        rows: (s, N) and columns: (s, 6) ways along the surface that are constrained.
        axes: (s, g, 2) what forces they stand for, on the contacts' tangents.
        ways: (s,) the rows' values; forces: (s,) that they have now.
        yields: (s,) their compliances, in the finger's own units.
        sticks: (s,) whether the way must vanish.
        drag: (g, 2) mu times the direction of a slipping contact's force; 0 where it sticks.
        slips: (l,) which contacts slip.
        turning: (N + 6, N + 6) what `turning` says of them, in the coordinates and q; None: none.
    """

    rows: np.ndarray
    columns: np.ndarray
    axes: np.ndarray
    ways: np.ndarray
    forces: np.ndarray
    yields: np.ndarray
    sticks: np.ndarray
    drag: np.ndarray
    slips: np.ndarray
    turning: np.ndarray | None


def surface_of(part: FingerBlock) -> Surface:
    """Return a finger's friction, linearised at a point of the search."""
    friction = part.friction
    count = len(friction)
    if not count:
        return _none(part.point.rows.shape[1])
    drag = np.zeros((count, 2))
    axes, yields, sticks = [], [], []
    for k in range(count):
        if not friction.slips[k]:
            for i in range(2):
                axis = np.zeros((count, 2))
                axis[k, i] = 1.0
                axes.append(axis)
                yields.append(0.0)
                sticks.append(True)
            continue
        trial = friction.forces[k] + RHO * friction.ways[k]
        size = float(np.linalg.norm(trial))
        way = trial / size
        share = min(1.0, float(friction.limits[k]) / size)
        drag[k] = way * float(friction.limits[k] / part.point.multipliers[friction.index[k]])
        axis = np.zeros((count, 2))
        axis[k] = -way[1], way[0]
        axes.append(axis)
        yields.append((1.0 - share) / max(share * RHO, 1e-9))
        sticks.append(False)
    which = np.array(axes)
    flat = which.reshape(len(axes), 2 * count)
    return Surface(
        rows=flat @ friction.rows.reshape(2 * count, -1),
        columns=flat @ friction.columns.reshape(2 * count, 6),
        axes=which,
        ways=flat @ friction.ways.ravel(),
        forces=flat @ friction.forces.ravel(),
        yields=np.array(yields),
        sticks=np.array(sticks, dtype=bool),
        drag=drag,
        slips=np.flatnonzero(friction.slips),
        turning=_turning(part) if friction.slips.any() else None,
    )


def _turning(part: FingerBlock) -> np.ndarray:
    """How forces left over change as the surface turns under friction forces F that slip.

    F turns with the object and stays along the surface. As the point moves by u over it, the
    surface's normal n turns by H u, H the Hessian of the distance, and F loses n (F . H u).
    """
    friction, point = part.friction, part.point
    slips = friction.slips
    index, tangents = friction.index[slips], friction.tangents[slips]
    bends = point.curvatures[index - len(point.tensions)]
    bent = friction.forces[slips, None] @ (tangents @ bends @ tangents.transpose(0, 2, 1))
    ways = np.concatenate([friction.rows[slips], friction.columns[slips]], axis=2)
    normals = np.concatenate([point.rows[index], part.columns[index]], axis=1)
    return normals.T @ (bent @ ways)[:, 0]


@lru_cache(maxsize=16)
def _none(size: int) -> Surface:
    """No friction, of a finger of so many coordinates."""
    none, flags = np.empty(0), np.empty(0, dtype=bool)
    return Surface(
        rows=np.empty((0, size)), columns=np.empty((0, 6)), axes=np.empty((0, 0, 2)), ways=none,
        forces=none, yields=none, sticks=flags, drag=np.empty((0, 2)),
        slips=np.empty(0, dtype=int), turning=None,
    )  # fmt: skip
