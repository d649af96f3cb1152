# SPDX-License-Identifier: Apache-2.0
"""Search for a gripper that turns an object farther: a local search, seeded, around a given one.

The score of a gripper [deg] is

    min(turn by +z, turn by -z, cap) + 20 * hold margin - 0.25 * holes its cables wind by

and 0 where it does not hold the object: both ways count, a firm hold counts, and a cable that
winds less rubs less. Each try changes one of the best so far a little (`turn_moves`), puts the
bases where free fingers meet their spots (`turn_units`), and is asked how far it turns (`turn`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from ..model import checks
from ..model.errors import InvalidValue, NotConverged
from ..model.files import Gripper
from ..model.settings import SolverSettings
from .gripper_layout import check_apart
from .turn import TurnResult, TurnTask, evaluate_turn, scaled
from .turn_moves import TurnChoice, TurnMoves
from .turn_units import UnitChoice, holes_of, made_gripper, touch, units_of

CAP = math.radians(45.0)
_MARGIN, _WINDING = 20.0, 0.25  # deg per margin, deg per hole
_KEPT = 5  # of the best, from which new ones are made


@dataclass(frozen=True, eq=False)
class TurnDesign:
    """A gripper that was tried.

    Attributes:
        gripper: It.
        choice: What it was made of.
        task: With its grip forces.
        result: What it does; None where it could not even be made.
        score: [deg]; see this module.
    """

    gripper: Gripper
    choice: TurnChoice
    task: TurnTask
    result: TurnResult | None
    score: float


@dataclass(frozen=True, eq=False)
class TurnSearch:
    """The end of a search.

    Attributes:
        given: The gripper that it began with.
        best: The best one, the given one if none is better.
        tried: How many were tried.
        stopped: Whether it was ended before all tries were done.
    """

    given: TurnDesign
    best: TurnDesign
    tried: int
    stopped: bool


def score(result: TurnResult, winding: int, cap: float = CAP) -> float:
    """Return the score [deg] of a gripper; a result without its second way is taken by its first.

    Args:
        result: What it does.
        winding: `TurnChoice.winding`.
        cap: Turns count up to this [rad].
    """
    if not result.held or result.hold is None:
        return 0.0
    margin = result.hold.margin
    firm = 0.0 if math.isnan(margin) else _MARGIN * margin
    return max(0.0, math.degrees(min(result.angle, cap)) + firm - _WINDING * winding)


def search_turn(
    gripper: Gripper,
    task: TurnTask,
    tries: int,
    seed: int = 0,
    *,
    cap: float = CAP,
    settings: SolverSettings | None = None,
    watch: Callable[[int, TurnDesign], bool] | None = None,
) -> TurnSearch:
    """Look for a gripper that turns an object farther than a given one.

    Mirrored fingers stay mirrored. The same seed and settings find the same, unless a time limit of
    the solver is met. An interrupt (Ctrl-C) ends the search with the best so far.

    Args:
        gripper: The given one; its cables run through holes.
        task: What it shall do.
        tries: How many others to try.
        seed: Of the random changes.
        cap: Turns count up to this [rad].
        settings: Of the solver.
        watch: Called with the number and design of each try, the given gripper's being 0; the
            search ends where it returns False.

    Raises:
        InvalidValue, UnknownName: Gripper and task do not fit together, or a cable's angles are not
            those of holes.
        NotConverged: A finger of the given gripper, pulled alone, does not come to the object.
    """
    checks.integer("tries", tries, low=1, high=1_000_000)
    checks.integer("seed", seed, low=0, high=2**63 - 1)
    checks.real("cap", cap, above=0, high=math.pi, unit="rad")
    search = _Search(gripper, task, seed, cap, settings)
    watch = watch or (lambda number, design: True)
    number, stopped = 0, False
    try:
        stopped = not watch(0, search.given)
        while number < tries and not stopped:
            design = search.next()
            number += 1
            stopped = not watch(number, design)
    except KeyboardInterrupt:
        stopped = True
    return TurnSearch(search.given, search.best[0], number, stopped)


class _Search:
    def __init__(
        self,
        gripper: Gripper,
        task: TurnTask,
        seed: int,
        cap: float,
        settings: SolverSettings | None,
    ) -> None:
        self._gripper, self._task, self._cap, self._settings = gripper, task, cap, settings
        self._units = units_of(gripper)
        own = [gripper.fingers[unit.index] for unit in self._units]
        choices = []
        for mounted in own:
            local = mounted.base.inverse() @ task.body.pose
            spot = float(touch(mounted.finger, task.body.shape, local)[1] - local.position[1])
            choices.append(UnitChoice(holes_of(mounted.finger), 0.0, spot))
        choice = TurnChoice(tuple(choices))
        self._moves = TurnMoves(choice, [m.finger.holes_per_disk for m in own], seed)
        result = evaluate_turn(gripper.fingers, task, settings)
        self.given = TurnDesign(gripper, choice, task, result, score(result, choice.winding, cap))
        self.best = [self.given]
        self._seen = {choice}

    def next(self) -> TurnDesign:
        """Try another, and keep it if it is among the best."""
        choice = self._moves.of([design.choice for design in self.best])
        for _ in range(50):
            if choice not in self._seen:
                break
            choice = self._moves.of([design.choice for design in self.best])
        self._seen.add(choice)
        design = self._tried(choice)
        if design.score > 0:
            self.best = sorted([*self.best, design], key=lambda d: -d.score)[:_KEPT]
        return design

    def _tried(self, choice: TurnChoice) -> TurnDesign:
        task = scaled(self._task, choice.force)
        body = self._task.body
        try:
            gripper = made_gripper(self._gripper, self._units, choice.units, body.shape, body.pose)
            bases = [mounted.base.position[None] for mounted in gripper.fingers]
            check_apart(bases, max(m.finger.disk_radius for m in gripper.fingers), "at their bases")
            result = evaluate_turn(
                gripper.fingers, task, self._settings, lambda r: self._worth(r, choice)
            )
        except (NotConverged, InvalidValue):  # what cannot be made, or overlaps, is no gripper
            return TurnDesign(self._gripper, choice, task, None, 0.0)
        value = score(result, choice.winding, self._cap) if len(result.ways) == 2 else 0.0
        return TurnDesign(gripper, choice, task, result, value)

    def _worth(self, result: TurnResult, choice: TurnChoice) -> bool:
        """Whether a try can still come among the best: its second way is at best as its first."""
        if result.ways:
            most = score(result, choice.winding, self._cap)
        else:
            assert result.hold is not None
            margin = result.hold.margin
            most = math.degrees(self._cap) - _WINDING * choice.winding
            most += 0.0 if math.isnan(margin) else _MARGIN * margin
        return len(self.best) < _KEPT or most > self.best[-1].score
