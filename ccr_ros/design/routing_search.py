# SPDX-License-Identifier: Apache-2.0
"""The best routings through given holes: beam search from base to tip, then exchanges.

Bending and twist of a segment follow from its two holes and the tension (`segments`), so the disks
that a routing's first holes place are known before its last holes are chosen. Routings are laid
disk by disk, and the ``width`` nearest to the wanted shape are kept. This is done at some tensions,
the likeliest first (`routing_tensions`), until one gives the shape.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from .routing_chain import Chain, Target, extended, laid
from .routing_forecast import Forecast
from .routing_table import SegmentTable
from .routing_tensions import likely_tensions
from .segments import SegmentModel

_SPREAD = {1: 0.12, 2: 0.4}  # of the tensions about those tried, relative
_SETTLED = 0.03  # tensions that change by less are not tried again, relative
_NOISE = 1e-3  # of positions, units of L, against which the spread is held
GOOD = 1e-4  # RMS error of a disk, units of L, at which no further tensions are tried
_SMALL = 2  # changes of hole that are tried first where there are two cables
_MARGIN = 2  # times as many as are kept are laid exactly
_KEPT = 24  # routings that go from one stage to the next
_ROUNDS = 30  # of exchanges
_AGAIN = {1: 0, 2: 4}  # routings at whose tensions is searched again, and so many times each


@dataclass(frozen=True, eq=False)
class Found:
    """A routing: states (n+1,), its predicted tensions (C,), and its sum of squared errors."""

    states: tuple[int, ...]
    tensions: np.ndarray
    cost: float


class RoutingSearch:
    """Searches routings of C cables through H holes on every disk.

    Args:
        model: The finger's segments.
        holes: (H,) hole angles [rad], evenly spaced.
        target: Wanted disks and pulls.
        width: Number of routings that are kept at a disk.
        most: Largest change of hole from a disk to the next; ``None``: any.
        good: RMS error of a disk, units of L, with which the search is content.
    """

    def __init__(
        self,
        model: SegmentModel,
        holes: np.ndarray,
        target: Target,
        width: int,
        most: int | None = None,
        good: float = GOOD,
    ) -> None:
        self.model = model
        self.holes = holes
        self.target = target
        self.width = width
        self.cables = len(target.pulls)
        self.forecast = Forecast(model, holes, target)
        self.most = most
        self.good = good
        self.choices = np.array(list(product(range(len(holes)), repeat=self.cables)))  # (S, C)
        self._limit(most)

    def run(self) -> list[Found]:
        """Return the best routings found, nearest to the wanted shape first, each once."""
        kept: list[Found] = []
        # Of two cables so many routings come near that the search may miss the one that gives the
        # shape; one with small changes is likelier meant, rubs less, and is among fewer.
        for most in [_SMALL, self.most] if self.cables > 1 and self.most is None else [self.most]:
            self._limit(most)
            small = most is not None and most <= _SMALL
            kept = self._merged(kept, self._searched(small))
            if self._rms(kept) < self.good:
                break
        return self._exchanged(kept)

    def _limit(self, most: int | None) -> None:
        """Allow changes of hole up to ``most`` from a disk to the next."""
        count = len(self.holes)
        most = count if most is None else most
        change = np.abs(self.choices[:, None] - self.choices)
        self._allowed = (np.minimum(change, count - change) <= most).all(axis=2)

    def _searched(self, small: bool) -> list[Found]:
        kept: list[Found] = []
        heads: list[Found] = []
        for tensions in likely_tensions(self.model, self.target, small):
            found = self._beam(self._table(tensions), _SPREAD[self.cables])
            heads.append(found[0])
            kept = self._merged(kept, found)
            if self._rms(kept) < self.good:
                return kept
        return self._again(kept, heads)

    def _again(self, kept: list[Found], heads: list[Found]) -> list[Found]:
        """Search at the tensions of the best routings found, and at those that come of it."""
        done: list[np.ndarray] = []
        good = sorted((f for f in heads if np.isfinite(f.cost)), key=lambda f: f.cost)
        for head in good[: _AGAIN[self.cables]]:
            tensions = head.tensions
            for _ in range(_AGAIN[self.cables]):
                if any(np.abs(tensions / other - 1.0).max() < _SETTLED for other in done):
                    break
                done.append(tensions)
                found = self._beam(self._table(tensions), _SETTLED)
                kept = self._merged(kept, found)
                if self._rms(kept) < self.good:
                    return kept
                if not np.isfinite(found[0].cost):
                    break
                tensions = found[0].tensions
        return kept

    def _exchanged(self, kept: list[Found]) -> list[Found]:
        """Exchange holes of the best routing while that brings it nearer."""
        for _ in range(_ROUNDS):
            best = kept[0]
            if not np.isfinite(best.cost):
                break
            table = self._table(best.tensions)
            kept = self._merged(self._evaluated(self._around(kept), table))
            if kept[0].states == best.states:
                break
        return kept

    def _table(self, tensions: np.ndarray) -> SegmentTable:
        return SegmentTable(self.model, self.holes[self.choices], tensions)

    def _rms(self, found: list[Found]) -> float:
        return float(np.sqrt(max(found[0].cost, 0.0) / len(self.target.points)))

    def _beam(self, table: SegmentTable, spread: float) -> list[Found]:
        prior = np.diag((_NOISE / (spread * table.tensions)) ** 2)
        chain = Chain.at_base(np.arange(len(self.choices)), self.cables)
        for _ in range(len(self.target.points) - 1):
            holes = self.choices[chain.states[:, -1]]
            likely = self.forecast.costs(chain, holes, table.tensions, prior)
            likely = likely.reshape(self._allowed[chain.states[:, -1]].shape)
            likely[~self._allowed[chain.states[:, -1]]] = np.inf
            likely = likely.ravel()
            best = _lowest(likely, _MARGIN * self.width)
            best = best[np.isfinite(likely[best])]
            rows, states = np.divmod(best, len(self.choices))
            chain = extended(chain, rows, states, table, self.target)
            chain = chain.only(_lowest(chain.costs(prior), self.width))
        return self._found(chain, table)

    def _found(self, chain: Chain, table: SegmentTable) -> list[Found]:
        change, cost = chain.settled(self.target)
        tensions = table.tensions + change
        cost = np.where((tensions > 0).all(axis=1) & np.isfinite(cost), cost, np.inf)
        best = np.argsort(cost)[:_KEPT]
        return [Found(tuple(chain.states[i].tolist()), tensions[i], float(cost[i])) for i in best]

    def _evaluated(self, routings: np.ndarray, table: SegmentTable) -> list[Found]:
        return self._found(laid(routings, table, self.target), table)

    def _merged(self, *lists: list[Found]) -> list[Found]:
        once: dict[tuple[int, ...], Found] = {}
        for found in sorted((f for some in lists for f in some), key=lambda f: f.cost):
            once.setdefault(found.states, found)
        return list(once.values())[:_KEPT]

    def _around(self, kept: list[Found]) -> np.ndarray:
        """The kept routings, and all that differ from the best by an exchange."""
        count, cables, best = len(self.holes), self.cables, np.array(kept[0].states)
        disks = len(best)
        new: list[np.ndarray] = [np.array([f.states for f in kept])]
        for disk in range(disks):  # any other choice at one disk
            some = np.tile(best, (len(self.choices), 1))
            some[:, disk] = np.arange(len(self.choices))
            new.append(some)
        place = count ** np.arange(cables)[::-1]
        holes = self.choices[best]
        pairs = np.array(list(product(range(count), repeat=2)))
        for disk in range(disks - 1):  # any two holes of one cable at neighbouring disks
            for cable in range(cables):
                some = np.tile(holes, (len(pairs), 1, 1))
                some[:, disk : disk + 2, cable] = pairs
                new.append(some @ place)
        for disk in range(disks):  # all from a disk on turned by a hole
            for turn in (-1, 1):
                some = holes.copy()
                some[disk:] = (some[disk:] + turn) % count
                new.append((some @ place)[None])
        routings = np.unique(np.concatenate(new), axis=0)
        return routings[self._allowed[routings[:, :-1], routings[:, 1:]].all(axis=1)]


def _lowest(costs: np.ndarray, count: int) -> np.ndarray:
    """Indices of the ``count`` lowest."""
    return np.argpartition(costs, count)[:count] if count < len(costs) else np.arange(len(costs))
