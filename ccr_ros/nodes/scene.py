# SPDX-License-Identifier: Apache-2.0
"""The objects that the fingers of a gripper may touch: taken from messages all or none."""

from __future__ import annotations

from collections.abc import Sequence

from ccr_msgs.msg import ObjectArray

from ccr_ros.model import CcrError, InvalidValue
from ccr_ros.viz.recording import SolidObject

from .conversions import bodies_from_message, obstacle_from_body
from .finger_channel import FingerChannel


class ObjectScene:
    """Gives every finger the objects as obstacles, beside those of its own file, which stay.

    Args:
        fingers: The fingers.
        frame: The gripper's frame, in which objects are given.
    """

    def __init__(self, fingers: Sequence[FingerChannel], frame: str) -> None:
        self._fingers = tuple(fingers)
        self._frame = frame
        self._own = [finger.finger.obstacles for finger in self._fingers]
        self.bodies: tuple[SolidObject, ...] = ()
        self.fault = ""  # why the newest message was refused

    def take(self, message: ObjectArray) -> bool:
        """Replace all objects by a message's; return whether anything is different now.

        Raises:
            CcrError: The message is not valid, or an object overlaps a finger's base; the
                objects are as they were.
        """
        try:
            bodies = bodies_from_message(message, self._frame)
            changed = list(map(_key, bodies)) != list(map(_key, self.bodies))
            if changed:
                self._give(bodies)
        except CcrError as error:
            self.fault = f"objects refused: {error}"
            raise
        self.fault = ""
        self.bodies = bodies
        return changed

    def _give(self, bodies: tuple[SolidObject, ...]) -> None:
        before = [finger.solver.obstacles for finger in self._fingers]
        try:
            for finger, own in zip(self._fingers, self._own, strict=True):
                for body in bodies:
                    if body.name in (obstacle.name for obstacle in own):
                        allowed = (
                            f"unlike the obstacles in the file of finger {finger.finger.name!r}"
                        )
                        raise InvalidValue("objects.name", body.name, allowed)
                to_finger = finger.base.inverse()
                objects = [obstacle_from_body(body).moved(to_finger) for body in bodies]
                finger.set_obstacles((*own, *objects))
        except CcrError:
            for finger, obstacles in zip(self._fingers, before, strict=True):
                finger.set_obstacles(obstacles)
            raise


def _key(body: SolidObject) -> tuple[object, ...]:
    position, orientation = body.pose.position.tolist(), body.pose.orientation.tolist()
    return body.name, body.shape, position, orientation
