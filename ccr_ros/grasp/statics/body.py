# SPDX-License-Identifier: Apache-2.0
"""The object in the gripper: a rigid body with a shape, a weight, friction and a pose."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ccr_ros.model import checks
from ccr_ros.model.errors import InvalidValue
from ccr_ros.model.obstacles import (
    Box,
    Capsule,
    ConvexMesh,
    Cylinder,
    FiniteCylinder,
    Obstacle,
    Sphere,
)
from ccr_ros.model.rotation import Pose

GRAVITY = np.array([0.0, 0.0, -9.80665])  # m/s^2, of a gripper that points up

_SHAPES = (Sphere, Box, Cylinder, FiniteCylinder, Capsule, ConvexMesh)
_Z = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class Body:
    """A rigid object.

    Attributes:
        shape: Its surface, in its own frame, whose origin is the centre of mass: a `Sphere`, a
            `Box`, a `FiniteCylinder`, a `Capsule`, a `ConvexMesh`, or a `Cylinder`, which is
            infinite along its axis. `sphere_body` and its like put a shape there.
        mass: [kg].
        pose: Of its frame in the gripper's.
        friction: Coulomb coefficient between it and the fingers.

    Raises:
        InvalidValue: A value is out of range, the shape is none of these, or it has a mass whose
            centre is outside of it.
    """

    shape: Obstacle
    mass: float = 0.0
    pose: Pose = field(default_factory=Pose)
    friction: float = 0.0

    def __post_init__(self) -> None:
        if not isinstance(self.shape, _SHAPES):
            allowed = f"a {', '.join(shape.__name__ for shape in _SHAPES)}"
            raise InvalidValue("shape", type(self.shape).__name__, allowed)
        mass = checks.real("mass", self.mass, low=0, high=1e3, unit="kg")
        friction = checks.real("friction", self.friction, low=0, high=1e2)
        outside = float(self.shape.signed_distance(np.zeros((1, 3)))[0])
        if mass > 0 and outside >= 0:
            given = f"a {type(self.shape).__name__} that is {outside * 1e3:.3g} mm from its origin"
            allowed = "around the origin of its frame, which is the centre of mass"
            raise InvalidValue("shape", given, allowed)
        object.__setattr__(self, "mass", mass)
        object.__setattr__(self, "friction", friction)

    @property
    def name(self) -> str:
        """Name of the shape."""
        return self.shape.name

    def free_directions(self) -> np.ndarray:
        """Return (6, k) rigid motions that leave the body's surface as it is.

        Columns are (translation of the centre of mass, rotation vector) in the body's own frame,
        for translations in metres. A ball turns about any axis through its middle, a capsule and
        a cylinder about their own; an infinite cylinder moves along it, too.
        """
        shape = self.shape
        if isinstance(shape, Sphere):
            return _turns(shape.center, np.eye(3))
        if isinstance(shape, Capsule | FiniteCylinder):
            return _turns(shape.center, shape.axis[None])
        if isinstance(shape, Cylinder):
            along = np.concatenate([shape.axis, np.zeros(3)])
            return np.column_stack([along, _turns(shape.point, shape.axis[None])])
        return np.zeros((6, 0))


def _turns(point: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Return turns (6, k) about axes (k, 3) through a point (3,): x -> axis x (x - point)."""
    motions = np.concatenate([np.cross(point, axes), axes], axis=1)
    return (motions / np.linalg.norm(motions, axis=1)[:, None]).T


def sphere_body(
    diameter: float, mass: float = 0.0, pose: Pose | None = None, friction: float = 0.0
) -> Body:
    """Return a ball of this diameter [m], mass [kg], pose of its centre, and friction.

    Raises:
        InvalidValue: A value is out of range; so for the other bodies below.
    """
    radius = checks.real("diameter", diameter, above=0, unit="m") / 2
    return _body(Sphere(np.zeros(3), radius, name="ball"), mass, pose, friction)


def box_body(
    size: np.ndarray,
    mass: float = 0.0,
    pose: Pose | None = None,
    friction: float = 0.0,
    edge_radius: float | None = None,
) -> Body:
    """Return a box of full sizes (3,) [m] about its centre; ``edge_radius`` as for `Box`."""
    return _body(Box(np.zeros(3), size, edge_radius=edge_radius, name="box"), mass, pose, friction)


def cylinder_body(
    diameter: float,
    height: float,
    mass: float = 0.0,
    pose: Pose | None = None,
    friction: float = 0.0,
    edge_radius: float | None = None,
) -> Body:
    """Return a cylinder along z with flat ends [m]; ``edge_radius`` as for `FiniteCylinder`."""
    radius = checks.real("diameter", diameter, above=0, unit="m") / 2
    can = FiniteCylinder(np.zeros(3), _Z, height, radius, edge_radius, name="cylinder")
    return _body(can, mass, pose, friction)


def capsule_body(
    diameter: float,
    length: float,
    mass: float = 0.0,
    pose: Pose | None = None,
    friction: float = 0.0,
) -> Body:
    """Return a capsule along z; ``length`` is that between its half balls' centres [m]."""
    radius = checks.real("diameter", diameter, above=0, unit="m") / 2
    half = checks.real("length", length, above=0, unit="m") / 2
    return _body(Capsule(-half * _Z, half * _Z, radius, name="capsule"), mass, pose, friction)


def mesh_body(
    mesh: ConvexMesh, mass: float = 0.0, pose: Pose | None = None, friction: float = 0.0
) -> Body:
    """Return a convex mesh of even density, its centre of mass at the origin, axes as they were.

    The mesh's own position and orientation do not count; ``pose`` is that of the centre of mass.
    """
    centred = replace(
        mesh,
        vertices=mesh.vertices - mesh.centroid,
        position=np.zeros(3),
        orientation=np.array([0.0, 0.0, 0.0, 1.0]),
    )
    return _body(centred, mass, pose, friction)


def _body(shape: Obstacle, mass: float, pose: Pose | None, friction: float) -> Body:
    return Body(shape, mass, Pose() if pose is None else pose, friction)
