# SPDX-License-Identifier: Apache-2.0
"""Grips harder while friction is near its limit, as under a weight that has grown."""

from __future__ import annotations

import math

from .grip import Grip
from .motion import ObjectWatch
from .settings import GraspSettings

_LONGEST_STEP = 0.2  # s that what was heard of the object once may count for


class MarginKeeper:
    """Adds to the grip's target forces what keeps the smallest friction margin at ``hold_margin``.

    With f the friction at a contact and N its normal force the margin is 1 - f / (mu N): a weight
    that grows lowers it, a harder grip raises it. The addition e follows
    de/dt = ``margin_gain`` (``hold_margin`` - margin), from 0 to what ``max_force`` leaves, once
    for each message of the solver. It falls only while the margin is beyond the wanted one by
    ``margin_band``, and rises only while the fingers follow: what they cannot press is not asked
    for.

    Args:
        grip: What is held.
        thing: The object, as the solver knows it.
        settings: Margins and forces.
    """

    def __init__(self, grip: Grip, thing: ObjectWatch, settings: GraspSettings) -> None:
        self._grip = grip
        self._thing = thing
        self._settings = settings
        self._acted = -math.inf  # on what was heard then [s]

    def step(self) -> None:
        """Act on the newest that was heard of the object, once."""
        grip, settings, heard = self._grip, self._settings, self._thing.heard_at
        seconds = min(heard - self._acted, _LONGEST_STEP)
        self._acted = heard
        thing = self._thing.fresh
        if settings.hold_margin == 0.0 or thing is None or not seconds > 0.0:
            return
        missing = settings.hold_margin - thing.margin
        rises = missing > 0.0 and self._pressed()
        if rises or missing < -settings.margin_band:  # neither where the margin is not known
            rate = min(
                max(settings.margin_gain * missing, -settings.press_rate), settings.press_rate
            )
            most = settings.max_force - max(grip.targets.values(), default=0.0)
            grip.extra = min(max(grip.extra + rate * seconds, 0.0), max(most, 0.0))

    def _pressed(self) -> bool:
        """Tell whether the fingers press as hard as they are asked to."""
        level, target = self._grip.mean()
        return level >= target - self._settings.force_tolerance
