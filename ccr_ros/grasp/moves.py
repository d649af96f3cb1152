# SPDX-License-Identifier: Apache-2.0
"""What is asked for when a held object shall move, and what becomes of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ccr_ros.model import checks
from ccr_ros.model.errors import InvalidValue

from .manipulation import MoveTarget
from .motion import Motion
from .runs import Run
from .settings import GraspSettings


@dataclass(frozen=True, eq=False)
class MoveGoal:
    """A motion of the held object, complete.

    Attributes:
        target: Where to.
        margin: Least friction margin to plan with; 0: the solver's default.
        duration: Of the motion [s]; 0: as the speed says.
        speed: Of the cable that moves most [m/s].
        partial: Go as far as is possible, if the target is not.
    """

    target: MoveTarget
    margin: float
    duration: float
    speed: float
    partial: bool


class MoveRun(Run[MoveGoal]):
    """A motion under way; ``motion`` is how far the object has come, None: nothing is known."""

    motion: Motion | None = None


def move_goal(
    settings: GraspSettings,
    *,
    shift: Sequence[float] = (0.0, 0.0, 0.0),
    turn: Sequence[float] = (0.0, 0.0, 0.0),
    margin: float = 0.0,
    duration: float = 0.0,
    speed: float = 0.0,
    partial: bool = False,
) -> MoveGoal:
    """Make a goal complete; what is 0 takes its default.

    Args:
        settings: The defaults.
        shift: (3,) [m] of the object's centre, in the gripper's frame.
        turn: (3,) rotation vector [rad] about it.
        margin, duration, speed, partial: As for `MoveGoal`.

    Raises:
        InvalidValue: A value is out of range, no motion is asked for, or both duration and speed.
    """
    target = MoveTarget(
        np.array(checks.vector("shift", list(shift), 3, unit="m", largest=1.0)),
        np.array(checks.vector("turn", list(turn), 3, unit="rad", largest=np.pi)),
        settings.move_shift_tolerance,
        settings.move_turn_tolerance,
    )
    checks.real("margin", margin, low=0.0, below=1.0)
    checks.real("duration", duration, low=0.0, high=3600.0, unit="s")
    checks.real("speed", speed, low=0.0, high=0.1, unit="m/s")
    if duration > 0.0 and speed > 0.0:
        raise InvalidValue("speed", speed, "0 where a duration is given")
    return MoveGoal(target, margin, duration, speed or settings.move_speed, bool(partial))
