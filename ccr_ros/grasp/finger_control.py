# SPDX-License-Identifier: Apache-2.0
"""One finger in the coordinator: what was heard of it, and the pulls it is commanded."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .free_motion import FreeMotion
from .pull_path import PullPath


@dataclass(frozen=True, eq=False)
class SolvedFinger:
    """What the solver says of a finger.

    Attributes:
        pulls: That were solved (m,) [m].
        tensions: Of the cables (m,) [N].
        contacts: Object and normal force [N] of every contact.
        stale: The newest pulls could not be solved; this is the last good pose.
        stable: The pose is a minimum of the energy.
    """

    pulls: np.ndarray
    tensions: np.ndarray
    contacts: tuple[tuple[str, float], ...] = ()
    stale: bool = False
    stable: bool = True


class FingerControl:
    """Keeps the newest that was heard of a finger, and its command: a place on its pull path.

    A finger may be found off its path (pulled by a person, say). The rest that the path does not
    explain is kept in the command, and taken back as the finger moves on, so that no command
    jumps.

    Args:
        name: The finger's.
        cables: Names of its cables.
        path: Its pulls from open to closed.
        free: Its motion while it touches nothing.
        pull_range: Lowest and highest pull (m, 2) [m] while an object is moved; None: those of the
            path's two ends.
        force_share: Times the force asked for that it presses with; see `Grip.level`.
    """

    def __init__(
        self,
        name: str,
        cables: tuple[str, ...],
        path: PullPath,
        free: FreeMotion,
        pull_range: np.ndarray | None = None,
        force_share: float = 1.0,
    ) -> None:
        self.name = name
        self.cables = cables
        self.path = path
        self.free = free
        ends = np.column_stack([path.open, path.closed])
        self.pull_range = np.sort(ends, axis=1) if pull_range is None else pull_range
        self.force_share = force_share

        self.measured: np.ndarray | None = None  # pulls (m,) [m]
        self.measured_at = -math.inf  # s
        self.solved: SolvedFinger | None = None
        self.solved_at = -math.inf
        self.fresh_at = -math.inf  # when the solver last had a pose for the newest pulls
        self.servo_tensions: np.ndarray | None = None  # (m,) [N], NaN: not known

        self.place = 0.0  # commanded [m]
        self._rest = np.zeros(len(cables))  # what the path does not explain [m]

    # What is heard

    def hear_pulls(self, pulls: np.ndarray, now: float) -> None:
        """Take measured pulls (m,) [m]."""
        self.measured, self.measured_at = pulls, now

    def hear_solved(self, solved: SolvedFinger, now: float) -> None:
        """Take what the solver says."""
        self.solved, self.solved_at = solved, now
        if not solved.stale:
            self.fresh_at = now

    @property
    def measured_place(self) -> float:
        """Measured place on the path [m]; the commanded one while nothing was measured."""
        return self.place if self.measured is None else self.path.place(self.measured)

    @property
    def solved_place(self) -> float:
        """Place of the solver's pose [m]; minus infinity while there is none."""
        return -math.inf if self.solved is None else self.path.place(self.solved.pulls)

    def force(self, thing: str = "") -> float:
        """Return the sum of normal forces [N], of contacts with this object or (empty) with any."""
        if self.solved is None:
            return 0.0
        return float(sum(f for name, f in self.solved.contacts if thing in ("", name)))

    @property
    def tensions(self) -> np.ndarray:
        """Tensions (m,) [N]: the servos' where they tell them, else the solver's, else NaN."""
        from_solver = np.full(len(self.cables), np.nan)
        if self.solved is not None:
            from_solver = self.solved.tensions
        if self.servo_tensions is None:
            return from_solver
        return np.where(np.isnan(self.servo_tensions), from_solver, self.servo_tensions)

    @property
    def effort_excess(self) -> float:
        """Tension beyond that of the free finger [N], of the cable that has most; NaN: unknown."""
        expected = self.free.tensions_at(self.measured_place)
        return float((self.tensions - expected).max())

    # The command

    @property
    def limit(self) -> float:
        """Farthest place that may be commanded [m]: the path's end, or where it was found."""
        return max(self.path.length, self.place)

    @property
    def command(self) -> np.ndarray:
        """Commanded pulls (m,) [m]."""
        return self.path.pulls(self.place) + self._rest

    def adopt(self) -> None:
        """Command the measured pulls."""
        if self.measured is not None:
            self.place = self.path.place(self.measured)
            self._rest = self.measured - self.path.pulls(self.place)

    def send(self, pulls: np.ndarray) -> None:
        """Command pulls (m,) [m], wherever they are beside the path."""
        self.place = self.path.place(pulls)
        self._rest = pulls - self.path.pulls(self.place)

    def freeze(self, tolerance: float) -> None:
        """Command what is reached: where the finger is, if that is beyond the command.

        By more than the tolerance [m]: else noise of the measurement would add up in the command.
        """
        at = self.measured_place
        if at > self.place + tolerance:
            self.place = at

    def step_towards(self, place: float, step: float) -> None:
        """Move the command towards a place by at most a step [m], back on the path first."""
        off = float(np.abs(self._rest).max())
        if off > 0.0:
            spent = min(off, step)
            self._rest = self._rest * (1.0 - spent / off)
            step -= spent
        self.place += min(max(place - self.place, -step), step)
