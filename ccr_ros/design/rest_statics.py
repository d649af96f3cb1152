# SPDX-License-Identifier: Apache-2.0
"""The rest shape that cable tensions and contact forces bend into a given pose.

In the scaled coordinates of `EquilibriumProblem`, counted from the straight finger, the elastic
energy is 1/2 |q - r|^2 for a pose q and a rest shape r. Equilibrium at q under tensions T and
contact forces F (times L^2 / EI) is q - r + A'T - N'F = 0, with the gradients A of the cables'
lengths and N of the distances from obstacles at q. So the rest shape is linear in them:

    r(T) = q + A'T - N'F                                                                   (1)

The tensions follow from the pulls: with l(.) the lengths of the cables in a shape,

    l(r(T)) - l(q) = pull,   or   (1 - p) l(r(T)) - l(q) = 0   for a pull p of the rest length,  (2)

for every cable that is taut; one that is slack has T = 0 and a length to spare.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ccr_ros.model.equilibrium import EquilibriumProblem

from .pull import Pull


@dataclass(frozen=True)
class Push:
    """A contact force at a point of the finger, in the problem's units.

    Attributes:
        obstacle: Index of the obstacle.
        point: Index of the finger's point.
        force: Normal force times L^2 / EI.
    """

    obstacle: int
    point: int
    force: float


class RestStatics:
    """Equations (1) and (2) at one pose.

    Args:
        problem: Straight at rest, frictionless cables.
        y: (N,) the pose.
        pulls: One per cable.
        pushes: The contact forces at the pose.
        bending, twist: Largest curvature [1/m] that the rest shape may have.

    Attributes:
        at: The pose. limits: The largest bending and twist.
        free_rest: (N,) the rest shape for slack cables; pull_rows: (m, N) A.
    """

    def __init__(
        self,
        problem: EquilibriumProblem,
        y: np.ndarray,
        pulls: Sequence[Pull],
        pushes: Sequence[Push] = (),
        bending: float = math.inf,
        twist: float = math.inf,
    ) -> None:
        self.problem = problem
        self.at = problem.evaluate(y)
        first = problem.linearize(self.at)
        self.pull_rows = first.lengths
        self.free_rest = y
        if pushes:
            pairs = np.array([[p.obstacle, p.point] for p in pushes])
            rows, _, _ = problem.contact_rows(self.at, first, pairs)
            self.free_rest = y + np.array([p.force for p in pushes]) @ rows
        length = problem.finger.length
        self._factor = np.array([1.0 - p.value if p.relative else 1.0 for p in pulls])
        self._offset = np.array([0.0 if p.relative else p.value / length for p in pulls])
        self._offset = self._offset + self.at.lengths
        self.limits = bending, twist
        self._base = curvature_ends(problem, self.free_rest)
        self._slopes = np.array([curvature_ends(problem, row) for row in self.pull_rows])

    def rest(self, tensions: np.ndarray) -> np.ndarray:
        """Return r (N,) for tensions (m,), equation (1)."""
        return self.free_rest + tensions @ self.pull_rows

    def missing(self, tensions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return by how much (m,) each rest length misses equation (2), and its Jacobian (m, m).

        Positive: the cable is longer at rest than it must be, and so the pull too small to take
        it up; a slack cable may be so.
        """
        at = self.problem.evaluate(self.rest(tensions))
        rows = self.problem.linearize(at).lengths
        value = self._factor * at.lengths - self._offset
        return value, self._factor[:, None] * (rows @ self.pull_rows.T)

    def reach(self, start: np.ndarray, way: np.ndarray) -> float:
        """Return how far from tensions (m,) along a way (m,) the rest curvature stays in bounds."""
        here = self._base + np.tensordot(start, self._slopes, 1)
        slope = np.tensordot(way, self._slopes, 1)
        bending, twist = self.limits
        a = np.sum(slope[:, :2] ** 2, axis=1)
        b = np.sum(slope[:, :2] * here[:, :2], axis=1)
        c = np.sum(here[:, :2] ** 2, axis=1) - bending**2
        if c.max() > 0 or np.abs(here[:, 2]).max() > twist:
            return 0.0
        with np.errstate(divide="ignore", invalid="ignore"):
            bend = (-b + np.sqrt(np.maximum(b * b - a * c, 0.0))) / a
            turn = (twist - np.sign(slope[:, 2]) * here[:, 2]) / np.abs(slope[:, 2])
        found = np.concatenate([bend[a > 1e-24], turn[np.abs(slope[:, 2]) > 1e-12], [math.inf]])
        return float(found.min())


def curvature_ends(problem: EquilibriumProblem, y: np.ndarray) -> np.ndarray:
    """Return the curvature (2 E, 3) [1/m] at the start and the end of every arc, at y (N,)."""
    z = y.reshape(problem.arcs, 2, 3) * problem.coordinate_scale.reshape(2, 3)
    z = z / (problem.rod_step * problem.finger.length)
    return np.stack([z[:, 0] - z[:, 1], z[:, 0] + z[:, 1]], axis=1).reshape(-1, 3)
