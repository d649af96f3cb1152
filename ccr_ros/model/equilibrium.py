# SPDX-License-Identifier: Apache-2.0
"""The equilibrium problem of a finger: least strain energy under cable lengths and obstacles.

In units of the finger's length L and of EI / L for energy, with y the departure from the rest
shape scaled so that the strain energy (the paper's Eq. 1-3) is 1/2 y.y:

    min_y  1/2 y.y   subject to   length of cable c      <=  rest length - pull      (tension T_c)
                                  -signed distance of k  <=  0                       (contact F_k)

The Lagrange multipliers are the tensions and contact forces, times L^2 / EI. This module builds
the problem and evaluates it with exact derivatives; `solver` solves it.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from .errors import InvalidValue
from .finger import Finger
from .kinematics import Kinematics, Linearization, Placed, rest_coordinates
from .obstacles import Obstacle
from .settings import SolverSettings


@dataclass(frozen=True, eq=False)
class Evaluation(Placed):
    """The problem at one y: the pose and the constraints' values (units of L).

    Attributes:
        distances: (O, P) signed distance of every point from every obstacle.
    """

    distances: np.ndarray


class EquilibriumProblem(Kinematics):
    """The optimisation problem of one finger, built once and evaluated often."""

    def __init__(self, finger: Finger, settings: SolverSettings | None = None) -> None:
        self.settings = settings or SolverSettings()
        super().__init__(finger, self.settings)
        self.obstacles: tuple[Obstacle, ...] = finger.obstacles
        self._start_from(finger)

    def _start_from(self, finger: Finger) -> None:
        """Take the rest shape of ``finger``, from which y and the pulls count."""
        self.finger = finger
        self.z_rest = rest_coordinates(finger, self.arcs_per_segment, self.rod.order)
        self.rest = self.evaluate(np.zeros(self.size))
        self.rest_lengths = np.bincount(
            self.group_cable, self.rest.lengths, minlength=len(finger.cables)
        )
        self._shares = self.rest.lengths / self.rest_lengths[self.group_cable] / finger.length

    def with_rest_curvature(self, rest_curvature: np.ndarray) -> EquilibriumProblem:
        """Return this problem with another rest shape; see `Finger.rest_curvature`.

        All that does not depend on the rest shape is shared, so it costs little; not for use by
        several threads at once.

        Raises:
            InvalidValue: A curvature that no finger can have at rest, or one that is linear along
                more pieces of a segment than the problem's arcs can follow.
        """
        other = copy(self)
        finger = replace(self.finger, rest_curvature=rest_curvature)
        if self.arcs_per_segment % finger.rest_pieces:
            raise InvalidValue(
                "rest_curvature",
                rest_curvature,
                f"linear along pieces that {self.arcs_per_segment} arcs per segment can follow",
            )
        other._start_from(finger)
        return other

    def length_bounds(self, pulls: np.ndarray) -> np.ndarray:
        """Upper bounds (C,) of the cable (or span) lengths, in units of L, for pulls (m,) [m]."""
        return self.rest.lengths - self._shares * pulls[self.group_cable]

    # -- evaluation ------------------------------------------------------------------------

    def evaluate(self, y: np.ndarray) -> Evaluation:
        """Evaluate pose and constraints at y (N,)."""
        at = self.place(y)
        distances = np.empty((len(self.obstacles), len(at.points)))
        if self.obstacles:
            metres = at.points * self.finger.length
            for i, obstacle in enumerate(self.obstacles):
                distances[i] = obstacle.signed_distance(metres)
            distances /= self.finger.length
        return Evaluation(
            at.y, at.z, at.rod, at.points, at.spans, at.span_lengths, at.lengths, distances
        )

    def contact_rows(
        self, at: Evaluation, first: Linearization, pairs: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Gradients (c, N) of -distance at (obstacle, point) pairs (c, 2), normals and Hessians."""
        normals, hessians = np.empty((len(pairs), 3)), np.empty((len(pairs), 3, 3))
        for i, obstacle in enumerate(self.obstacles):
            of = pairs[:, 0] == i
            if of.any():
                where = at.points[pairs[of, 1]] * self.finger.length
                normals[of], hessians[of] = obstacle.derivatives(where)
        hessians *= self.finger.length
        rows = -(normals[:, None, :] @ first.points[pairs[:, 1]])[:, 0, :]
        return rows, normals, hessians

    def hessian(
        self,
        at: Evaluation,
        first: Linearization,
        tensions: np.ndarray,
        pairs: np.ndarray,
        normals: np.ndarray,
        curvatures: np.ndarray,
        forces: np.ndarray,
    ) -> np.ndarray:
        """Hessian (N, N) of the Lagrangian, for tensions (C,) and contact forces (c,) on pairs."""
        pressed = np.flatnonzero(forces > 0)
        if not len(pressed):
            return self.curvature(at, first, tensions)
        index, force = pairs[pressed, 1], forces[pressed]
        pushes = np.zeros_like(at.points)
        np.add.at(pushes, index, force[:, None] * normals[pressed])
        hessian = self.curvature(at, first, tensions, pushes)
        return less_bent(hessian, first.points[index], force[:, None, None] * curvatures[pressed])


def less_bent(hessian: np.ndarray, jacobian: np.ndarray, curvatures: np.ndarray) -> np.ndarray:
    """Take the curvature of forces x distances off a Hessian (N, N), in place; return it.

    Args:
        hessian: Of a Lagrangian.
        jacobian: (k, 3, N) of the points.
        curvatures: (k, 3, 3) Hessians of their distances, times their forces.
    """
    bent = curvatures @ jacobian
    size = len(hessian)
    hessian -= jacobian.reshape(-1, size).T @ bent.reshape(-1, size)
    return hessian
