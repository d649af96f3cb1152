# SPDX-License-Identifier: Apache-2.0
"""Between messages and plans of a held object's motion: the solver's side, the coordinator's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from ccr_msgs.msg import CablePulls, GraspState, MoveWaypoint, ObjectMotion, PullLimits
from ccr_msgs.srv import PlanMove
from geometry_msgs.msg import Pose as PoseMessage
from geometry_msgs.msg import Vector3

from ccr_ros.grasp.manipulation import MoveLimits, MovePlan, MoveTarget, Waypoint
from ccr_ros.grasp.motion import HeldObject, Motion
from ccr_ros.grasp.move_path import MovePath
from ccr_ros.grasp.moves import MoveGoal
from ccr_ros.model import Finger, InvalidValue, UnknownName
from ccr_ros.model.rotation import Pose

from .conversions import pose_message, pulls_from_message

#: what the solver answers while it plans something else
BUSY = "refused: another plan is being made"

# The solver's side


def target_from_request(request: PlanMove.Request) -> MoveTarget:
    """Return where an object shall go.

    Raises:
        InvalidValue: No motion is asked for, or a value is out of range.
    """
    tolerances = {}
    for name in ("shift_tolerance", "turn_tolerance"):
        if value := float(getattr(request, name)):
            tolerances[name] = value
    return MoveTarget(
        np.array(vector_of(request.shift)), np.array(vector_of(request.turn)), **tolerances
    )


def limits_from_request(
    request: PlanMove.Request, fingers: Mapping[str, Finger], margin: float
) -> MoveLimits:
    """Return what a plan must keep.

    Args:
        request: What is asked.
        fingers: By name.
        margin: Where none is asked for.

    Raises:
        UnknownName: A finger or cable that is not there.
        InvalidValue: A value is out of range, or a finger is named twice.
    """
    pulls: dict[str, np.ndarray] = {}
    for limit in request.limits:
        if limit.finger not in fingers:
            raise UnknownName("finger", limit.finger, fingers)
        place = f"limits.{limit.finger}"
        if limit.finger in pulls:
            raise InvalidValue(place, limit.finger, "named once")
        pulls[limit.finger] = _range(limit, fingers[limit.finger], place)
    return MoveLimits(margin=float(request.margin) or margin, pulls=pulls)


def _range(limit: PullLimits, finger: Finger, place: str) -> np.ndarray:
    columns = []
    for key in ("least", "largest"):
        values = list(getattr(limit, key))
        names = list(limit.names) or list(finger.cable_names)
        if sorted(names) != sorted(finger.cable_names) or len(values) != len(names):
            allowed = f"one value for each of {', '.join(finger.cable_names)}"
            raise InvalidValue(f"{place}.{key}", values, allowed)
        message = CablePulls(names=names, pulls=values)
        columns.append(pulls_from_message(message, finger))
    return np.column_stack(columns)


def waypoint_message(waypoint: Waypoint, cables: Mapping[str, Sequence[str]]) -> MoveWaypoint:
    """Return a waypoint; ``cables`` are the fingers' cable names."""
    pose = waypoint.pose
    return MoveWaypoint(
        fingers=list(waypoint.pulls),
        pulls=[
            CablePulls(names=list(cables[name]), pulls=pulls.tolist())
            for name, pulls in waypoint.pulls.items()
        ],
        pose=pose_message(pose.position, pose.orientation),
        margin=float(waypoint.margin),
        least_force=float(waypoint.force),
        shift=vector_message(waypoint.moved[:3]),
        turn=vector_message(waypoint.moved[3:]),
    )


def fill_plan(
    response: PlanMove.Response, plan: MovePlan, cables: Mapping[str, Sequence[str]]
) -> PlanMove.Response:
    """Put a plan into a response."""
    response.reached = bool(plan.reached)
    response.share = float(plan.share)
    response.limiting = plan.limiting
    response.waypoints = [waypoint_message(waypoint, cables) for waypoint in plan.waypoints]
    return response


# The coordinator's side


def plan_request(
    goal: MoveGoal, ranges: Mapping[str, np.ndarray], cables: Mapping[str, Sequence[str]]
) -> PlanMove.Request:
    """Return what the solver is asked for a goal.

    Args:
        goal: The goal.
        ranges: Lowest and highest pulls (m, 2) [m] by finger.
        cables: The fingers' cable names.
    """
    return PlanMove.Request(
        shift=vector_message(goal.target.shift),
        turn=vector_message(goal.target.turn),
        margin=float(goal.margin),
        limits=[
            PullLimits(
                finger=name,
                names=list(cables[name]),
                least=pulls[:, 0].tolist(),
                largest=pulls[:, 1].tolist(),
            )
            for name, pulls in ranges.items()
        ],
    )


def path_from_response(
    response: PlanMove.Response, cables: Mapping[str, Sequence[str]]
) -> MovePath:
    """Return the way that the solver planned.

    Raises:
        InvalidValue: It was refused, or is not of this gripper's fingers and cables.
    """
    if not response.waypoints:
        text = response.message.removeprefix("refused: ") or "no waypoints"
        raise InvalidValue("plan_move", text, "a plan")
    rows: dict[str, list[list[float]]] = {name: [] for name in cables}
    for index, waypoint in enumerate(response.waypoints):
        place = f"waypoints[{index}]"
        if sorted(waypoint.fingers) != sorted(cables) or len(waypoint.pulls) != len(cables):
            raise InvalidValue(place, list(waypoint.fingers), f"pulls of {', '.join(cables)}")
        for name, message in zip(waypoint.fingers, waypoint.pulls, strict=True):
            given = dict(zip(message.names, message.pulls, strict=False))
            if sorted(given) != sorted(cables[name]) or len(message.pulls) != len(given):
                allowed = f"one pull for each of {', '.join(cables[name])}"
                raise InvalidValue(f"{place}.{name}", list(message.names), allowed)
            rows[name].append([given[cable] for cable in cables[name]])
    return MovePath(
        {name: np.array(pulls) for name, pulls in rows.items()},
        reached=bool(response.reached),
        share=float(response.share),
        limiting=response.limiting,
    )


def held_object(message: GraspState) -> HeldObject:
    """Return what the solver says of the object.

    Raises:
        InvalidValue: Its pose is none.
    """
    if not message.object:
        return HeldObject("", Pose(), held=False)
    return HeldObject(
        name=message.object,
        pose=pose_of(message.pose),
        held=bool(message.held),
        margin=float(message.quality.margin),
        stale=bool(message.stale),
        message=message.message,
    )


def motion_message(motion: Motion | None) -> ObjectMotion:
    """Return how far an object has come; None: nothing is known of it."""
    if motion is None:
        return ObjectMotion(margin=float("nan"))
    pose = motion.pose
    return ObjectMotion(
        pose=pose_message(pose.position, pose.orientation),
        shift=vector_message(motion.shift),
        turn=vector_message(motion.turn),
        margin=float(motion.margin),
        fraction=float(motion.fraction),
    )


# Both


def vector_message(values: np.ndarray) -> Vector3:
    """Return (3,) as a message."""
    x, y, z = map(float, values)
    return Vector3(x=x, y=y, z=z)


def vector_of(message: Vector3) -> list[float]:
    """Return the three numbers of a message."""
    return [message.x, message.y, message.z]


def pose_of(message: PoseMessage) -> Pose:
    """Return the pose in a message.

    Raises:
        InvalidValue: It is not finite, or its quaternion is not of unit length.
    """
    p, q = message.position, message.orientation
    return Pose(np.array([p.x, p.y, p.z]), np.array([q.x, q.y, q.z, q.w]))
