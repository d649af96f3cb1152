# SPDX-License-Identifier: Apache-2.0
"""Physics of cable-driven continuum fingers, free of ROS."""

from .errors import CcrError, InvalidFile, InvalidValue, NotConverged, UnknownName
from .files import Gripper, MountedFinger, finger_from_dict, load_finger, load_gripper
from .finger import Cable, Finger
from .obstacles import Box, Cylinder, Obstacle, Plane, Sphere
from .rotation import Pose
from .sensitivity import Sensitivity
from .settings import SolverSettings
from .solution import Certificate, Contact, Solution
from .solver import FingerSolver, solve

__all__ = [
    "Box",
    "Cable",
    "CcrError",
    "Certificate",
    "Contact",
    "Cylinder",
    "Finger",
    "FingerSolver",
    "Gripper",
    "InvalidFile",
    "InvalidValue",
    "MountedFinger",
    "NotConverged",
    "Obstacle",
    "Plane",
    "Pose",
    "Sensitivity",
    "Solution",
    "SolverSettings",
    "Sphere",
    "UnknownName",
    "finger_from_dict",
    "load_finger",
    "load_gripper",
    "solve",
]
