# SPDX-License-Identifier: Apache-2.0
"""All measures of a grasp at once, at a rate at which they can be watched."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ccr_ros.grasp.statics.body import GRAVITY
from ccr_ros.grasp.statics.result import GraspSolution
from ccr_ros.model import checks

from .ball import ball_of
from .contact import FrictionContact, friction_margin
from .load import largest_load
from .wrenches import contact_wrenches, wrench_in_words

# Loose enough for ten a second with nine contacts; `ferrari_canny` alone takes what is asked of it.
_EPSILON_TOLERANCE = 0.1
_EPSILON_ROUNDS = 1
_PAYLOAD_TOLERANCE = 1e-3


@dataclass(frozen=True, eq=False)
class GraspQuality:
    """How good a grasp is.

    Attributes:
        margin: Smallest friction margin of the contacts, 1 - |friction| / (mu normal force); nan
            without friction.
        force_closure: The contacts could balance every wrench, pressing as hard as it takes.
        epsilon: Ferrari and Canny's quality for normal forces that sum up to one, a lower bound
            of it: the weakest wrench's share of the grip that is balanced.
        epsilon_upper: The upper bound.
        weakest: (6,) the unit wrench (force, moment / length) on the object that is balanced
            worst.
        weakest_in_words: The same, as "a force along -z".
        length: [m] by which moments are divided.
        payload: [N] largest weight that the contacts could carry without slipping, no normal
            force beyond its limit; inf if there is no largest.
    """

    margin: float
    force_closure: bool
    epsilon: float
    epsilon_upper: float
    weakest: np.ndarray
    weakest_in_words: str
    length: float
    payload: float


def grasp_quality(
    contacts: Sequence[FrictionContact],
    centre: np.ndarray,
    length: float | None = None,
    gravity: np.ndarray = GRAVITY,
) -> GraspQuality:
    """Return all measures of contacts on an object.

    Args:
        contacts: In one frame, with present forces and limits.
        centre: (3,) [m] the object's centre of mass in that frame.
        length: [m] by which moments are divided; None: largest distance of a contact from the
            centre.
        gravity: (3,) whose direction in that frame is the payload's.

    Raises:
        InvalidValue: A value is out of range.
        MissingPackage: scipy is not installed.
    """
    down = checks.direction("gravity", gravity)
    wrenches = contact_wrenches(contacts, centre, length)
    ball = ball_of(wrenches, "sum", _EPSILON_TOLERANCE, edges=8, rounds=_EPSILON_ROUNDS)
    carried = largest_load(contacts, centre, down, tolerance=_PAYLOAD_TOLERANCE)
    return GraspQuality(
        margin=friction_margin(contacts),
        force_closure=ball.upper > 0,
        epsilon=ball.lower,
        epsilon_upper=ball.upper,
        weakest=ball.weakest,
        weakest_in_words=wrench_in_words(ball.weakest),
        length=wrenches.length,
        payload=carried.lower,
    )


def contacts_of(solution: GraspSolution, limit: float | None = None) -> list[FrictionContact]:
    """Return the contacts of a solved grasp, in the gripper's frame.

    Args:
        solution: Of `ccr_ros.grasp.statics.GraspSolver`.
        limit: [N] largest normal force at each; None: the present one.

    Raises:
        InvalidValue: The limit is negative or nan.
    """
    return [
        FrictionContact(
            position=contact.position,
            normal=contact.normal,
            friction=solution.body.friction,
            force=max(contact.force, 0.0),
            friction_force=contact.friction_force,
            limit=max(contact.force, 0.0) if limit is None else limit,
        )
        for contact in solution.contacts
    ]


def quality_of(
    solution: GraspSolution,
    length: float | None = None,
    gravity: np.ndarray = GRAVITY,
    limit: float | None = None,
) -> GraspQuality:
    """Return all measures of a solved grasp.

    Args:
        solution: Of `ccr_ros.grasp.statics.GraspSolver`, in newtons.
        length: [m] by which moments are divided; None: largest distance of a contact from the
            centre of mass.
        gravity: (3,) whose direction in the gripper's frame is the payload's.
        limit: [N] largest normal force at each contact for the payload; None: the present one,
            so that the payload is what the same grip could carry if its forces were spread best.

    Raises:
        InvalidValue: A value is out of range.
        MissingPackage: scipy is not installed.
    """
    contacts = contacts_of(solution, limit)
    return grasp_quality(contacts, solution.body.pose.position, length, gravity)
