# SPDX-License-Identifier: Apache-2.0
"""What is asked of the gripper, and what became of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum
from typing import Generic, TypeVar

from ccr_ros.model import checks
from ccr_ros.model.errors import CcrError, InvalidValue, UnknownName

from .settings import GraspSettings


class Refused(CcrError):
    """The gripper does not do what was asked; nothing has changed. Its text says why."""


class End(Enum):
    """How a run ended."""

    DONE = "done"
    FAILED = "failed"
    CANCELED = "canceled"


@dataclass(frozen=True)
class Outcome:
    """What became of a run.

    Attributes:
        end: How it ended.
        message: What happened, in words.
        reached: What was asked for is so: the force is the target, or the fingers are open.
        stalled: The fingers came to a stop before that.
        limiting: What kept an object from being moved as asked; empty: nothing, or no motion.
    """

    end: End
    message: str
    reached: bool = False
    stalled: bool = False
    limiting: str = ""


@dataclass(frozen=True)
class GraspGoal:
    """A grasp, complete: no value is left to a default.

    Attributes:
        force: Of each finger whose force share is 1 [N].
        speed: Of the pulls while closing [m/s].
        timeout: For all of it [s].
        required: Names of the fingers that must touch.
        thing: Name of the object; empty: whatever is touched.
        gap: Between the fingertips where they are expected to touch [m]; 0: not known.
        least_gap: Gap at which closing ends in good order with nothing touched [m]; minus
            infinity: never, the fingers then open again.
    """

    force: float
    speed: float
    timeout: float
    required: tuple[str, ...]
    thing: str = ""
    gap: float = 0.0
    least_gap: float = -math.inf


@dataclass(frozen=True)
class ReleaseGoal:
    """A release.

    Attributes:
        delay: From now until it begins [s].
        fast: At which of the two speeds.
        gap: Between the fingertips to open to [m]; infinity: all the way.
    """

    delay: float = 0.0
    fast: bool = False
    gap: float = math.inf


Goal = TypeVar("Goal")


@dataclass(eq=False)
class Run(Generic[Goal]):
    """A goal under way; ``outcome`` is None until it ends."""

    goal: Goal
    started: float
    outcome: Outcome | None = field(default=None, init=False)

    def finish(self, outcome: Outcome) -> None:
        """End the run; only the first outcome counts."""
        if self.outcome is None:
            self.outcome = outcome


def grasp_goal(
    settings: GraspSettings,
    fingers: tuple[str, ...],
    *,
    thing: str = "",
    gap: float = 0.0,
    force: float = 0.0,
    speed: float = 0.0,
    timeout: float = 0.0,
    required: tuple[str, ...] = (),
    least_gap: float = -math.inf,
) -> GraspGoal:
    """Make a goal complete; what is 0 or empty takes its default.

    Raises:
        InvalidValue: A value out of range.
        UnknownName: A required finger that the gripper does not have.
    """
    for place, name in ((f"required_fingers[{i}]", n) for i, n in enumerate(required)):
        if name not in fingers:
            raise UnknownName("finger", name, fingers)
        if required.count(name) > 1:
            raise InvalidValue(place, name, "named once")
    return GraspGoal(
        force=checks.real("force", force, low=0.0, high=settings.max_force, unit="N")
        or settings.default_force,
        speed=checks.real("speed", speed, low=0.0, high=0.1, unit="m/s") or settings.close_speed,
        timeout=checks.real("timeout", timeout, low=0.0, high=3600.0, unit="s")
        or settings.grasp_timeout,
        required=required or fingers,
        thing=checks.label("object", thing) if thing else "",
        gap=checks.real("width", gap, low=0.0, high=10.0, unit="m"),
        least_gap=least_gap,
    )


def release_goal(delay: float = 0.0, fast: bool = False, gap: float = math.inf) -> ReleaseGoal:
    """Return a checked goal.

    Raises:
        InvalidValue: The delay is not a number of seconds from 0 to a day.
    """
    return ReleaseGoal(checks.real("delay", delay, low=0.0, high=86400.0, unit="s"), fast, gap)
