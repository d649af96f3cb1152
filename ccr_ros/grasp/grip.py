# SPDX-License-Identifier: Apache-2.0
"""What is held: each finger's target force, and the pull below which it never goes."""

from __future__ import annotations

import math
from collections.abc import Mapping

from .finger_control import FingerControl
from .progress import Lasting
from .regulation import ForceLaw
from .settings import GraspSettings

_LONGEST_REGULATION = 0.1  # s that one pose may count for: see `ForceLaw`


class Grip:
    """Regulates the forces of the fingers that hold, and knows when the object is lost.

    A grip that was once complete is *committed*: until a release nothing commands one of its
    fingers below its floor, the place where it first touched, whatever is measured.

    Args:
        fingers: All fingers.
        settings: Forces, speeds and times.
    """

    def __init__(self, fingers: Mapping[str, FingerControl], settings: GraspSettings) -> None:
        self._fingers = fingers
        self._settings = settings
        self.law = ForceLaw(settings.force_gain, settings.force_speed, settings.force_dead_band)
        self.committed = False
        self.thing = ""
        self.required: tuple[str, ...] = tuple(fingers)
        self.targets: dict[str, float] = {}  # [N] of the fingers whose force is regulated
        self.floors: dict[str, float] = {}  # [m]
        self.extra = 0.0  # N beyond the targets; see `MarginKeeper`
        self._lost = {name: Lasting() for name in fingers}
        self._regulated: dict[str, float] = {}  # time of the pose that was last acted on, by finger

    def clear(self) -> None:
        """Forget the grip: a release begins."""
        self.committed = False
        self.thing = ""
        self.required = tuple(self._fingers)
        self.targets.clear()
        self.floors.clear()
        self.extra = 0.0

    # What is felt

    def force(self, finger: FingerControl) -> float:
        """Return a finger's force on the object [N]."""
        return finger.force(self.thing)

    def touches(self, finger: FingerControl) -> bool:
        """Tell whether a finger touches the object."""
        return self.force(finger) >= self._settings.contact_force

    def known(self, finger: FingerControl) -> bool:
        """Tell whether the newest pose is that of where the finger is, so that its force counts."""
        solved = finger.solved
        if solved is None or solved.stale:
            return False
        return abs(finger.solved_place - finger.measured_place) <= self._settings.place_tolerance

    def agrees(self, finger: FingerControl) -> bool:
        """Tell whether a finger touches, in a pose that is not stale, and its effort agrees."""
        known = finger.solved is not None and not finger.solved.stale
        return (
            known and self.touches(finger) and finger.effort_excess >= self._settings.effort_margin
        )

    @property
    def needed(self) -> list[FingerControl]:
        """The required fingers."""
        return [self._fingers[name] for name in self.required]

    @property
    def complete(self) -> bool:
        """Whether all required fingers touch, and their efforts agree."""
        return all(self.agrees(finger) for finger in self.needed)

    # What is done

    def touch(self, finger: FingerControl, begins: bool) -> None:
        """Note where a finger touches: its floor is the least place since it began.

        A committed floor stays.
        """
        if self.committed and finger.name in self.floors:
            return
        place = finger.solved_place
        if not begins:
            place = min(place, self.floors.get(finger.name, place))
        self.floors[finger.name] = place

    def commit(self, force: float | None) -> None:
        """Hold from now on: with this target [N], or each finger with the force it has."""
        for finger in self._fingers.values():
            if self.touches(finger) or finger.name in self.required:
                as_it_is = max(self.force(finger) - self.extra, 0.0)
                self.targets[finger.name] = as_it_is if force is None else force
                floor = self.floors.get(finger.name, finger.place)
                self.floors[finger.name] = min(floor, finger.place)
        self.committed = True
        self._lost = {name: Lasting() for name in self._fingers}

    def regulate(self, finger: FingerControl, target: float) -> None:
        """Move a finger's command, once for each new pose, so that its force nears a target.

        Not at a pose that is stale. At one that is not stable no farther; before a grip is
        committed back as far as the law wants, then only down to the floor. Never farther from
        the newest pose than ``blind_lead``, so that a slow solver makes no force swing.
        """
        before = self._regulated.get(finger.name, -math.inf)
        seconds = min(finger.solved_at - before, _LONGEST_REGULATION)
        self._regulated[finger.name] = finger.solved_at
        solved, settings = finger.solved, self._settings
        if solved is None or solved.stale or seconds <= 0.0:
            return
        step = self.law.step(self.force(finger), target, seconds)
        high = min(finger.limit, finger.solved_place + settings.blind_lead)
        low = finger.solved_place - settings.blind_lead
        if not solved.stable:
            high = finger.place
        if self.committed:
            low = max(low, self.floors.get(finger.name, finger.place))
        low, high = min(max(low, 0.0), finger.place), max(high, finger.place)
        finger.place = min(max(finger.place + step, low), high)

    def hold(self, now: float) -> str:
        """Regulate all that hold; return the name of a required finger that lost touch, if any."""
        for name, target in self.targets.items():
            self.regulate(self._fingers[name], target + self.extra)
        return self.lost(now)

    def lost(self, now: float) -> str:
        """Return the name of a required finger that lost touch ``loss_time`` ago, if any."""
        for finger in self.needed:
            lost = self._lost[finger.name]
            if lost.holds(not self.touches(finger), now, self._settings.loss_time):
                return finger.name
        return ""
