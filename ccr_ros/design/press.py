# SPDX-License-Identifier: Apache-2.0
"""Contact forces that a finger in its wanted shape shall press with, and where it may not be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ccr_ros.model import checks
from ccr_ros.model.equilibrium import EquilibriumProblem, Evaluation
from ccr_ros.model.errors import InvalidValue, UnknownName

from .rest_statics import Push

POINTS = ("backbone", "cable", "antagonist")
TOUCHING = 1e-4  # m; a point that far off an obstacle cannot press on it
INSIDE = 1e-6  # m; a wanted shape so deep in an obstacle is not reached by equilibrium


@dataclass(frozen=True)
class Press:
    """A wanted normal force between a point of the finger and the obstacle that it touches.

    Attributes:
        disk: Index of the disk, 0 = base.
        force: [N], or per EI [1/m^2] for a finger without Young's modulus; > 0.
        point: ``"backbone"``, ``"cable"`` or ``"antagonist"``; ``""``: the point of the disk that
            is nearest to an obstacle.
        cable: Name of the cable whose point it is; ``""``: of any cable, the nearest.
    """

    disk: int
    force: float
    point: str = ""
    cable: str = ""

    def __post_init__(self) -> None:
        checks.integer("press.disk", self.disk, low=1)
        object.__setattr__(self, "force", checks.real("press.force", self.force, above=0))
        if self.point and self.point not in POINTS:
            raise UnknownName("point", self.point, POINTS)


def pushes(
    problem: EquilibriumProblem, at: Evaluation, presses: Sequence[Press]
) -> tuple[Push, ...]:
    """Return the presses as forces on points of the problem, at a pose in which they touch.

    Raises:
        InvalidValue: A disk that is not there, no obstacle, a point that does not touch one, or
            the same point twice; says how far off it is.
        UnknownName: A cable that the finger does not have.
    """
    finger = problem.finger
    unit = finger.length**2 / finger.bending_stiffness
    found: list[Push] = []
    for i, press in enumerate(presses):
        place = f"press[{i}]"
        if not problem.obstacles:
            raise InvalidValue(place, press.disk, "of a finger with an obstacle to press on")
        if press.disk > finger.segments:
            allowed = f"an integer 1..{finger.segments}, the tip"
            raise InvalidValue(f"{place}.disk", press.disk, allowed)
        if press.cable and press.cable not in finger.cable_names:
            raise UnknownName("cable", press.cable, finger.cable_names)
        points = _points(problem, press)
        if not len(points):
            allowed = f"a disk with a point of this kind ({press.point} {press.cable})"
            raise InvalidValue(f"{place}.disk", press.disk, allowed)
        gaps = at.distances[:, points] * finger.length
        obstacle, column = np.unravel_index(np.argmin(np.abs(gaps)), gaps.shape)
        gap, point = float(gaps[obstacle, column]), int(points[column])
        if abs(gap) > TOUCHING:
            raise InvalidValue(
                place,
                f"disk {press.disk}",
                f"where the wanted shape touches an obstacle, within {TOUCHING * 1e3:g} mm (its"
                f" nearest point is {gap * 1e3:.4g} mm off {problem.obstacles[obstacle].name!r})",
            )
        if any((p.obstacle, p.point) == (obstacle, point) for p in found):
            raise InvalidValue(place, f"disk {press.disk}", "given once per point")
        found.append(Push(int(obstacle), point, press.force * unit))
    return tuple(found)


def deepest(problem: EquilibriumProblem, at: Evaluation) -> tuple[float, int, str]:
    """Return how deep [m] a pose is in an obstacle (negative: clear), the disk, and which one."""
    if not problem.obstacles:
        return -np.inf, 0, ""
    inside = -at.distances.copy() * problem.finger.length
    inside[:, problem.fixed] = -np.inf
    obstacle, point = np.unravel_index(np.argmax(inside), inside.shape)
    disk = problem.points.labels[point].disk
    return float(inside[obstacle, point]), disk, problem.obstacles[obstacle].name


def _points(problem: EquilibriumProblem, press: Press) -> np.ndarray:
    """Indices of the points that a press may mean.

    Looked up by the tables of points: where holes are opposite, one point has two names.
    """
    finger, points = problem.finger, problem.points
    found: list[int] = []
    if press.point in ("", "backbone") and not press.cable:
        found.append(int(points.backbone[press.disk]))
    for j, name in enumerate(finger.cable_names):
        if press.cable in ("", name):
            for kind, table in (("cable", points.cable), ("antagonist", points.antagonist)):
                if press.point in ("", kind) and press.disk < len(table[j]):
                    found.append(table[j][press.disk])
    return np.array(sorted(set(found)), dtype=int)
