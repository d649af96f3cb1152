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
        self.targets: dict[str, float] = {}  # levels [N] of the fingers that are regulated
        self.floors: dict[str, float] = {}  # [m]
        self.extra = 0.0  # N of level beyond the targets; see `MarginKeeper`
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

    def level(self, finger: FingerControl) -> float:
        """Return a finger's force per share [N], which is the same of all in an even grip.

        A thumb presses against two fingers, and so with twice the force of each: its share is 2.
        """
        return self.force(finger) / finger.force_share

    def mean(self) -> tuple[float, float]:
        """Return level and target [N] of all fingers that hold, as if they were one."""
        fingers = [self._fingers[name] for name in self.targets]
        shares = sum(finger.force_share for finger in fingers)
        if not fingers:
            return 0.0, 0.0
        level = sum(self.force(finger) for finger in fingers) / shares
        target = sum(self.targets[f.name] * f.force_share for f in fingers) / shares
        return level, target + self.extra

    def miss(self, carried: bool) -> float:
        """Return how far what is regulated is from its target [N]; see `hold`."""
        if carried:
            level, target = self.mean()
            return abs(level - target)
        targets = self.targets.items()
        levels = {name: self.level(self._fingers[name]) for name in self.targets}
        return max((abs(levels[n] - t - self.extra) for n, t in targets), default=0.0)

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
        """Hold from now on: with this target level [N], or each finger with the force it has."""
        for finger in self._fingers.values():
            if self.touches(finger) or finger.name in self.required:
                as_it_is = max(self.level(finger) - self.extra, 0.0)
                self.targets[finger.name] = as_it_is if force is None else force
                floor = self.floors.get(finger.name, finger.place)
                self.floors[finger.name] = min(floor, finger.place)
        self.committed = True
        self._lost = {name: Lasting() for name in self._fingers}

    def regulate(self, finger: FingerControl, target: float) -> None:
        """Move a finger's command, once for each new pose, so that its level nears a target.

        Not at a pose that is stale. At one that is not stable no farther; before a grip is
        committed back as far as the law wants, then only down to the floor. Never farther from
        the newest pose than ``blind_lead``, so that a slow solver makes no force swing.
        """
        seconds = self._new_for(finger)
        self._regulated[finger.name] = finger.solved_at
        if seconds > 0.0:
            step = self.law.step(self.level(finger), target, seconds)
            low, high = self._reach(finger)
            finger.place = min(max(finger.place + step, low), high)

    def regulate_together(self) -> None:
        """Move the commands of all that hold by the same, so that their mean level nears a target.

        Fingers that alone carry an object balance each other: their forces are not independent,
        and fingers of which each went after its own would push the object away, without end. What
        one of them may not do, none does.
        """
        fingers = [self._fingers[name] for name in self.targets]
        seconds = min((self._new_for(finger) for finger in fingers), default=0.0)
        if seconds <= 0.0:
            return
        self._regulated |= {finger.name: finger.solved_at for finger in fingers}
        level, target = self.mean()
        step = self.law.step(level, target, seconds)
        for finger in fingers:
            low, high = self._reach(finger)
            step = min(max(step, low - finger.place), high - finger.place)
        for finger in fingers:
            finger.place += step

    def _new_for(self, finger: FingerControl) -> float:
        """Return the time that the newest pose counts for [s]; 0: it is stale, or was acted on."""
        if finger.solved is None or finger.solved.stale:
            return 0.0
        before = self._regulated.get(finger.name, -math.inf)
        return min(finger.solved_at - before, _LONGEST_REGULATION)

    def _reach(self, finger: FingerControl) -> tuple[float, float]:
        """Return the least and the farthest place that the regulation may send a finger to [m]."""
        lead = self._settings.blind_lead
        low, high = finger.solved_place - lead, min(finger.limit, finger.solved_place + lead)
        if finger.solved is None or not finger.solved.stable:
            high = finger.place
        if self.committed:
            low = max(low, self.floors.get(finger.name, finger.place))
        return min(max(low, 0.0), finger.place), max(high, finger.place)

    def hold(self, now: float, carried: bool = False) -> str:
        """Regulate all that hold; return the name of a required finger that lost touch, if any.

        Args:
            now: Time [s].
            carried: Whether the fingers alone carry the object.
        """
        if carried:
            self.regulate_together()
        else:
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
