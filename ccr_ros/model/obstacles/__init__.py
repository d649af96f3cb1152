# SPDX-License-Identifier: Apache-2.0
"""Rigid bodies that fingers touch, as smooth signed distances; one class for each shape."""

from .base import Obstacle
from .convex_mesh import ConvexMesh
from .primitives import Box, Cylinder, Plane, Sphere
from .rounded import Capsule, FiniteCylinder

__all__ = [
    "Box",
    "Capsule",
    "ConvexMesh",
    "Cylinder",
    "FiniteCylinder",
    "Obstacle",
    "Plane",
    "Sphere",
]
