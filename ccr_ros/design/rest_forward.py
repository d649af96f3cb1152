# SPDX-License-Identifier: Apache-2.0
"""Where pulls bend a rest shape to, and the derivatives of that with respect to the rest curvature.

With the rest shape r in the coordinates of the pose q (see `rest_statics`) and the active
constraints A of the equilibrium, cables first, the implicit function theorem gives

    [H  A'] [dq]   [       dr        ]
    [A  0 ] [dm] = [ c dl/dr dr ;  0 ],

with the lengths l of the cables at rest and c = 1, or 1 - p for a pull p of the rest length.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ccr_ros.model.equilibrium import EquilibriumProblem
from ccr_ros.model.errors import UnknownName
from ccr_ros.model.finger import Finger
from ccr_ros.model.settings import SolverSettings
from ccr_ros.model.solver import FingerSolver
from ccr_ros.model.sqp import Bounds, KktPoint, derive, solve_sqp

from .pull import Pull

#: Vectors per segment of each kind of rest curvature: of one piece constant, of one or two linear.
KINDS = {"constant": 1, "linear": 2, "pieces": 4}
_TIME_LIMIT = 5.0  # s of CPU for one search
_ITERATIONS = 40
_TOUCHING = 1e-6  # of the length


@dataclass(frozen=True, eq=False)
class RestPose:
    """A finger with a rest curvature, in equilibrium under its pulls.

    Attributes:
        curvature: (n, v, 3) [1/m], v vectors per segment.
        problem: With that rest shape.
        point: The equilibrium.
        pulls: (m,) [m].
    """

    curvature: np.ndarray
    problem: EquilibriumProblem
    point: KktPoint
    pulls: np.ndarray

    @property
    def backbone(self) -> np.ndarray:
        """(n+1, 3) disk centres [m]."""
        return self.point.at.points[self.problem.points.backbone] * self.problem.finger.length


class RestForward:
    """The forward model of one finger as a function of its rest curvature.

    Args:
        finger: Its own rest shape does not matter; its obstacles count.
        pulls: One per cable.
        kind: One of `KINDS`.

    Raises:
        UnknownName: No such kind.
    """

    def __init__(self, finger: Finger, pulls: Sequence[Pull], kind: str = "pieces") -> None:
        if kind not in KINDS:
            raise UnknownName("kind of rest curvature", kind, KINDS)
        self.finger = finger
        self.pulls = tuple(pulls)
        self.vectors = KINDS[kind]
        self._problem = EquilibriumProblem(
            self.with_rest(np.zeros((finger.segments, self.vectors, 3))),
            SolverSettings(tolerance=1e-11),
        )
        self._map = self._linear_map()

    def with_rest(self, curvature: np.ndarray) -> Finger:
        """Return the finger with a rest curvature (n, v, 3)."""
        constant = self.vectors == 1
        return replace(self.finger, rest_curvature=curvature[:, 0] if constant else curvature)

    def from_rest(self, curvature: np.ndarray) -> RestPose | None:
        """Return the pose that pulling from rest leads to; None if it does not get there."""
        solver = FingerSolver(self.with_rest(curvature), self._problem.settings)
        pulls = self._in_metres(solver.rest_lengths)
        if not np.all(pulls < solver.rest_lengths):
            return None
        pose = solver.solve(pulls)
        if not pose.certificate.converged:
            return None
        return RestPose(curvature, solver.problem, solver.point, pulls)

    def near(self, curvature: np.ndarray, pose: RestPose) -> RestPose | None:
        """Return the equilibrium near another pose, by Newton's method; None if there is none."""
        finger = self.with_rest(curvature)
        problem = self._problem.with_rest_curvature(np.asarray(finger.rest_curvature))
        problem.obstacles = pose.problem.obstacles
        pulls = self._in_metres(problem.rest_lengths * finger.length)
        if not np.all(pulls < problem.rest_lengths * finger.length):
            return None
        old = pose.point
        y = old.at.y + ((pose.problem.z_rest - problem.z_rest) / problem.coordinate_scale).ravel()
        start = derive(problem, problem.evaluate(y), old.tensions, old.forces)
        nothing = np.zeros((len(problem.obstacles), len(problem.points.labels)))
        bounds = Bounds(problem.length_bounds(pulls), nothing)
        deadline = time.thread_time() + _TIME_LIMIT
        result = solve_sqp(problem, start, bounds, _ITERATIONS, deadline)
        if not result.converged:
            return None
        return RestPose(curvature, problem, result.point, pulls)

    def jacobian(self, pose: RestPose, held: bool = False) -> np.ndarray:
        """Return the derivatives (n+1, 3, n v 3) of the disk centres [m] by the curvature [1/m].

        Args:
            pose: Where.
            held: Whether points that touch an obstacle without force stay on it; else they leave.
        """
        problem, point = pose.problem, pose.point
        size = problem.size
        at_rest = problem.linearize(problem.rest).lengths @ self._map
        factor = np.array([1.0 - p.value if p.relative else 1.0 for p in self.pulls])
        acting = point.active
        if held and len(point.pairs):
            touching = point.at.distances[point.pairs[:, 0], point.pairs[:, 1]] < _TOUCHING
            acting = acting | np.concatenate([np.zeros(len(point.tensions), dtype=bool), touching])
        active = np.flatnonzero(acting)
        rows = point.rows[active]
        system = np.zeros((size + len(active), size + len(active)))
        system[:size, :size] = point.hessian
        system[:size, size:], system[size:, :size] = rows.T, rows
        right = np.zeros((len(system), self._map.shape[1]))
        right[:size] = self._map
        taut = active < len(self.pulls)
        right[size:][taut] = (factor[:, None] * at_rest)[active[taut]]
        try:
            solved = np.linalg.solve(system, right)
        except np.linalg.LinAlgError:  # twin constraints
            solved = np.linalg.lstsq(system, right, rcond=None)[0]
        moved = point.first.points[problem.points.backbone] @ solved[:size]
        return moved * self.finger.length

    def _in_metres(self, rest_lengths: np.ndarray) -> np.ndarray:
        return np.array(
            [
                p.value * length if p.relative else p.value
                for p, length in zip(self.pulls, rest_lengths, strict=True)
            ]
        )

    def _linear_map(self) -> np.ndarray:
        """Derivative (N, n v 3) of the scaled rest coordinates by the curvature."""
        problem, n, v = self._problem, self.finger.segments, self.vectors
        turn = problem.rod_step * self.finger.length / problem.coordinate_scale
        order = problem.rod.order + 1
        pieces = max(1, v // 2)
        local = np.zeros((pieces, order, 3, v, 3))
        for piece in range(pieces):
            for axis in range(3):
                ends = [0] if v == 1 else [2 * piece, 2 * piece + 1]
                local[piece, 0, axis, ends, axis] = 1.0 / len(ends)
                if order > 1 and v > 1:
                    local[piece, 1, axis, ends, axis] = [-0.5, 0.5]
        local *= turn.reshape(1, order, 3, 1, 1)
        return np.kron(np.eye(n), local.reshape(pieces * order * 3, v * 3))
