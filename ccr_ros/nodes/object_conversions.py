# SPDX-License-Identifier: Apache-2.0
"""From ObjectArray messages to the objects of a scene, all of a message or none."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from ccr_msgs.msg import Object, ObjectArray
from shape_msgs.msg import SolidPrimitive

from ccr_ros.model import (
    Box,
    Capsule,
    ConvexMesh,
    FiniteCylinder,
    InvalidValue,
    Obstacle,
    Pose,
    Sphere,
    UnknownName,
)
from ccr_ros.viz.solids import SolidObject

_KINDS = {
    SolidPrimitive.BOX: "box",
    SolidPrimitive.SPHERE: "sphere",
    SolidPrimitive.CYLINDER: "cylinder",
}
_OTHER_KINDS = {SolidPrimitive.CONE: "CONE", SolidPrimitive.PRISM: "PRISM"}


@dataclass(frozen=True, eq=False)
class SceneObject:
    """An object as a message tells of it.

    Attributes:
        solid: What it looks like, at its pose in the gripper's frame.
        shape: Its surface in its own frame.
        mass: [kg].
        friction: Coulomb coefficient.
        held: Whether the fingers alone shall carry it.
    """

    solid: SolidObject
    shape: Obstacle
    mass: float
    friction: float
    held: bool

    @property
    def name(self) -> str:
        """Its name."""
        return self.solid.name

    @property
    def pose(self) -> Pose:
        """Its pose in the gripper's frame, as the message has it."""
        return self.solid.pose

    @property
    def form(self) -> tuple[object, ...]:
        """What tells it from objects that touch otherwise, wherever they are."""
        return self.name, self.solid.shape, self.friction

    @property
    def key(self) -> tuple[object, ...]:
        """What tells it from other obstacles."""
        position, orientation = self.pose.position.tolist(), self.pose.orientation.tolist()
        return (*self.form, position, orientation)

    def obstacle(self) -> Obstacle:
        """Return its surface in the gripper's frame."""
        return self.shape.moved(self.pose)

    def seen_at(self, pose: Pose) -> SolidObject:
        """Return what it looks like at another pose."""
        return replace(self.solid, pose=pose)


def objects_from_message(
    message: ObjectArray, gripper_frame: str, known: Sequence[SceneObject] = ()
) -> tuple[SceneObject, ...]:
    """Return the objects in the gripper's frame.

    Args:
        message: The message.
        gripper_frame: The gripper's frame.
        known: Objects of the message before: a mesh that is the same need not be looked at again.

    Raises:
        UnknownName: The frame is not the gripper's.
        InvalidValue: A name is empty or occurs twice, a primitive is of a kind not known here, a
            mesh is not a convex body, or a size, pose, mass or friction is bad.
        MissingPackage: A mesh is given, and scipy is not installed.
    """
    if message.header.frame_id not in ("", gripper_frame):
        raise UnknownName("frame", message.header.frame_id, [gripper_frame])
    objects: list[SceneObject] = []
    for index, item in enumerate(message.objects):
        place = f"objects[{index}]"
        try:
            objects.append(_object(item, known))
        except InvalidValue as error:
            raise error.located(place) from None
        if item.name in (other.name for other in objects[:-1]):
            raise InvalidValue(f"{place}.name", item.name, "unique among the objects")
    return tuple(objects)


def obstacle_from_body(body: SolidObject) -> Obstacle:
    """Return the obstacle that a body is to a finger, in the body's frame of reference.

    Raises:
        InvalidValue: A mesh is not a convex body; says where.
        MissingPackage: A mesh is given, and scipy is not installed.
    """
    position, axis, size = body.pose.position, body.pose.rotation[:, 2], body.dimensions
    if body.vertices is not None and body.faces is not None:
        return ConvexMesh(
            body.vertices, body.faces, position, body.pose.orientation, name=body.name
        )
    if body.kind == "sphere":
        return Sphere(position, size[0], name=body.name)
    if body.kind == "box":
        return Box(position, np.array(size), body.pose.orientation, name=body.name)
    if body.kind == "capsule":
        half = size[0] / 2 * axis
        return Capsule(position - half, position + half, size[1], name=body.name)
    return FiniteCylinder(position, axis, size[0], size[1], name=body.name)


def _object(item: Object, known: Sequence[SceneObject]) -> SceneObject:
    for key in ("mass", "friction"):
        value = float(getattr(item, key))
        if not 0.0 <= value < math.inf:
            raise InvalidValue(key, value, "a finite number >= 0")
    solid = _solid(item)
    shape: Obstacle | None = next(
        (k.shape for k in known if (k.name, k.solid.shape) == (item.name, solid.shape)), None
    )
    if shape is None:
        try:
            shape = obstacle_from_body(replace(solid, pose=Pose()))
        except InvalidValue as error:  # what is not known of it until now
            raise error.located("primitive" if solid.vertices is None else "mesh") from None
    return SceneObject(solid, shape, float(item.mass), float(item.friction), bool(item.held))


def _solid(item: Object) -> SolidObject:
    p, q = item.pose.position, item.pose.orientation
    try:
        pose = Pose(np.array([p.x, p.y, p.z]), np.array([q.x, q.y, q.z, q.w]))
    except InvalidValue as error:
        raise error.located("pose") from None
    if item.mesh.vertices and not len(item.primitive.dimensions):
        try:
            return _mesh(item, pose)
        except InvalidValue as error:
            raise error.located("mesh") from None
    kind = _KINDS.get(item.primitive.type)
    if kind is None:
        given = _OTHER_KINDS.get(item.primitive.type, item.primitive.type)
        raise InvalidValue("primitive.type", given, "BOX, SPHERE or CYLINDER")
    return SolidObject(item.name, kind, tuple(item.primitive.dimensions), pose)


def _mesh(item: Object, pose: Pose) -> SolidObject:
    vertices = np.array([[v.x, v.y, v.z] for v in item.mesh.vertices])
    faces = np.array([t.vertex_indices for t in item.mesh.triangles], dtype=int)
    if not len(faces):
        hull = ConvexMesh.hull_of(vertices)
        vertices, faces = hull.vertices, hull.faces
    return SolidObject(item.name, "mesh", (), pose, vertices, faces)
