# SPDX-License-Identifier: Apache-2.0
"""How fingers close on an object: who touches waits for the others, then all press together."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from .finger_control import FingerControl
from .grip import Grip
from .machine import Event
from .progress import Lasting, Progress, advance
from .runs import End, GraspGoal, Outcome
from .settings import GraspSettings

APPROACH = "approach"
PRESS = "press"

_PRESS_LEAD = 0.1  # N that the common target is ahead of the finger that presses least


@dataclass(frozen=True)
class Verdict:
    """How closing ended: the event it is for the state machine, and the outcome of the goal."""

    event: Event
    outcome: Outcome


class Closing:
    """Closes the fingers, one step of time after the other.

    A finger goes along its path until it touches, and then keeps its force at ``touch_force``.
    When all required fingers touch, the target rises for all of them together, no faster than
    the one that presses least can follow.

    Args:
        fingers: All fingers.
        grip: Takes the touch of each finger.
        goal: What is asked for.
        settings: Forces, speeds and times.
    """

    def __init__(
        self,
        fingers: Mapping[str, FingerControl],
        grip: Grip,
        goal: GraspGoal,
        settings: GraspSettings,
    ) -> None:
        self._fingers = fingers
        self._grip = grip
        self._goal = goal
        self._settings = settings
        self._touching: set[str] = set()
        self._target = min(settings.touch_force, goal.force)
        self._progress = Progress(settings)
        self._settled, self._ended, self._doubted = Lasting(), Lasting(), Lasting()
        self.phase = APPROACH

    @property
    def target(self) -> float:
        """Level that the fingers that touch are regulated to now [N]; see `Grip.level`."""
        return self._target

    def limit(self, finger: FingerControl) -> float:
        """Return the farthest place of a finger [m]."""
        if self._goal.least_gap == -math.inf:
            return finger.limit
        return min(finger.limit, finger.free.place_of_gap(self._goal.least_gap))

    def step(self, now: float, seconds: float) -> Verdict | None:
        """Move all fingers by a step; return how it ended, once it has."""
        if wrong := self._wrong_thing():
            return wrong
        for finger in self._fingers.values():
            self._move(finger, seconds)
        if self.phase == APPROACH and self._all_touch():
            self.phase = PRESS
            if self._grip.committed:  # what was held before is not pressed less now
                least = min(self._grip.level(finger) for finger in self._grip.needed)
                self._target = min(self._goal.force, max(self._target, least))
        if self.phase == PRESS:
            self._raise_target(seconds)
        return self._verdict(now)

    # Motion

    def _move(self, finger: FingerControl, seconds: float) -> None:
        if finger.solved is None or finger.solved.stale:
            return
        if not self._grip.touches(finger):
            self._touching.discard(finger.name)
            # What it may meet is known up to the newest pose only.
            place = min(self.limit(finger), finger.solved_place + self._settings.blind_lead)
            place = max(place, finger.place)
            advance(finger, place, self._speed(finger), seconds, self._settings.max_lead)
            return
        begins = finger.name not in self._touching
        self._touching.add(finger.name)
        self._grip.touch(finger, begins)
        if begins and not self._grip.committed:
            # The command was ahead of the pose that touched: what it is ahead by would press.
            finger.place = min(finger.place, finger.solved_place)
        # What was held before must not be pressed less while others still come.
        target = self._target
        if self._grip.committed:
            target = max(target, self._grip.level(finger))
        self._grip.regulate(finger, target)

    def _speed(self, finger: FingerControl) -> float:
        goal, settings = self._goal, self._settings
        gap = finger.free.gap_at(finger.place)
        if goal.gap > 0.0 and gap > goal.gap + settings.approach_margin:
            return max(goal.speed, settings.open_speed)
        return goal.speed

    def _raise_target(self, seconds: float) -> None:
        levels = [self._grip.level(f) for f in self._grip.needed if not self._at_limit(f)]
        ahead = max(levels, default=0.0) > self._target + self._settings.force_tolerance
        if ahead and not self._grip.committed:
            return  # who ran on while it touched comes back first
        target = self._target + self._settings.press_rate * seconds
        if levels:
            target = min(target, max(self._target, min(levels) + _PRESS_LEAD))
        self._target = min(target, self._goal.force)

    # How it ends

    def _all_touch(self) -> bool:
        return all(self._grip.touches(finger) for finger in self._grip.needed)

    def _at_limit(self, finger: FingerControl) -> bool:
        """Tell whether a finger is at its limit and the solver has seen it there."""
        end = self.limit(finger) - self._settings.place_tolerance
        return min(finger.place, finger.measured_place, finger.solved_place) >= end

    def _wrong_thing(self) -> Verdict | None:
        if not self._grip.thing:
            return None
        for finger in self._grip.needed:
            if finger.solved is None or finger.solved.stale or self._grip.touches(finger):
                continue
            for name, force in finger.solved.contacts:
                if force >= self._settings.contact_force:
                    text = f"{finger.name} touches {name!r}, not {self._grip.thing!r}"
                    return Verdict(Event.STOP, Outcome(End.FAILED, text, stalled=True))
        return None

    def _pressed(self, finger: FingerControl) -> bool:
        level, tolerance = self._grip.level(finger), self._settings.force_tolerance
        at_floor = finger.place <= self._grip.floors.get(finger.name, -math.inf)
        kept = self._grip.committed or at_floor
        most = math.inf if kept else self._goal.force + tolerance
        return self._grip.known(finger) and self._goal.force - tolerance <= level <= most

    def _verdict(self, now: float) -> Verdict | None:
        needed, settings = self._grip.needed, self._settings
        stuck = self._progress.stalled(list(self._fingers.values()), now)
        if stuck:
            return self._short_of_target(f"{stuck}: its servo does not follow")
        pressed = self.phase == PRESS and all(self._pressed(finger) for finger in needed)
        if self._settled.holds(
            pressed and self._grip.complete and self._target >= self._goal.force,
            now,
            settings.settle_time,
        ):
            return Verdict(Event.GRIP, Outcome(End.DONE, self._felt("held"), reached=True))
        if self._doubted.holds(pressed and not self._grip.complete, now, settings.stall_time):
            finger = next(f for f in needed if not self._grip.agrees(f))
            text = (
                f"{finger.name} touches, but its tension is only {finger.effort_excess:.3g} N "
                "beyond that of the free finger"
            )
            return Verdict(Event.STOP, Outcome(End.FAILED, text, stalled=True))
        if self._ended.holds(self._no_farther(), now, settings.settle_time):
            return self._at_the_end()
        return None

    def _no_farther(self) -> bool:
        """Tell whether every required finger presses enough or cannot go on, and one cannot."""
        ends = [finger for finger in self._grip.needed if not self._pressed(finger)]
        if self.phase == APPROACH:
            ends = [finger for finger in self._grip.needed if not self._grip.touches(finger)]
        return bool(ends) and all(self._at_limit(finger) for finger in ends)

    def _at_the_end(self) -> Verdict:
        needed = self._grip.needed
        missing = [finger.name for finger in needed if not self._grip.touches(finger)]
        if not missing:
            return self._short_of_target("at the limit of the pull")
        anything = any(f.force() > 0.0 for f in self._fingers.values())
        thing = repr(self._grip.thing) if self._grip.thing else "anything"
        if anything or self._grip.committed:
            text = f"{', '.join(missing)} found nothing: {thing} is not held"
            return Verdict(Event.STOP, Outcome(End.FAILED, text, stalled=True))
        if self._goal.least_gap > -math.inf:
            text = "closed to the gap asked for"
            return Verdict(Event.ARRIVE, Outcome(End.DONE, text, reached=True))
        text = f"closed without touching {thing}; the fingers open again"
        return Verdict(Event.MISS, Outcome(End.FAILED, text))

    def _short_of_target(self, why: str) -> Verdict:
        if self._grip.complete:
            text = self._felt(f"held with less than {self._goal.force:.3g} N, {why}")
            return Verdict(Event.GRIP, Outcome(End.FAILED, text, stalled=True))
        return Verdict(Event.STOP, Outcome(End.FAILED, f"stopped: {why}", stalled=True))

    def _felt(self, what: str) -> str:
        forces = (f"{f.name} {self._grip.force(f):.3f} N" for f in self._grip.needed)
        return f"{what}: {', '.join(forces)}"
