# SPDX-License-Identifier: Apache-2.0
"""What a gripper says, as values in a person's words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class GripperReport:
    """What the gripper says of itself, or what became of a call.

    Attributes:
        state: One of ``GripperState``'s texts, e.g. ``holding``.
        message: Why.
        done: What was asked for is so.
        forces: Contact force [N] by finger.
        in_contact: Names of the fingers that touch.
        object_held: Whether all required fingers press on the object.
        release_in: Time until a release begins [s]; negative: none waits.
    """

    state: str
    message: str
    done: bool
    forces: dict[str, float]
    in_contact: tuple[str, ...]
    object_held: bool = False
    release_in: float = -1.0


@dataclass(frozen=True)
class MoveReport:
    """How a motion of what is held ended, in the gripper's frame.

    Attributes:
        state: As in ``ccr_msgs/msg/GripperState``.
        message: What happened.
        done: The object is measured where it was asked to be.
        limiting: The constraint that refused or stopped it; empty: none did.
        shift: (x, y, z) of its centre [m], from where it was; turn: rotation vector [rad].
        position: (x, y, z) of its centre [m].
        orientation: (x, y, z, w).
        margin: Smallest friction margin of its contacts; nan: not known, or without friction.
        fraction: Of the planned pulls that the fingers were sent, from 0 to 1.
    """

    state: str
    message: str
    done: bool
    limiting: str
    shift: tuple[float, float, float]
    turn: tuple[float, float, float]
    position: tuple[float, float, float]
    orientation: tuple[float, float, float, float]
    margin: float
    fraction: float


@dataclass(frozen=True)
class GraspReport:
    """What the solver says of the object in hand, in the gripper's frame.

    Attributes:
        object: Its name.
        held: The fingers alone carry it.
        position: (x, y, z) of its centre [m].
        orientation: (x, y, z, w).
        mass: [kg].
        forces: Normal force [N] by finger that presses on it, all its contacts together.
        margin: How far the worst contact is from slipping: 0 (slips) to 1; nan without friction.
        force_closure: The contacts could balance whatever pushes it.
        payload: [N] largest weight that the contacts could carry as hard as they press now; nan:
            not known.
        stable: The slightest disturbance does not make it fall.
        stale: This is the last that was known; the newest pulls have no solution.
        message: What is not as wanted.
    """

    object: str
    held: bool
    position: tuple[float, float, float]
    orientation: tuple[float, float, float, float]
    mass: float
    forces: dict[str, float]
    margin: float
    force_closure: bool
    payload: float
    stable: bool
    stale: bool
    message: str


def gripper_report(message: Any, done: bool) -> GripperReport:
    """Return the report in a ``GripperState``, or in the result of one of its actions."""
    fingers = message.fingers
    touching = tuple(finger.finger for finger in fingers if finger.in_contact)
    return GripperReport(
        state=message.state,
        message=message.message,
        done=done,
        forces={finger.finger: finger.force for finger in fingers},
        in_contact=touching,
        object_held=getattr(message, "object_held", message.state == "holding"),
        release_in=getattr(message, "release_in", -1.0),
    )


def move_report(message: Any) -> MoveReport:
    """Return the report in a result of ``MoveObject`` or ``Rotate``."""
    motion = message.motion
    p, q = motion.pose.position, motion.pose.orientation
    return MoveReport(
        state=message.state,
        message=message.message,
        done=message.reached,
        limiting=message.limiting,
        shift=(motion.shift.x, motion.shift.y, motion.shift.z),
        turn=(motion.turn.x, motion.turn.y, motion.turn.z),
        position=(p.x, p.y, p.z),
        orientation=(q.x, q.y, q.z, q.w),
        margin=motion.margin,
        fraction=motion.fraction,
    )


def grasp_report(message: Any) -> GraspReport | None:
    """Return the report in a ``GraspState``; None where it is of no object."""
    if not message.object:
        return None
    forces: dict[str, float] = {}
    for contact in message.contacts:
        forces[contact.finger] = forces.get(contact.finger, 0.0) + contact.normal_force
    p, q = message.pose.position, message.pose.orientation
    return GraspReport(
        object=message.object,
        held=message.held,
        position=(p.x, p.y, p.z),
        orientation=(q.x, q.y, q.z, q.w),
        mass=message.mass,
        forces=forces,
        margin=message.quality.margin,
        force_closure=message.quality.force_closure,
        payload=message.quality.payload,
        stable=message.stable,
        stale=message.stale,
        message=message.message,
    )
