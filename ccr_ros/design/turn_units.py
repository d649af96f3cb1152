# SPDX-License-Identifier: Apache-2.0
"""A gripper's fingers by ones and by mirrored pairs, and what of them a search may change."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Any

import numpy as np

from ..model.errors import InvalidValue, NotConverged
from ..model.files import Gripper, MountedFinger
from ..model.finger import Cable, Finger
from ..model.finger_text import finger_to_dict
from ..model.obstacles import Obstacle
from ..model.rotation import Pose
from ..model.solver import FingerSolver

Holes = tuple[tuple[int, ...], ...]  # by cable and disk, from 0, unwrapped: -1 is before 0

_AT_HOLE = 1e-9  # of a hole
_SAME = 1e-6  # m, of mirrored bases
_REACH, _STEP = 0.12, 1e-3  # of the length: how far a free finger is pulled, and in which steps
_MADE = attrgetter(
    "length", "segments", "disk_radius", "backbone_diameter", "poisson_ratio", "youngs_modulus",
    "holes_per_disk",
)  # fmt: skip


@dataclass(frozen=True)
class Unit:
    """A finger, and the one that mirrors it at the gripper's x-z plane, if one does.

    Attributes:
        index: Of the finger in its gripper.
        mirror: Of the other, or None.
    """

    index: int
    mirror: int | None = None


@dataclass(frozen=True)
class UnitChoice:
    """What is chosen of a unit's first finger; the other mirrors it.

    Attributes:
        holes: Of its cables.
        distance: How much farther back its base stands than in the given gripper [m].
        spot: Where it first touches the object, sideways of the object's centre, along the y axis
            of its base [m].
    """

    holes: Holes
    distance: float
    spot: float


def units_of(gripper: Gripper) -> tuple[Unit, ...]:
    """Return the fingers as mirrored pairs where they are such, else one by one.

    Raises:
        InvalidValue: A cable's angle is not that of a hole.
    """
    holes = [holes_of(mounted.finger) for mounted in gripper.fingers]
    left = list(range(len(holes)))
    found = []
    while left:
        i = left.pop(0)
        for j in left:
            if _mirrored(gripper.fingers[i], gripper.fingers[j], holes[i], holes[j]):
                left.remove(j)
                found.append(Unit(i, j))
                break
        else:
            found.append(Unit(i))
    return tuple(found)


def holes_of(finger: Finger) -> Holes:
    """Return the hole numbers of a finger's cables, from 0, without jumps over the last hole.

    Raises:
        InvalidValue: An angle is not that of a hole.
    """
    count, found = finger.holes_per_disk, []
    for cable in finger.cables:
        turns = np.asarray(cable.angles) * count / (2 * math.pi)
        whole = np.round(turns)
        if np.abs(turns - whole).max() > _AT_HOLE:
            allowed = f"angles of the {count} holes of a disk"
            raise InvalidValue(f"{finger.name}.{cable.name}", cable.angles.tolist(), allowed)
        first = int(whole[0] + count // 2) % count - count // 2
        path = [first]
        for change in np.diff(whole):
            path.append(path[-1] + (int(change) + count // 2) % count - count // 2)
        found.append(tuple(path))
    return tuple(found)


def made_finger(finger: Finger, holes: Holes) -> Finger:
    """Return a finger with other holes."""
    cables = [
        Cable.from_holes(cable.name, [h % finger.holes_per_disk + 1 for h in path],
                         finger.holes_per_disk)
        for cable, path in zip(finger.cables, holes, strict=True)
    ]  # fmt: skip
    return replace(finger, cables=tuple(cables))


def made_gripper(
    gripper: Gripper, units: Sequence[Unit], choices: Sequence[UnitChoice], shape: Obstacle,
    pose: Pose,
) -> Gripper:  # fmt: skip
    """Return a gripper with a choice for each unit, each base where its finger meets its spot.

    Args:
        gripper: The given one.
        units: Its units.
        choices: One for each.
        shape: The object's, in its own frame.
        pose: Of that in the gripper's frame.

    Raises:
        NotConverged: A finger, pulled alone, does not come to the object.
    """
    fingers = list(gripper.fingers)
    for unit, choice in zip(units, choices, strict=True):
        given = fingers[unit.index]
        finger = made_finger(given.finger, choice.holes)
        back = given.base.points(np.array([-choice.distance, 0.0, 0.0]))
        base = Pose(back, given.base.orientation)
        base = placed(MountedFinger(finger, base), shape, pose, choice.spot)
        fingers[unit.index] = MountedFinger(finger, base)
        if unit.mirror is not None:
            other = gripper.fingers[unit.mirror]
            turned = tuple(tuple(-h for h in path) for path in choice.holes)
            mirrored = Pose(base.position * np.array([1.0, -1.0, 1.0]), other.base.orientation)
            fingers[unit.mirror] = MountedFinger(made_finger(other.finger, turned), mirrored)
    return replace(gripper, fingers=tuple(fingers))


def placed(mounted: MountedFinger, shape: Obstacle, pose: Pose, spot: float) -> Pose:
    """Return the base, moved sideways, from which a free finger first touches at a spot.

    The finger alone is pulled, all cables alike, until a point of its last disk is at the object.

    Args:
        mounted: The finger and the base that it has.
        shape: The object's, in its own frame.
        pose: Of that in the gripper's frame.
        spot: Sideways of the object's centre, along the base's y axis [m].

    Raises:
        NotConverged: It does not come to the object.
    """
    local = mounted.base.inverse() @ pose
    point = touch(mounted.finger, shape, local, spot)
    aside = np.array([0.0, spot - float(point[1] - local.position[1]), 0.0])
    return Pose(mounted.base.points(aside), mounted.base.orientation)


def touch(finger: Finger, shape: Obstacle, pose: Pose, spot: float | None = None) -> np.ndarray:
    """Return the point (3,) [m] of a finger's last disk that comes to an object first.

    Args:
        finger: Its obstacles do not count.
        shape: The object's, in its own frame.
        pose: Of that in the base's frame.
        spot: If given, the object is moved along y with the finger, so that this is where it
            is touched, along y from its centre [m].

    Raises:
        NotConverged: None comes there.
    """
    solver = FingerSolver(replace(finger, obstacles=()))
    before: tuple[np.ndarray, np.ndarray] | None = None
    for pull in np.arange(0.0, _REACH, _STEP) * finger.length:
        solution = solver.solve(np.full(len(finger.cables), pull))
        if not solution.certificate.converged:
            break
        holes = np.array([points[-1] for points in solution.cables.values()])
        points = np.concatenate([holes, 2 * solution.backbone[-1] - holes])
        beside = points - pose.position
        if spot is not None:
            beside[:, 1] = spot
        gaps = shape.signed_distance(beside @ pose.rotation)
        nearest = int(np.argmin(gaps))
        if gaps[nearest] <= 0:
            if before is None or before[1][nearest] <= 0:
                return np.asarray(points[nearest])
            last, far = before[0][nearest], before[1][nearest]
            share = far / (far - gaps[nearest])
            return np.asarray(last + share * (points[nearest] - last))
        before = points, gaps
    raise NotConverged(finger.name, "pulled alone its tip does not come to the object")


def kinds_of(gripper: Gripper) -> list[int]:
    """Return the number of each finger's kind, 0, 1, ...: fingers of one kind differ in name."""
    seen: list[dict[str, Any]] = []
    kinds = []
    for mounted in gripper.fingers:
        data = {**finger_to_dict(mounted.finger), "name": ""}
        if data not in seen:
            seen.append(data)
        kinds.append(seen.index(data))
    return kinds


def _mirrored(a: MountedFinger, b: MountedFinger, of_a: Holes, of_b: Holes) -> bool:
    count = a.finger.holes_per_disk
    flip = np.array([1.0, -1.0, 1.0])
    rotation = flip[:, None] * a.base.rotation * flip
    return bool(
        _MADE(a.finger) == _MADE(b.finger)
        and not np.any(a.finger.rest_curvature)
        and not np.any(b.finger.rest_curvature)
        and np.abs(a.base.position * flip - b.base.position).max() < _SAME
        and np.abs(rotation - b.base.rotation).max() < _SAME
        and len(of_a) == len(of_b)
        and all(
            len(p) == len(q) and all((i + j) % count == 0 for i, j in zip(p, q, strict=True))
            for p, q in zip(of_a, of_b, strict=True)
        )
    )
