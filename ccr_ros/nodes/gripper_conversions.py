# SPDX-License-Identifier: Apache-2.0
"""Between ROS messages and the coordinator: conversions and their checks, no topics."""

from __future__ import annotations

import numpy as np
from ccr_msgs.msg import CablePulls, Contact, FingerGrip, FingerState, GripperState, ServoState
from std_msgs.msg import Header

from ccr_ros.grasp.coordinator import GripperCoordinator
from ccr_ros.grasp.finger_control import FingerControl, SolvedFinger
from ccr_ros.grasp.watch import ServoHealth
from ccr_ros.model import InvalidValue

_SERVO_STATES = {
    ServoState.UNCONFIGURED: "not configured",
    ServoState.INACTIVE: "not active",
    ServoState.CALIBRATING: "calibrating",
    ServoState.STOPPED: "stopped",
    ServoState.FAULT: "fault",
}


def solved_finger(message: FingerState, finger: FingerControl) -> SolvedFinger:
    """Return what the solver says of a finger.

    Raises:
        InvalidValue: The message is of a finger with other cables.
    """
    if tuple(message.cables) != finger.cables:
        raise InvalidValue(
            "cables", list(message.cables), f"those of {finger.name}: {', '.join(finger.cables)}"
        )
    return SolvedFinger(
        pulls=np.array(message.pulls),
        tensions=np.array(message.tensions),
        contacts=tuple((contact.obstacle, contact.force) for contact in message.contacts),
        stale=bool(message.stale),
        stable=bool(message.certificate.stable),
    )


def servo_health(message: ServoState) -> ServoHealth:
    """Return what the servo bridge says of itself."""
    what = _SERVO_STATES.get(message.state, f"state {message.state}")
    reason = f"{what}: {message.reason}" if message.reason else what
    return ServoHealth(active=message.state == ServoState.ACTIVE, reason=reason, heard=True)


def servo_tensions(message: ServoState, finger: FingerControl) -> np.ndarray:
    """Return the tensions (m,) [N] that the servos feel; NaN: not known."""
    felt = {joint.cable: joint.tension for joint in message.joints if joint.finger == finger.name}
    return np.array([felt.get(cable, np.nan) for cable in finger.cables])


def command_message(header: Header, finger: FingerControl) -> CablePulls:
    """Return a finger's command."""
    return CablePulls(header=header, names=list(finger.cables), pulls=finger.command.tolist())


def finger_grip(
    gripper: GripperCoordinator, finger: FingerControl, contacts: list[Contact]
) -> FingerGrip:
    """Return one finger as the coordinator sees it."""
    grip, tolerance = gripper.grip, gripper.settings.place_tolerance
    return FingerGrip(
        finger=finger.name,
        cables=list(finger.cables),
        pulls_commanded=finger.command.tolist(),
        pulls_measured=[] if finger.measured is None else finger.measured.tolist(),
        tensions=finger.tensions.tolist(),
        force=finger.force(),
        force_target=gripper.target(finger),
        in_contact=grip.touches(finger),
        effort_agrees=bool(grip.agrees(finger)),
        at_limit=bool(finger.measured_place >= finger.path.length - tolerance),
        contacts=contacts,
    )


def gripper_state(
    header: Header, gripper: GripperCoordinator, now: float, fingers: list[FingerGrip]
) -> GripperState:
    """Return the gripper's state."""
    return GripperState(
        header=header,
        state=str(gripper.state),
        phase=gripper.phase,
        message=gripper.message,
        refusal=gripper.refusal,
        object_held=bool(gripper.object_held),
        target_force=float(gripper.target_force),
        release_in=float(gripper.release_in(now)),
        fingers=fingers,
    )
