# SPDX-License-Identifier: Apache-2.0
"""The best routings through given holes: beam search from base to tip, then exchanges.

Bending and twist of a segment follow from its two holes and the tension (`segments`), so the disks
that a routing's first holes place are known before its last holes are chosen. Routings are laid
disk by disk, and the ``width`` nearest to the wanted shape are kept. This is done at a ladder of
tensions, from what the pull alone needs on parallel holes upwards.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from .routing_chain import Chain, Target, extended, laid
from .routing_table import SegmentTable
from .segments import SegmentModel

# A cable through parallel holes has T = pull / a^2 (EI = L = 1); crossing ones bend a rod less.
# Measured on random routings: 0.99 to 2.1.
_LADDER = {1: np.geomspace(1.03, 2.9, 6), 2: np.array([0.8, 1.3, 2.1])}
_SPREAD = 0.12  # of the tension about a step of the ladder, relative
_NOISE = 1e-3  # of positions, units of L, against which the spread is held
_GOOD = 1e-4  # RMS error of a disk, units of L, at which no further tensions are tried
_KEPT = 24  # routings that go from one stage to the next
_ROUNDS = 30  # of exchanges


@dataclass(frozen=True, eq=False)
class Found:
    """A routing: states (n+1,), its predicted tensions (C,), and its sum of squared errors."""

    states: tuple[int, ...]
    tensions: np.ndarray
    cost: float


class RoutingSearch:
    """Searches routings of C cables through H holes on every disk.

    Attributes:
        holes: (H,) hole angles [rad].
    """

    def __init__(self, model: SegmentModel, holes: np.ndarray, target: Target, width: int) -> None:
        self.model = model
        self.holes = holes
        self.target = target
        self.width = width
        self.cables = len(target.pulls)
        self.choices = np.array(list(product(range(len(holes)), repeat=self.cables)))  # (S, C)
        self.scale = (target.fractions + target.pulls) / model.radius**2

    def run(self) -> list[Found]:
        """Return the best routings found, nearest to the wanted shape first, each once."""
        kept: list[Found] = []
        for tensions in self._ladder():
            kept = self._merged(kept, self._beam(self._table(tensions)))
            if self._rms(kept) < _GOOD:
                break
        for _ in range(_ROUNDS):
            best = kept[0]
            table = self._table(best.tensions)
            kept = self._merged([], self._evaluated(self._around(kept), table))
            if kept[0].states == best.states:
                break
        return kept

    def _ladder(self) -> Iterator[np.ndarray]:
        steps = sorted(product(_LADDER[self.cables], repeat=self.cables), key=sum)
        for step in steps:
            yield self.scale * np.array(step)

    def _table(self, tensions: np.ndarray) -> SegmentTable:
        return SegmentTable(self.model, self.holes[self.choices], tensions)

    def _rms(self, found: list[Found]) -> float:
        return float(np.sqrt(max(found[0].cost, 0.0) / len(self.target.points)))

    def _beam(self, table: SegmentTable) -> list[Found]:
        states = np.arange(len(self.choices))
        prior = np.diag((_NOISE / (_SPREAD * table.tensions)) ** 2)
        chain = Chain.at_base(states, self.cables)
        for _ in range(len(self.target.points) - 1):
            rows = np.repeat(np.arange(len(chain.states)), len(states))
            chain = extended(chain, rows, np.tile(states, len(chain.states)), table, self.target)
            if len(chain.states) > self.width:
                cost = chain.costs(prior)
                chain = chain.only(np.argpartition(cost, self.width)[: self.width])
        return self._found(chain, table)

    def _found(self, chain: Chain, table: SegmentTable) -> list[Found]:
        change, cost = chain.settled(self.target)
        tensions = table.tensions + change
        cost = np.where((tensions > 0).all(axis=1), cost, np.inf)
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
        return np.unique(np.concatenate(new), axis=0)
