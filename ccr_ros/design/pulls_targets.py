# SPDX-License-Identifier: Apache-2.0
"""What pulls shall bring about: a tip pose, disks at points, or a disk that presses an obstacle.

A target is a residual, in units of the finger's length L, that vanishes when it is reached, with
its exact derivative with respect to what drives the cables (`ccr_ros.model.sensitivity`).
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ccr_ros.model import checks
from ccr_ros.model.equilibrium import EquilibriumProblem
from ccr_ros.model.errors import InvalidValue, UnknownName
from ccr_ros.model.rotation import matrix_from_quaternion, quaternion_from_matrix, skew
from ccr_ros.model.sensitivity import Response, turns
from ccr_ros.model.sqp import KktPoint

_TURN = 0.1  # of the finger's length; what a radian of the tip's orientation counts as
_FAR = 1e3  # m


@dataclass(frozen=True)
class TargetError:
    """How far a pose is from a target; ``None`` for what the target says nothing about.

    Attributes:
        position: Largest distance of a disk from where it shall be [m].
        rotation: Angle between the tip's orientation and the wanted one [rad].
        force: Force of the contact less the wanted one [N, or 1/m^2 per EI].
        gap: Distance of the disk from the obstacle that it shall press [m].
    """

    position: float | None = None
    rotation: float | None = None
    force: float | None = None
    gap: float | None = None

    def text(self, unit: str = "N") -> str:
        """The error for people, forces in ``unit``: ``1.2 mm, 0.3 deg``."""
        parts = []
        if self.position is not None:
            parts.append(f"{self.position * 1e3:.3g} mm")
        if self.rotation is not None:
            parts.append(f"{math.degrees(self.rotation):.3g} deg")
        if self.force is not None:
            parts.append(f"{self.force:+.3g} {unit}")
        if self.gap:
            parts.append(f"{self.gap * 1e3:.3g} mm from the obstacle")
        return ", ".join(parts)


class Target(ABC):
    """Something to be reached; frozen."""

    @abstractmethod
    def check(self, problem: EquilibriumProblem) -> None:
        """Raise InvalidValue or UnknownName where the target does not fit the finger."""

    @abstractmethod
    def residual(self, problem: EquilibriumProblem, point: KktPoint) -> np.ndarray:
        """Return the weighted residual (r,), in units of L."""

    @abstractmethod
    def jacobian(
        self, problem: EquilibriumProblem, point: KktPoint, answer: Response
    ) -> np.ndarray:
        """Return its derivative (r, m) with respect to what the response is to."""

    @abstractmethod
    def error(self, problem: EquilibriumProblem, point: KktPoint) -> TargetError:
        """Return the error in the units of people's targets, without weights."""


