# SPDX-License-Identifier: Apache-2.0
"""What the coordinator hears of the object in hand, and how far that has come."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ccr_ros.grasp.statics.path import turn_between
from ccr_ros.model.rotation import Pose

from .settings import GraspSettings


@dataclass(frozen=True, eq=False)
class HeldObject:
    """What the solver says of the object.

    Attributes:
        name: Its name; empty: there is none.
        pose: In the gripper's frame.
        held: The fingers alone carry it.
        margin: Smallest friction margin of its contacts; NaN: not known, or without friction.
        stale: The newest pulls have no pose; this is the last that was good.
        message: What is not as wanted.
    """

    name: str
    pose: Pose
    held: bool
    margin: float = math.nan
    stale: bool = False
    message: str = ""


@dataclass(frozen=True, eq=False)
class Motion:
    """How far an object has come.

    Attributes:
        pose: Where it is, in the gripper's frame.
        shift: (3,) [m] of its centre since the beginning; turn: (3,) rotation vector [rad].
        margin: As for `HeldObject`.
        fraction: Of the planned pulls that were commanded, from 0 to 1.
    """

    pose: Pose
    shift: np.ndarray
    turn: np.ndarray
    margin: float
    fraction: float


class ObjectWatch:
    """Keeps the newest that was heard of the object."""

    def __init__(self) -> None:
        self.newest: HeldObject | None = None
        self.heard_at = -math.inf  # s
        self.fresh_at = -math.inf  # when the solver last had a pose for the newest pulls

    def hear(self, thing: HeldObject, now: float) -> None:
        """Take what the solver says."""
        self.newest, self.heard_at = thing, now
        if not thing.stale:
            self.fresh_at = now

    @property
    def fresh(self) -> HeldObject | None:
        """The object, if the fingers carry it and its pose is that of the newest pulls."""
        thing = self.newest
        return thing if thing is not None and thing.held and not thing.stale else None

    def trouble(self, now: float, settings: GraspSettings) -> str:
        """Return why it is not known how the fingers carry an object, or nothing."""
        thing = self.newest
        if thing is None or not thing.name:
            return "solver: it knows of no object in hand (its parameter mode: gripper)"
        age, stale_for = now - self.heard_at, now - self.fresh_at
        if age > settings.solver_timeout:
            return f"solver: nothing heard of {thing.name!r} since {age:.1f} s"
        why = f": {thing.message}" if thing.message else ""
        if thing.stale:
            if stale_for > settings.stale_timeout:
                return f"solver: the pose of {thing.name!r} is stale since {stale_for:.1f} s{why}"
        elif not thing.held:
            return f"solver: the fingers do not carry {thing.name!r}{why or ' (held: false)'}"
        return ""

    def motion(self, start: Pose, fraction: float) -> Motion | None:
        """Return how far it has come from a pose; None: nothing is known of it."""
        thing = self.newest
        if thing is None or not thing.name:
            return None
        return Motion(
            thing.pose,
            thing.pose.position - start.position,
            turn_between(start, thing.pose),
            thing.margin,
            fraction,
        )
