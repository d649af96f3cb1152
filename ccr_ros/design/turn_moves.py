# SPDX-License-Identifier: Apache-2.0
"""Random small changes of a gripper for turning: holes, bases, contact points, grip force."""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from .turn_units import Holes, UnitChoice

_DISTANCE, _SPOT = 2.5e-3, 1e-3  # m; steps
_FORCE = 1.2  # factor
_FARTHEST, _ASIDE, _FORCES = 0.03, 0.01, (0.25, 4.0)  # from the given ones
_TRIES = 200


@dataclass(frozen=True)
class TurnChoice:
    """A whole choice.

    Attributes:
        units: One for each unit of the gripper.
        force: Factor of all grip forces.
    """

    units: tuple[UnitChoice, ...]
    force: float = 1.0

    @property
    def winding(self) -> int:
        """Holes by which all cables change from disk to disk, summed up; pairs count once."""
        return sum(winding(path) for unit in self.units for path in unit.holes)


def winding(path: Sequence[int]) -> int:
    """Return the holes by which a cable changes from disk to disk, summed up."""
    return sum(abs(b - a) for a, b in pairwise(path))


def smooth(holes: Holes, given: Holes) -> bool:
    """Whether cables change by at most one hole from disk to disk, or by what the given ones do."""
    return all(
        abs(path[d + 1] - path[d]) <= max(1, abs(was[d + 1] - was[d]))
        for path, was in zip(holes, given, strict=True)
        for d in range(len(path) - 1)
    )


def apart(holes: Holes, per_disk: int) -> bool:
    """Whether no two cables of a finger run through one hole."""
    return all(
        (a - b) % per_disk
        for i, first in enumerate(holes)
        for second in holes[:i]
        for a, b in zip(first, second, strict=False)
    )


class TurnMoves:
    """Draws changed choices around one.

    Args:
        given: The choice that the given gripper is.
        per_disk: Holes per disk, by unit.
        seed: Of the draws; the same seed draws the same.
    """

    def __init__(self, given: TurnChoice, per_disk: Sequence[int], seed: int) -> None:
        self._given = given
        self._per_disk = tuple(per_disk)
        self._random = random.Random(seed)

    def of(self, choices: Sequence[TurnChoice]) -> TurnChoice:
        """Return a changed copy of one of some choices, of the first by preference.

        It differs from the chosen one in one to three respects.
        """
        start = choices[0]
        if len(choices) > 1 and self._random.random() < 0.3:
            start = choices[self._random.randrange(1, len(choices))]
        for _ in range(_TRIES):
            choice = start
            for _ in range(self._random.choice((1, 1, 2, 3))):
                choice = self._changed(choice)
            if choice != start:
                return choice
        return start

    def _changed(self, choice: TurnChoice) -> TurnChoice:
        kind = self._random.choice(("holes", "holes", "holes", "distance", "spot", "force"))
        if kind == "force":
            force = choice.force * self._random.choice((1 / _FORCE, _FORCE))
            low, high = (self._given.force * factor for factor in _FORCES)
            return replace(choice, force=min(high, max(low, force)))
        index = self._random.randrange(len(choice.units))
        unit, given = choice.units[index], self._given.units[index]
        if kind == "holes":
            changed = self._wound(unit, given, self._per_disk[index])
        elif kind == "distance":
            distance = unit.distance + self._random.choice((-2, -1, 1, 2)) * _DISTANCE
            near = min(_FARTHEST, max(-_FARTHEST, distance - given.distance))
            changed = replace(unit, distance=given.distance + near)
        else:
            spot = unit.spot + self._random.choice((-2, -1, 1, 2)) * _SPOT
            near = min(_ASIDE, max(-_ASIDE, spot - given.spot))
            changed = replace(unit, spot=given.spot + near)
        units = (*choice.units[:index], changed, *choice.units[index + 1 :])
        return replace(choice, units=units)

    def _wound(self, unit: UnitChoice, given: UnitChoice, per_disk: int) -> UnitChoice:
        """Move a stretch of one cable by a hole."""
        cable = self._random.randrange(len(unit.holes))
        path = list(unit.holes[cable])
        first, last = sorted(self._random.randrange(len(path)) for _ in range(2))
        side = self._random.choice((-1, 1))
        for disk in range(first, last + 1):
            path[disk] += side
        holes = (*unit.holes[:cable], tuple(path), *unit.holes[cable + 1 :])
        if not smooth(holes, given.holes) or not apart(holes, per_disk):
            return unit
        return replace(unit, holes=holes)