@dataclass(frozen=True, eq=False)
class TipTarget(Target):
    """The tip disk at a position, at an orientation, or both, in the finger's base frame.

    Attributes:
        position: (3,) [m], or ``None``: free.
        orientation: (4,) unit quaternion (x, y, z, w), or ``None``: free.
        position_weight: (3,) >= 0, of the position's x, y and z.
        rotation_weight: (3,) >= 0 [m/rad], of a turn about the x, y and z axes of the wanted
            frame, or a number for all three; ``None``: a tenth of the finger's length. A zero
            about z leaves the tip's roll free.
    """

    position: np.ndarray | None = None
    orientation: np.ndarray | None = None
    position_weight: np.ndarray | tuple[float, ...] = (1.0, 1.0, 1.0)
    rotation_weight: np.ndarray | tuple[float, ...] | float | None = None

    def __post_init__(self) -> None:
        if self.position is None and self.orientation is None:
            raise InvalidValue("tip", None, "a position, an orientation or both")
        for name, value in (
            ("position", self.position),
            ("orientation", self.orientation),
            ("position_weight", self.position_weight),
            ("rotation_weight", self.rotation_weight),
        ):
            if value is not None:
                object.__setattr__(self, name, self._checked(name, value))

    @staticmethod
    def _checked(name: str, value: object) -> np.ndarray:
        place = f"tip.{name}"
        if name == "orientation":
            return checks.quaternion(place, value)
        if name == "position":
            return checks.vector(place, value, 3, unit="m", largest=_FAR)
        if not checks.is_list(value):
            value = [value] * 3
        weights = checks.vector(place, value, 3, largest=1e6)
        if weights.min() < 0 or weights.max() == 0:
            raise InvalidValue(place, value, "weights >= 0, not all 0")
        return weights

    def check(self, problem: EquilibriumProblem) -> None:
        """Fits any finger."""

    def residual(self, problem: EquilibriumProblem, point: KktPoint) -> np.ndarray:
        parts = []
        if self.position is not None:
            off = point.at.rod.positions[-1] - self.position / problem.finger.length
            parts.append(np.asarray(self.position_weight) * off)
        if self.orientation is not None:
            parts.append(self._turn_weight(problem) * self._turned(point))
        return np.concatenate(parts)

    def jacobian(
        self, problem: EquilibriumProblem, point: KktPoint, answer: Response
    ) -> np.ndarray:
        parts = []
        if self.position is not None:
            moved = point.first.points[problem.points.backbone[-1]] @ answer.y
            parts.append(np.asarray(self.position_weight)[:, None] * moved)
        if self.orientation is not None:
            spin = turns(problem, point, answer.y)[-1]
            local = matrix_from_quaternion(self.orientation).T @ spin
            slope = _left_jacobian_inverse(self._turned(point)) @ local
            parts.append(self._turn_weight(problem)[:, None] * slope)
        return np.concatenate(parts)

    def error(self, problem: EquilibriumProblem, point: KktPoint) -> TargetError:
        position = rotation = None
        if self.position is not None:
            off = point.at.rod.positions[-1] * problem.finger.length - self.position
            position = float(np.linalg.norm(off))
        if self.orientation is not None:
            rotation = float(np.linalg.norm(self._turned(point)))
        return TargetError(position=position, rotation=rotation)

    def _turn_weight(self, problem: EquilibriumProblem) -> np.ndarray:
        if self.rotation_weight is None:
            return np.full(3, _TURN)
        return np.asarray(self.rotation_weight) / problem.finger.length

    def _turned(self, point: KktPoint) -> np.ndarray:
        """Rotation vector (3,) of the tip in the wanted frame."""
        assert self.orientation is not None
        wanted = matrix_from_quaternion(self.orientation)
        x, y, z, w = quaternion_from_matrix(wanted.T @ point.at.rod.rotations[-1])
        axis = np.array([x, y, z])
        sine = float(np.linalg.norm(axis))
        return axis * (2.0 * math.atan2(sine, w) / sine if sine > 1e-12 else 2.0)


@dataclass(frozen=True, eq=False)
class PointsTarget(Target):
    """Disk centres at points of the finger's base frame.

    Attributes:
        points: (3,) [m] by disk, 1 to n.
        weights: >= 0, by disk; a disk not named: 1.
    """

    points: Mapping[int, np.ndarray]
    weights: Mapping[int, float] | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.points, Mapping) or not self.points:
            raise InvalidValue("points", self.points, "a point [m] for each of some disks")
        weights = self.weights or {}
        points: dict[int, np.ndarray] = {}
        for disk, point in self.points.items():
            number = checks.integer("points", disk, low=1)
            points[number] = checks.vector(f"points[{disk}]", point, 3, unit="m", largest=_FAR)
        for disk in weights:
            if disk not in points:
                raise UnknownName("disk of weights", disk, [str(d) for d in points])
            checks.real(f"weights[{disk}]", weights[disk], low=0, high=1e6)
        if not any(weights.get(disk, 1.0) > 0 for disk in points):
            raise InvalidValue("weights", dict(weights), "not all 0")
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "weights", dict(weights))

    def check(self, problem: EquilibriumProblem) -> None:
        for disk in self.points:
            checks.integer("points: disk", disk, low=1, high=problem.finger.segments)

    def residual(self, problem: EquilibriumProblem, point: KktPoint) -> np.ndarray:
        return (self._off(problem, point) * self._weights()[:, None]).ravel()

    def jacobian(
        self, problem: EquilibriumProblem, point: KktPoint, answer: Response
    ) -> np.ndarray:
        index = problem.points.backbone[list(self.points)]
        moved = point.first.points[index] @ answer.y
        return (moved * self._weights()[:, None, None]).reshape(-1, moved.shape[2])

    def error(self, problem: EquilibriumProblem, point: KktPoint) -> TargetError:
        off = np.linalg.norm(self._off(problem, point), axis=1)
        return TargetError(position=float(off.max()) * problem.finger.length)

    def _weights(self) -> np.ndarray:
        given = self.weights or {}
        return np.array([float(given.get(disk, 1.0)) for disk in self.points])

    def _off(self, problem: EquilibriumProblem, point: KktPoint) -> np.ndarray:
        centres = point.at.points[problem.points.backbone[list(self.points)]]
        return centres - np.array(list(self.points.values())) / problem.finger.length


