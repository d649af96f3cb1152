# SPDX-License-Identifier: Apache-2.0
"""Routings laid disk by disk from the base, many at once, and their errors from a wanted shape.

Tensions are unknown while a routing is laid. Its error is therefore kept as a quadratic in the
change d of the tensions from the table's (`segments` are linear in it to first order),

    sum over disks of |e_i + D_i d|^2 = ee + 2 ed.d + d.dd.d,

whose minimum ranks routings that are not complete. For a complete one the pulls give d.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..model.rotation import cross
from .routing_table import SegmentTable

_LEAST = 1e-10  # of a cable's yielding, relative


@dataclass(frozen=True, eq=False)
class Target:
    """Wanted disks and pulls in units of L.

    Attributes:
        points: (n+1, 3) disk centres.
        frames: (n+1, 3, 3), or ``None`` where the twist is unknown.
        tangents: (n+1, 3), or ``None``; not used where there are frames.
        lever: What turns the error of an angle [rad] into one of position.
        fractions, pulls: (C,) a cable's pull is its fraction of the rest length plus its pull.
    """

    points: np.ndarray
    frames: np.ndarray | None
    tangents: np.ndarray | None
    lever: float
    fractions: np.ndarray
    pulls: np.ndarray

    def errors(self, disk: int, rotation: np.ndarray, position: np.ndarray) -> np.ndarray:
        """Errors (b, m) of poses (b, 3, 3), (b, 3) of a disk, all as positions."""
        off = position - self.points[disk]
        if self.frames is not None:
            turned = rotation @ self.frames[disk].T
            axial = turned[:, [2, 0, 1], [1, 2, 0]] - turned[:, [1, 2, 0], [2, 0, 1]]
            return np.concatenate([off, 0.5 * self.lever * axial], axis=1)
        if self.tangents is not None:
            tilt = self.lever * (rotation[:, :, 2] - self.tangents[disk])
            return np.concatenate([off, tilt], axis=1)
        return off

    def slopes(
        self, disk: int, rotation: np.ndarray, turn: np.ndarray, drift: np.ndarray
    ) -> np.ndarray:
        """Change (b, k, m) of these errors with angular velocities and velocities (b, k, 3).

        Of frames to first order in their error.
        """
        if self.frames is not None:
            return np.concatenate([drift, self.lever * turn], axis=2)
        if self.tangents is not None:
            tilt = self.lever * cross(turn, rotation[:, None, :, 2])
            return np.concatenate([drift, tilt], axis=2)
        return drift


@dataclass(frozen=True, eq=False)
class Chain:
    """Routings (b,) laid up to one disk, at the tensions of a table.

    Attributes:
        states: (b, i+1) choice of holes at each disk.
        rotation, position: (b, 3, 3) and (b, 3) of the last disk.
        turn, drift: (b, C, 3) its angular velocity and velocity per tension.
        lengths, slack, stretch: Sums over the segments of what `Pieces` has.
        ee, ed, dd: (b,), (b, C), (b, C, C) the errors' quadratic.
    """

    states: np.ndarray
    rotation: np.ndarray
    position: np.ndarray
    turn: np.ndarray
    drift: np.ndarray
    lengths: np.ndarray
    slack: np.ndarray
    stretch: np.ndarray
    ee: np.ndarray
    ed: np.ndarray
    dd: np.ndarray

    @classmethod
    def at_base(cls, states: np.ndarray, cables: int) -> Chain:
        """Begin routings at the base disk with states (b,)."""
        b, c = len(states), cables
        frames = np.tile(np.eye(3), (b, 1, 1))
        shapes = (b, 3), (b, c, 3), (b, c, 3), (b, c), (b, c), (b, c, c), (b,), (b, c), (b, c, c)
        return cls(states[:, None], frames, *(np.zeros(shape) for shape in shapes))

    def costs(self, prior: np.ndarray) -> np.ndarray:
        """Least errors (b,) over the change of tensions, held back by prior (C, C)."""
        best = np.linalg.solve(self.dd + prior, self.ed[:, :, None])[:, :, 0]
        return self.ee - (self.ed * best).sum(axis=1)

    def settled(self, target: Target) -> tuple[np.ndarray, np.ndarray]:
        """Changes of tensions (b, C) that give complete routings the target's pulls, and errors."""
        wanted = self.slack * (1.0 - target.fractions) - target.pulls
        # Two cables through the same holes share their tension evenly.
        least = _LEAST * np.trace(self.stretch, axis1=1, axis2=2)
        stretch = self.stretch + least[:, None, None] * np.eye(len(target.pulls))
        change = np.linalg.solve(stretch, (wanted - self.lengths)[:, :, None])[:, :, 0]
        bent = (self.dd @ change[:, :, None])[:, :, 0]
        return change, self.ee + (change * (2.0 * self.ed + bent)).sum(axis=1)

    def only(self, rows: np.ndarray) -> Chain:
        """The routings of the given rows."""
        return Chain(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))


def extended(
    chain: Chain, rows: np.ndarray, states: np.ndarray, table: SegmentTable, target: Target
) -> Chain:
    """Lay the routings ``rows`` (m,) of a chain on to states (m,) at the next disk."""
    disk = chain.states.shape[1]
    piece = table.pieces(disk - 1, chain.states[rows, -1], states)
    before = chain.rotation[rows]
    back = before.transpose(0, 2, 1)
    step = (before @ piece.shift[:, :, None])[:, :, 0]
    position = chain.position[rows] + step
    turn = chain.turn[rows]
    drift = chain.drift[rows] + cross(turn, step[:, None]) + piece.drift @ back
    turn = turn + piece.turn @ back
    rotation = before @ piece.rotation
    e = target.errors(disk, rotation, position)
    d = target.slopes(disk, rotation, turn, drift)
    return Chain(
        np.concatenate([chain.states[rows], states[:, None]], axis=1),
        rotation,
        position,
        turn,
        drift,
        chain.lengths[rows] + piece.lengths,
        chain.slack[rows] + piece.slack,
        chain.stretch[rows] + piece.stretch,
        chain.ee[rows] + (e * e).sum(axis=1),
        chain.ed[rows] + (d @ e[:, :, None])[:, :, 0],
        chain.dd[rows] + d @ d.transpose(0, 2, 1),
    )


def laid(routings: np.ndarray, table: SegmentTable, target: Target) -> Chain:
    """Lay complete routings (b, n+1), given by their states."""
    chain = Chain.at_base(routings[:, 0], len(table.tensions))
    rows = np.arange(len(routings))
    for disk in range(1, routings.shape[1]):
        chain = extended(chain, rows, routings[:, disk], table, target)
    return chain
