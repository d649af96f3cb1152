# SPDX-License-Identifier: Apache-2.0
"""How fingers open: all at the same speed, so that none pushes the object aside."""

from __future__ import annotations

import math
from collections.abc import Mapping

from .finger_control import FingerControl
from .progress import Lasting, Progress, advance
from .settings import GraspSettings


class Opening:
    """Moves all fingers towards a gap, one step of time after the other.

    Args:
        fingers: All fingers.
        settings: Speeds, tolerance and times.
        speed: Of the pulls [m/s].
        gap: Between the fingertips [m]; infinity: as far as the path goes.
        now: When it begins [s].
    """

    def __init__(
        self,
        fingers: Mapping[str, FingerControl],
        settings: GraspSettings,
        speed: float,
        gap: float,
        now: float,
    ) -> None:
        self._fingers = tuple(fingers.values())
        self._settings = settings
        self._speed = speed
        self._gap = gap
        self._began = now
        self._progress = Progress(settings)
        self._arrived = Lasting()

    def step(self, now: float, seconds: float) -> bool:
        """Move all fingers by a step; tell whether they have arrived."""
        for finger in self._fingers:
            place = min(finger.free.place_of_gap(self._gap), finger.place)
            advance(finger, place, self._speed, seconds, self._settings.max_lead)
        there = is_open(self._fingers, self._settings.place_tolerance, self._gap)
        return self._arrived.holds(there, now, self._settings.settle_time)

    def trouble(self, now: float) -> str:
        """Return why it will not arrive, or nothing."""
        if stuck := self._progress.stalled(self._fingers, now):
            return f"not open: the servo of {stuck} does not follow"
        if now - self._began > self._settings.release_timeout:
            return f"not open within {self._settings.release_timeout:g} s"
        return ""


def is_open(fingers: tuple[FingerControl, ...], tolerance: float, gap: float = math.inf) -> bool:
    """Tell whether the fingers are measured at most this [m] from the place of a gap, or beyond."""
    return all(f.measured_place <= f.free.place_of_gap(gap) + tolerance for f in fingers)
