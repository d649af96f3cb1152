# SPDX-License-Identifier: Apache-2.0
"""What the demo is about: the paper's sphere, its stand, and how it gets heavier."""

from __future__ import annotations

import numpy as np

from ccr_ros.model import Pose, checks
from ccr_ros.viz.recording import SolidObject

GRIPPER_FILE = "gripper_sphere"

DIAMETER = 0.112  # m; the paper's sphere (section 4.1), its centre so far above the base plane:
HEIGHT = 0.110  # m
# Of foam, before and after something is put on it [kg]. Without friction, fingers that press with
# 0.3 N carry 35 g from below, and more from above (a gripper that points down).
LIGHT, HEAVY = 0.010, 0.025
ON_STAND = Pose(np.array([0.0, 0.0, HEIGHT]))
BALL = SolidObject("ball", "sphere", (DIAMETER / 2,), ON_STAND)

GRIP_FORCE = 0.30  # N of each finger
MIN_HOLD, MAX_HOLD = 2.0, 120.0  # s


def checked_hold(seconds: float) -> float:
    """Return how long the ball is held [s].

    Raises:
        InvalidValue: Out of 2..120 s.
    """
    return checks.real("hold", seconds, low=MIN_HOLD, high=MAX_HOLD, unit="s")
