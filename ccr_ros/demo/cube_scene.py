# SPDX-License-Identifier: Apache-2.0
"""What the cube's demo is about: the paper's cube on a small table, and how far it is turned."""

from __future__ import annotations

import math

import numpy as np

from ccr_ros.model import Pose
from ccr_ros.viz.recording import SolidObject

GRIPPER_FILE = "gripper_cube"  # also of the nodes' parameters

EDGE = 0.040  # m; the paper's cube (section 4.1), its centre so far above the base plane:
HEIGHT = 0.170  # m
MASS = 0.010  # kg, as of foam
FRICTION = 0.8  # of rubber on the fingers
ON_TABLE = Pose(np.array([0.0, 0.0, HEIGHT]))
CUBE = SolidObject("cube", "box", (EDGE, EDGE, EDGE), ON_TABLE)

GRIP_FORCE = 0.06  # N of each finger; of the one opposite two twice as much
TURN = math.radians(20.0)  # to either side

# Drawn under the cube while it stands; the top is a place just below the cube.
_TOP, _LEG = (0.036, 0.036, 0.004), (HEIGHT - EDGE / 2 - 0.004, 0.004)
TABLE = (
    SolidObject("table", "box", _TOP, Pose(np.array([0.0, 0.0, -_TOP[2] / 2]))),
    SolidObject("leg", "cylinder", _LEG, Pose(np.array([0.0, 0.0, -_TOP[2] - _LEG[0] / 2]))),
)