@dataclass(frozen=True, eq=False)
class PressTarget(Target):
    """A disk that presses an obstacle with a force, the sum over the disk's points that touch.

    The residual is force less wanted force, counted in the way that the force would bend a
    cantilever up to the disk, less the gap that is left before they touch: so it leads the finger
    to the obstacle and on, without a step.

    Attributes:
        disk: 1 to n.
        obstacle: Name of an obstacle of the finger.
        force: > 0 [N, or 1/m^2 per EI].
    """

    disk: int
    obstacle: str
    force: float

    def __post_init__(self) -> None:
        checks.integer("press.disk", self.disk, low=1)
        checks.real("press.force", self.force, above=0, high=1e9)

    def check(self, problem: EquilibriumProblem) -> None:
        checks.integer("press.disk", self.disk, low=1, high=problem.finger.segments)
        self._obstacle(problem)

    def residual(self, problem: EquilibriumProblem, point: KktPoint) -> np.ndarray:
        force, gap, _ = self._contact(problem, point)
        unit = problem.finger.bending_stiffness / problem.finger.length**2
        return np.array([(force - self.force / unit) / self._stiffness(problem) - gap])

    def jacobian(
        self, problem: EquilibriumProblem, point: KktPoint, answer: Response
    ) -> np.ndarray:
        force, _, nearest = self._contact(problem, point)
        if force > 0:
            pairs = point.pairs[answer.pairs]
            ours = (pairs[:, 0] == self._obstacle(problem)) & (
                problem.points.disk[pairs[:, 1]] == self.disk
            )
            return answer.forces[ours].sum(axis=0)[None] / self._stiffness(problem)
        pair = np.array([[self._obstacle(problem), nearest]])
        rows, _, _ = problem.contact_rows(point.at, point.first, pair)
        return rows @ answer.y

    def error(self, problem: EquilibriumProblem, point: KktPoint) -> TargetError:
        force, gap, _ = self._contact(problem, point)
        unit = problem.finger.bending_stiffness / problem.finger.length**2
        return TargetError(force=force * unit - self.force, gap=gap * problem.finger.length)

    def _obstacle(self, problem: EquilibriumProblem) -> int:
        names = [obstacle.name for obstacle in problem.obstacles]
        if self.obstacle not in names:
            raise UnknownName("obstacle", self.obstacle, names)
        return names.index(self.obstacle)

    def _stiffness(self, problem: EquilibriumProblem) -> float:
        """3 EI / s^3 of a cantilever up to the disk, in units of EI / L^3."""
        return 3.0 * (problem.finger.segments / self.disk) ** 3

    def _contact(self, problem: EquilibriumProblem, point: KktPoint) -> tuple[float, float, int]:
        """Force and gap (one of them 0, units of the solver), and the disk's nearest point."""
        obstacle = self._obstacle(problem)
        points = np.flatnonzero(problem.points.disk == self.disk)
        force = float(point.forces[obstacle, points].sum())
        distances = point.at.distances[obstacle, points]
        nearest = int(np.argmin(distances))
        gap = 0.0 if force > 0 else max(0.0, float(distances[nearest]))
        return force, gap, int(points[nearest])


def _left_jacobian_inverse(v: np.ndarray) -> np.ndarray:
    """Inverse left Jacobian (3, 3) of SO(3): the change of log(R) is it times a spatial turn."""
    angle = float(np.linalg.norm(v))
    k = skew(v)
    if angle < 1e-4:
        return np.eye(3) - 0.5 * k + k @ k / 12.0
    half = angle / 2
    return np.eye(3) - 0.5 * k + (1 - half / math.tan(half)) / angle**2 * (k @ k)
