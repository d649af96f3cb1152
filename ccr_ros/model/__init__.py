# SPDX-License-Identifier: Apache-2.0
"""Physics of cable-driven continuum fingers, free of ROS.

The modules are loaded when a name of theirs is first asked for: commands and nodes that need
``ccr_ros.model.errors`` alone do not wait for the optimiser.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .errors import CcrError, InvalidFile, InvalidValue, NotConverged, UnknownName
    from .files import Gripper, MountedFinger, finger_from_dict, load_finger, load_gripper
    from .finger import Cable, Finger
    from .obstacles import (
        Box,
        Capsule,
        ConvexMesh,
        Cylinder,
        FiniteCylinder,
        Obstacle,
        Plane,
        Sphere,
    )
    from .rotation import Pose
    from .sensitivity import Sensitivity
    from .settings import SolverSettings
    from .solution import Certificate, Contact, Solution
    from .solver import FingerSolver, solve

__all__ = [
    "Box",
    "Cable",
    "Capsule",
    "CcrError",
    "Certificate",
    "Contact",
    "ConvexMesh",
    "Cylinder",
    "Finger",
    "FingerSolver",
    "FiniteCylinder",
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

_MODULES = (
    "errors", "files", "finger", "obstacles", "rotation", "sensitivity", "settings", "solution",
    "solver",
)  # fmt: skip


def __getattr__(name: str) -> Any:
    if name in __all__:
        for module in _MODULES:
            value = getattr(import_module(f"{__name__}.{module}"), name, None)
            if value is not None:
                return value
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
