# SPDX-License-Identifier: Apache-2.0
"""Between ROS messages and the model: conversions and their checks, no physics, no topics."""

from __future__ import annotations

import numpy as np
from builtin_interfaces.msg import Time as TimeMessage
from ccr_msgs.msg import CablePulls, FingerState, SolveCertificate
from ccr_msgs.msg import Contact as ContactMessage
from geometry_msgs.msg import Point, PoseArray, Quaternion, TransformStamped, Vector3
from geometry_msgs.msg import Pose as PoseMessage
from std_msgs.msg import Header

from ccr_ros.model import Certificate, Contact, Finger, InvalidValue, Pose, Solution


def pulls_from_message(message: CablePulls, finger: Finger) -> np.ndarray:
    """Return the pulls (m,) [m] in the finger's cable order; a cable that is not named: 0.

    Raises:
        UnknownName: A name that is no cable of the finger.
        InvalidValue: Names that occur twice, a count that does not fit, or a pull that is not
            finite or beyond the finger's length.
    """
    names, values = list(message.names), [float(v) for v in message.pulls]
    if not names:
        return finger.pulls_array(values)
    for name in names:
        if names.count(name) > 1:
            raise InvalidValue("names", name, "given once")
    if len(names) != len(values):
        raise InvalidValue(
            "pulls", values, f"{len(names)} numbers [m], one per name (got {len(values)})"
        )
    return finger.pulls_array(dict(zip(names, values, strict=True)))


def pose_message(position: np.ndarray, orientation: np.ndarray) -> PoseMessage:
    """Return a pose from a position (3,) [m] and a quaternion (4,) (x, y, z, w)."""
    x, y, z = map(float, position)
    qx, qy, qz, qw = map(float, orientation)
    return PoseMessage(
        position=Point(x=x, y=y, z=z), orientation=Quaternion(x=qx, y=qy, z=qz, w=qw)
    )


def pose_array(header: Header, points: np.ndarray, orientations: np.ndarray) -> PoseArray:
    """Return poses at points (k, 3) [m], each with the orientation of its disk, (>= k, 4)."""
    return PoseArray(
        header=header,
        poses=[pose_message(p, q) for p, q in zip(points, orientations, strict=False)],
    )


def state_message(header: Header, solution: Solution, stale: bool, dropped: int) -> FingerState:
    """Return the state of a finger; everything in it is in the finger's base frame."""
    tip = solution.tip
    return FingerState(
        header=header,
        finger=solution.finger.name,
        cables=list(solution.finger.cable_names),
        pulls=solution.pulls.tolist(),
        tensions=solution.tensions.tolist(),
        slack=[bool(slack) for slack in solution.slack],
        forces_are=solution.finger.forces_are,
        contacts=[contact_message(contact) for contact in solution.contacts],
        tip=pose_message(tip.position, tip.orientation),
        energy=float(solution.energy),
        certificate=certificate_message(solution.certificate),
        stale=stale,
        dropped=dropped,
    )


def contact_message(contact: Contact) -> ContactMessage:
    """Return one contact, in the frame it is in."""
    x, y, z = map(float, contact.position)
    nx, ny, nz = map(float, contact.normal)
    return ContactMessage(
        disk=int(contact.disk),
        point=contact.point,
        cable=contact.cable,
        obstacle=contact.obstacle,
        position=Point(x=x, y=y, z=z),
        normal=Vector3(x=nx, y=ny, z=nz),
        force=float(contact.force),
    )


def certificate_message(certificate: Certificate) -> SolveCertificate:
    """Return a certificate; its texts stay behind (they go to diagnostics)."""
    return SolveCertificate(
        converged=bool(certificate.converged),
        stable=bool(certificate.stable),
        branch_jump=bool(certificate.branch_jump),
        kkt=float(certificate.kkt),
        cable_error=float(certificate.cable_error),
        penetration=float(certificate.penetration),
        smallest_eigenvalue=float(certificate.smallest_eigenvalue),
        iterations=int(certificate.iterations),
        solve_time=float(certificate.solve_time),
    )


def transform_message(stamp: TimeMessage, parent: str, child: str, pose: Pose) -> TransformStamped:
    """Return the transform that is the pose of ``child`` in ``parent``."""
    message = TransformStamped(header=Header(stamp=stamp, frame_id=parent), child_frame_id=child)
    x, y, z = map(float, pose.position)
    message.transform.translation = Vector3(x=x, y=y, z=z)
    message.transform.rotation = pose_message(pose.position, pose.orientation).orientation
    return message
