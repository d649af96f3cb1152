# SPDX-License-Identifier: Apache-2.0
"""Between ROS messages and the servo bridge: conversions and their checks, no topics."""

from __future__ import annotations

import math

from builtin_interfaces.msg import Time as TimeMessage
from ccr_msgs.msg import CablePulls, FingerState, ServoJoint, ServoState
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from ccr_ros.actuation.axis import CableAxis
from ccr_ros.actuation.bridge import ServoBridge
from ccr_ros.actuation.faults import FaultCode
from ccr_ros.model import InvalidValue, UnknownName


def commands_from_message(message: CablePulls, cables: tuple[str, ...]) -> dict[str, float]:
    """Return the wanted pulls [m] by cable; a cable that is not named is not in it.

    Raises:
        UnknownName: A name that is no cable of the finger.
        InvalidValue: Names that occur twice, or a count that does not fit.
    """
    names, pulls = list(message.names) or list(cables), [float(pull) for pull in message.pulls]
    for name in names:
        if name not in cables:
            raise UnknownName("cable", name, cables)
        if names.count(name) > 1:
            raise InvalidValue("names", name, "given once")
    if len(names) != len(pulls):
        what = "one per name" if message.names else f"one per cable: {', '.join(cables)}"
        raise InvalidValue("pulls", pulls, f"{len(names)} numbers [m], {what} (got {len(pulls)})")
    return dict(zip(names, pulls, strict=True))


def tensions_from_message(message: FingerState) -> dict[str, float]:
    """Return the tensions [N] by cable that the solver reports; NaN: they are not in newton."""
    newton = message.forces_are == FingerState.NEWTON
    return {
        cable: float(tension) if newton else math.nan
        for cable, tension in zip(message.cables, message.tensions, strict=False)
    }


def pulls_message(stamp: TimeMessage, axes: list[CableAxis]) -> CablePulls:
    """Return the measured pulls of a finger, all its cables named."""
    return CablePulls(
        header=Header(stamp=stamp),
        names=[axis.joint.cable for axis in axes],
        pulls=[axis.pull for axis in axes],
    )


def joint_state_message(stamp: TimeMessage, bridge: ServoBridge) -> JointState:
    """Return angles [rad], velocities [rad/s] and torques [N m] of all servos."""
    return JointState(
        header=Header(stamp=stamp),
        name=list(bridge.rack.names),
        position=[axis.angle for axis in bridge.axes],
        velocity=[axis.velocity for axis in bridge.axes],
        effort=[axis.torque for axis in bridge.axes],
    )


def servo_state_message(
    stamp: TimeMessage, bridge: ServoBridge | None, driver: str, reason: str
) -> ServoState:
    """Return the state of the bridge; None: it is not configured, for a reason."""
    message = ServoState(header=Header(stamp=stamp), driver=driver)
    if bridge is None:
        message.state, message.reason = ServoState.UNCONFIGURED, reason
        return message
    message.state = int(bridge.state)
    message.reason = bridge.reason
    fault = bridge.fault
    message.fault = int(fault.code if fault else FaultCode.NO_FAULT)
    message.joint = fault.joint if fault else ""
    message.joints = [_joint_message(axis) for axis in bridge.axes]
    return message


def _joint_message(axis: CableAxis) -> ServoJoint:
    return ServoJoint(
        name=axis.joint.name,
        finger=axis.joint.finger,
        cable=axis.joint.cable,
        pull_commanded=math.nan if axis.command is None else axis.command,
        pull_setpoint=axis.pull_setpoint,
        pull=axis.pull,
        tension=axis.tension,
        temperature=axis.temperature,
        calibrated=axis.calibrated,
        moving=axis.moving,
        stale=axis.stale,
    )
