# SPDX-License-Identifier: Apache-2.0
"""From a solution of fingers and object to messages, all in the gripper's frame."""

from __future__ import annotations

import numpy as np
from ccr_msgs.msg import GraspContact, GraspQuality, GraspState
from geometry_msgs.msg import Point, Vector3, Wrench
from std_msgs.msg import Header

from ccr_ros.grasp.statics import Body, GraspSolution, ObjectContact

from .conversions import pose_message
from .quality_watch import unknown_quality


def grasp_message(
    header: Header,
    solution: GraspSolution,
    quality: GraspQuality,
    held: bool,
    stale: bool,
    message: str,
) -> GraspState:
    """Return the state of the object.

    Args:
        header: With the gripper's frame, and the stamp of what the solution answers to.
        solution: The last good one.
        quality: Of it, as far as it is known.
        held: Whether the fingers carry the object.
        stale: Whether the solution is out of date.
        message: What is not as wanted.
    """
    body = solution.body
    return GraspState(
        header=header,
        object=body.name,
        pose=pose_message(body.pose.position, body.pose.orientation),
        held=held,
        mass=float(body.mass),
        friction=float(body.friction),
        forces_are=solution.fingers[0].finger.forces_are,
        contacts=[grasp_contact(c, body.pose.position) for c in solution.contacts],
        net=_wrench(solution.net_force, solution.net_moment),
        quality=quality,
        stable=bool(solution.stable),
        softest=solution.softest,
        smallest_eigenvalue=float(solution.smallest_eigenvalue),
        stale=stale,
        message=message,
        iterations=int(solution.iterations),
        solve_time=float(solution.solve_time),
    )


def unsolved_object(header: Header, body: Body, message: str) -> GraspState:
    """Return the state of an object of which it is not known how fingers touch it, if they do."""
    return GraspState(
        header=header,
        object=body.name,
        pose=pose_message(body.pose.position, body.pose.orientation),
        mass=float(body.mass),
        friction=float(body.friction),
        quality=unknown_quality(),
        stale=True,
        message=message,
    )


def no_object(header: Header) -> GraspState:
    """Return the state where there is no object."""
    return GraspState(header=header, quality=unknown_quality())


def grasp_contact(contact: ObjectContact, centre: np.ndarray) -> GraspContact:
    """Return one contact on an object whose centre is (3,) [m]."""
    x, y, z = map(float, contact.position)
    on_object = -(contact.force * contact.normal + contact.friction_force)
    return GraspContact(
        finger=contact.finger,
        disk=int(contact.disk),
        point=contact.point,
        cable=contact.cable,
        position=Point(x=x, y=y, z=z),
        normal=_vector(contact.normal),
        normal_force=float(contact.force),
        friction_force=_vector(contact.friction_force),
        status=contact.status,
        margin=float(contact.margin),
        wrench=_wrench(on_object, np.cross(contact.position - centre, on_object)),
    )


def _wrench(force: np.ndarray, moment: np.ndarray) -> Wrench:
    return Wrench(force=_vector(force), torque=_vector(moment))


def _vector(values: np.ndarray) -> Vector3:
    x, y, z = map(float, values)
    return Vector3(x=x, y=y, z=z)
