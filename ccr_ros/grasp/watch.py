# SPDX-License-Identifier: Apache-2.0
"""What may fail around a grasp: the servo bridge, the solver, the poses."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from .finger_control import FingerControl
from .settings import GraspSettings


@dataclass
class ServoHealth:
    """What the servo bridge says of itself.

    Attributes:
        active: It follows commands.
        reason: Why it does not.
        heard: Whether it ever said anything.
    """

    active: bool = False
    reason: str = ""
    heard: bool = False


def bridge_trouble(
    fingers: Iterable[FingerControl], servos: ServoHealth, now: float, settings: GraspSettings
) -> str:
    """Return why the fingers cannot be moved, or nothing."""
    if servos.heard and not servos.active:
        return f"servo bridge: {servos.reason}"
    for finger in fingers:
        age = now - finger.measured_at
        if age > settings.bridge_timeout:
            return f"servo bridge: no measured pulls of {finger.name} {_since(age)}"
    return ""


def solver_trouble(fingers: Iterable[FingerControl], now: float, settings: GraspSettings) -> str:
    """Return why it is not known what the fingers touch, or nothing."""
    for finger in fingers:
        age, stale_for = now - finger.solved_at, now - finger.fresh_at
        if age > settings.solver_timeout:
            return f"solver: no state of {finger.name} {_since(age)}"
        if stale_for > settings.stale_timeout and finger.solved is not None and finger.solved.stale:
            return f"solver: the pose of {finger.name} is stale {_since(stale_for)}"
    return ""


def _since(age: float) -> str:
    return "yet" if age == math.inf else f"since {age:.1f} s"
