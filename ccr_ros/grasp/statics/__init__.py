# SPDX-License-Identifier: Apache-2.0
"""Fingers and the object they hold in one equilibrium, free of ROS (docs/grasp_statics.md)."""

from .body import Body, box_body, capsule_body, cylinder_body, mesh_body, sphere_body
from .closing import close_with_forces, pressing
from .disks import DiskShape
from .result import DiskContact, GraspSolution, ObjectContact
from .solver import GraspSolver

__all__ = [
    "Body",
    "DiskContact",
    "DiskShape",
    "GraspSolution",
    "GraspSolver",
    "ObjectContact",
    "box_body",
    "capsule_body",
    "close_with_forces",
    "cylinder_body",
    "mesh_body",
    "pressing",
    "sphere_body",
]
