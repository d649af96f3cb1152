# SPDX-License-Identifier: Apache-2.0
"""Tells arrival and stall of fingers by how far they come, not by noisy velocity."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .finger_control import FingerControl
from .settings import GraspSettings


class Progress:
    """Watches whether fingers follow their commands.

    A finger has stalled when it is off its command by more than the tolerance and has not moved
    by a quarter of that for ``stall_time``, whichever of its cables it is.
    """

    def __init__(self, settings: GraspSettings) -> None:
        self._settings = settings
        self._anchors: dict[str, tuple[np.ndarray, float]] = {}  # pulls and time by finger

    def stalled(self, fingers: Sequence[FingerControl], now: float) -> str:
        """Return the name of a finger that has stalled, or nothing."""
        tolerance = self._settings.place_tolerance
        for finger in fingers:
            command = finger.command
            at = command if finger.measured is None else finger.measured
            pulls, since = self._anchors.setdefault(finger.name, (at, now))
            moves = float(np.abs(at - pulls).max()) > tolerance / 4
            if moves or float(np.abs(command - at).max()) <= tolerance:
                self._anchors[finger.name] = (at, now)
            elif now - since >= self._settings.stall_time:
                return finger.name
        return ""


class Lasting:
    """Tells whether something has been so without a break for a time."""

    def __init__(self) -> None:
        self._since: float | None = None

    def holds(self, condition: bool, now: float, seconds: float) -> bool:
        """Note whether it is so now; tell whether it has been for these seconds."""
        if not condition:
            self._since = None
            return False
        if self._since is None:
            self._since = now
        return now - self._since >= seconds


def advance(
    finger: FingerControl, place: float, speed: float, seconds: float, max_lead: float
) -> None:
    """Move a finger's command towards a place, never farther ahead of the finger than this [m]."""
    at = finger.measured_place
    place = min(max(place, at - max_lead), at + max_lead)
    finger.step_towards(place, speed * seconds)
