# SPDX-License-Identifier: Apache-2.0
"""What the demo does: how far each finger's cable is pulled when, and what is there to close on.

Pulls are percentages of the cable's length inside the finger at rest, as functions of time; no ROS
here. For the fingers of config/gripper_sphere.yaml, 3.0 % lays the disks on the sphere and more
presses on it. Beyond 3.5 % the pressed pose is no minimum of energy any more (a real finger would
slip off sideways), so the script stays below.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ccr_ros.model import InvalidValue, Pose, checks
from ccr_ros.viz.recording import SolidObject

GRIPPER_FILE = "gripper_sphere"

# The paper's sphere (section 4.1): 112 mm in diameter, centre 110 mm above the base plane.
BALL = SolidObject("ball", "sphere", (0.056,), Pose(np.array([0.0, 0.0, 0.110])))

MIN_SECONDS, MAX_SECONDS = 3.0, 45.0

# (share of the run, pull [%]); eased in between, so that every key is a rest.
_Keys = tuple[tuple[float, float], ...]
_TOGETHER: _Keys = ((0.0, 0.0), (0.06, 0.0), (0.32, 3.2), (0.70, 3.2), (0.94, 0.0), (1.0, 0.0))
# Comes later, draws back once before it touches, presses less, leaves first.
_APART: _Keys = (
    (0.0, 0.0),
    (0.12, 0.0),
    (0.26, 2.4),
    (0.34, 1.4),
    (0.45, 3.1),
    (0.64, 3.1),
    (0.84, 0.0),
    (1.0, 0.0),
)
_PHASES = ((0.0, "open"), (0.06, "close"), (0.32, "hold"), (0.64, "release"), (0.94, "open"))


@dataclass(frozen=True)
class PullScript:
    """Fingers close and open again, all alike but the last, which has a rhythm of its own.

    Attributes:
        fingers: Names of the fingers.
        seconds: How long it takes, 3..45 s.

    Raises:
        InvalidValue: The time is out of its range, or there is no finger.
    """

    fingers: tuple[str, ...]
    seconds: float

    def __post_init__(self) -> None:
        checks.real("seconds", self.seconds, low=MIN_SECONDS, high=MAX_SECONDS, unit="s")
        if not self.fingers:
            raise InvalidValue("fingers", self.fingers, "at least one finger")

    def percent(self, finger: str, time: float) -> float:
        """Return the pull [% of the rest length] of a finger's cable at a time [s].

        Before the start and after the end it is 0.
        """
        apart = len(self.fingers) > 1 and finger == self.fingers[-1]
        return _eased(_APART if apart else _TOGETHER, time / self.seconds)

    def phase(self, time: float) -> str:
        """Return the name of what most fingers do at a time [s]: open, close, hold or release."""
        share = time / self.seconds
        return [name for start, name in _PHASES if start <= max(share, 0.0)][-1]


def _eased(keys: _Keys, share: float) -> float:
    """Return the value between the keys around a share; velocity and acceleration are 0 at keys."""
    if share <= keys[0][0]:
        return keys[0][1]
    for (start, low), (end, high) in pairwise(keys):
        if share <= end:
            s = (share - start) / (end - start)
            return low + (high - low) * s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
    return keys[-1][1]
