# SPDX-License-Identifier: Apache-2.0
"""Where objects are: as they were told, or as they were solved; and what stands under one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from ccr_msgs.msg import GraspContact, GraspState
from geometry_msgs.msg import Point, Vector3
from geometry_msgs.msg import Pose as PoseMessage

from ccr_ros.model import Pose
from ccr_ros.viz.recorded_grasp import GripContact, GripFrame
from ccr_ros.viz.recording import SolidObject
from ccr_ros.viz.shapes import surface


class ObjectsSeen:
    """Puts together what a recording shows of objects.

    Args:
        support: What is drawn under the object in hand while the fingers do not carry it, at
            poses relative to the middle of a place just below it.
    """

    def __init__(self, support: Sequence[SolidObject] = ()) -> None:
        self._support = tuple(support)
        self._told: tuple[SolidObject, ...] = ()
        self._name = ""  # of the object in hand
        self._solved: Pose | None = None
        self._held = False

    def take_objects(self, objects: Sequence[SolidObject]) -> None:
        """Take the objects as they were told."""
        self._told = tuple(objects)

    def take_grasp(self, message: GraspState) -> GripFrame | None:
        """Take what the solver says of the object in hand; return what a frame shows of it."""
        if message.object != self._name:
            self._name, self._solved = message.object, None
        self._held = message.held
        if not self._name or self._name not in (body.name for body in self._told):
            return None
        self.take_pose(message.pose)
        return GripFrame(self._name, self._held, tuple(map(_contact, message.contacts)))

    def take_pose(self, message: PoseMessage) -> None:
        """Take where the object in hand is; not told yet what it is, this is left out."""
        if self._name:
            p, q = message.position, message.orientation
            self._solved = Pose(np.array([p.x, p.y, p.z]), np.array([q.x, q.y, q.z, q.w]))

    def bodies(self) -> list[SolidObject]:
        """Return all that is there now."""
        bodies = []
        for body in self._told:
            if body.name == self._name and self._solved is not None:
                body = replace(body, pose=self._solved)
            bodies.append(body)
            if body.name == self._name and not self._held:
                bodies += self._under(body)
        return bodies

    def _under(self, body: SolidObject) -> list[SolidObject]:
        lowest = float(surface(body).vertices[:, 2].min())
        place = Pose(np.array([*body.pose.position[:2], lowest]))
        return [replace(part, pose=place @ part.pose) for part in self._support]


def _contact(message: GraspContact) -> GripContact:
    return GripContact(
        finger=message.finger,
        position=_vector(message.position),
        force=message.normal_force,
        friction=_vector(message.friction_force),
        margin=None if math.isnan(message.margin) else message.margin,
    )


def _vector(message: Point | Vector3) -> np.ndarray:
    return np.array([message.x, message.y, message.z])
