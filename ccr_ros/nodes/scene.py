# SPDX-License-Identifier: Apache-2.0
"""The objects that the fingers of a gripper may touch: taken from messages all or none."""

from __future__ import annotations

from collections.abc import Sequence

from ccr_msgs.msg import ObjectArray

from ccr_ros.model import CcrError, InvalidValue

from .finger_channel import FingerChannel
from .grasp_channel import GraspChannel
from .object_conversions import SceneObject, objects_from_message


class ObjectScene:
    """Gives every finger the objects as obstacles, beside those of its own file, which stay.

    Args:
        fingers: The fingers.
        frame: The gripper's frame, in which objects are given.
        grasp: What takes the object in hand, which then is no obstacle; None: nothing does.
    """

    def __init__(
        self, fingers: Sequence[FingerChannel], frame: str, grasp: GraspChannel | None = None
    ) -> None:
        self._fingers = tuple(fingers)
        self._frame = frame
        self._grasp = grasp
        self._own = [finger.finger.obstacles for finger in self._fingers]
        self._in_hand: SceneObject | None = None
        self.objects: tuple[SceneObject, ...] = ()
        self.fault = ""  # why the newest message was refused

    def take(self, message: ObjectArray) -> bool:
        """Replace all objects by a message's; return whether there is something to be solved.

        Raises:
            CcrError: The message is not valid, or an object overlaps a finger's base; the
                objects are as they were.
        """
        try:
            objects = objects_from_message(message, self._frame, self.objects)
            self._check_names(objects)
            due = self._put(objects)
        except CcrError as error:
            self.fault = f"objects refused: {error}"
            raise
        self.fault = ""
        self.objects = objects
        return due

    def _check_names(self, objects: Sequence[SceneObject]) -> None:
        for finger, own in zip(self._fingers, self._own, strict=True):
            for item in objects:
                if item.name in (obstacle.name for obstacle in own):
                    allowed = f"unlike the obstacles in the file of finger {finger.finger.name!r}"
                    raise InvalidValue("objects.name", item.name, allowed)

    def _put(self, objects: Sequence[SceneObject]) -> bool:
        in_hand = None if self._grasp is None else self._grasp.choose(objects)
        self._check_weight(in_hand)
        before = [o for o in self.objects if o is not self._in_hand]
        others = [o for o in objects if o is not in_hand]
        changed = [o.key for o in others] != [o.key for o in before]
        changed |= _name(in_hand) != _name(self._in_hand)
        if changed:
            self._give(others)
        due = False
        if self._grasp is not None:
            try:
                due = self._grasp.take(in_hand, changed)
            except CcrError:
                if changed:
                    self._give(before)
                raise
        self._in_hand = in_hand
        return changed or due

    def _check_weight(self, in_hand: SceneObject | None) -> None:
        per_ei = [f.finger.name for f in self._fingers if f.finger.forces_are != "newton"]
        if in_hand is not None and in_hand.mass > 0 and per_ei:
            allowed = f"0: forces are per EI, as {per_ei[0]} has no youngs_modulus"
            raise InvalidValue(f"objects.{in_hand.name}.mass", in_hand.mass, allowed)

    def _give(self, objects: Sequence[SceneObject]) -> None:
        before = [finger.solver.obstacles for finger in self._fingers]
        try:
            for finger, own in zip(self._fingers, self._own, strict=True):
                to_finger = finger.base.inverse()
                found = [item.obstacle().moved(to_finger) for item in objects]
                finger.set_obstacles((*own, *found))
        except CcrError:
            for finger, obstacles in zip(self._fingers, before, strict=True):
                finger.set_obstacles(obstacles)
            raise


def _name(item: SceneObject | None) -> str | None:
    return None if item is None else item.name
