# SPDX-License-Identifier: Apache-2.0
"""The warm solver of one finger: continuation in pulls and obstacles around the SQP."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from .equilibrium import EquilibriumProblem
from .errors import InvalidValue
from .finger import Finger
from .obstacles import Obstacle
from .result import make_solution
from .sensitivity import Sensitivity, sensitivity
from .settings import SolverSettings
from .solution import Solution
from .sqp import Bounds, KktPoint, solve_sqp

_SMALLEST_STEP = 1.0 / 1024  # of the way to the target


@dataclass
class _State:
    """Where the finger stands: an equilibrium for these pulls and these relaxed obstacles."""

    y: np.ndarray
    tensions: np.ndarray
    forces: np.ndarray
    pulls: np.ndarray


class FingerSolver:
    """Finds the pose of one finger for a stream of cable pulls, warm from the last pose.

    The way from the last pulls to the new ones is taken in steps small enough to stay on the
    branch of equilibria that the finger is on. An obstacle that is put where the finger stands
    is likewise pushed out in steps. Not for use by several threads at once.

    Args:
        finger: The finger; its ``obstacles`` are the first ones.
        settings: Discretisation and tolerances.

    Raises:
        InvalidValue: An obstacle contains the finger's base disk.
    """

    def __init__(self, finger: Finger, settings: SolverSettings | None = None) -> None:
        self.finger = finger
        self.problem = EquilibriumProblem(finger, settings)
        self.settings = self.problem.settings
        self._point: KktPoint | None = None
        self._obstacles_changed = False
        self._state = self._rest_state()
        self.obstacles = finger.obstacles

    @property
    def rest_lengths(self) -> np.ndarray:
        """(m,) cable lengths inside the finger at rest [m]; what a percentage of pull is of."""
        return self.problem.rest_lengths * self.finger.length

    @property
    def rest(self) -> Solution:
        """The rest shape: no pulls, no obstacles."""
        solver = FingerSolver(_without_obstacles(self.finger), self.settings)
        return solver.solve(np.zeros(len(self.finger.cables)))

    @property
    def obstacles(self) -> tuple[Obstacle, ...]:
        """What the finger may touch, in its base frame; assign to replace."""
        return self.problem.obstacles

    @obstacles.setter
    def obstacles(self, obstacles: Sequence[Obstacle]) -> None:
        obstacles = tuple(obstacles)
        base = self.problem.points.disk == 0
        where = self.problem.rest.points[base] * self.finger.length
        for obstacle in obstacles:
            deepest = float(obstacle.signed_distance(where).min())
            if deepest < 0:
                raise InvalidValue(
                    f"obstacles.{obstacle.name}",
                    obstacle,
                    f"clear of the base disk of finger {self.finger.name!r}"
                    f" (overlaps it by {-deepest * 1e3:.3g} mm)",
                )
        old = {id(o): row for o, row in zip(self.obstacles, self._state.forces, strict=False)}
        count = len(self.problem.points.labels)
        rows = [old.get(id(o), np.zeros(count)) for o in obstacles]
        self._state.forces = np.array(rows).reshape(len(obstacles), count)
        self.problem.obstacles = obstacles
        self._point = None

    def reset(self) -> None:
        """Forget the last pose: the next solve starts from the rest shape."""
        self._state = self._rest_state()
        self._point = None

    def solve(self, pulls: Mapping[str, float] | Sequence[float] | np.ndarray) -> Solution:
        """Return the pose for cable pulls [m]: a mapping by cable name, or one per cable in order.

        A solve that does not converge says so in the certificate, shows the last pose on the way
        that did, and leaves the solver where it was.

        Raises:
            InvalidValue, UnknownName: Bad pulls; nothing has moved.
        """
        begin = time.perf_counter()
        target = self.finger.pulls_array(pulls)
        walk = _Walk(self.problem, self._state, target)
        point, reached = walk.run()
        if reached is None:
            self._state = _State(point.at.y, point.tensions, point.forces, target)
            self._point = point
        return make_solution(
            self.problem, point, target, walk, reached, elapsed=lambda: time.perf_counter() - begin
        )

    def sensitivity(self) -> Sensitivity:
        """Return the derivatives of the last converged pose with respect to the pulls.

        Raises:
            InvalidValue: Nothing has been solved since the start, a reset or new obstacles.
        """
        if self._point is None:
            raise InvalidValue("sensitivity", None, "asked for after a converged solve")
        return sensitivity(self.problem, self._point)

    def _rest_state(self) -> _State:
        problem = self.problem
        return _State(
            np.zeros(problem.size),
            np.zeros(len(problem.group_cable)),
            np.zeros((len(problem.obstacles), len(problem.points.labels))),
            np.zeros(len(self.finger.cables)),
        )


class _Walk:
    """One continuation from a state to target pulls and unrelaxed obstacles."""

    def __init__(self, problem: EquilibriumProblem, state: _State, target: np.ndarray) -> None:
        self.problem = problem
        self.start = state
        self.target = target
        self.iterations = 0
        self.substeps = 0
        self.jumped = False

    def run(self) -> tuple[KktPoint, float | None]:
        """Return the last converged point, and None or the fraction of the way that it stands at."""
        problem, state = self.problem, self.start
        first = problem.evaluate(state.y)
        inside = np.maximum(-first.distances, 0.0)
        inside[:, problem.points.disk == 0] = 0.0
        inside[inside < problem.settings.tolerance * 10] = 0.0
        change = float(np.abs(self.target - state.pulls).max(initial=0.0)) / problem.finger.length
        change = max(change, float(inside.max(initial=0.0)))
        done, size = 0.0, min(1.0, problem.settings.max_pull_step / max(change, 1e-12))
        y, tensions, forces = state.y, state.tensions, state.forces
        centres = first.points[problem.points.backbone]
        last: KktPoint | None = None
        # Beyond this gain (tip motion per pull, units of length) a step is suspected of a jump.
        gain = 3.0 * problem.finger.length / problem.finger.disk_radius
        while done < 1.0:
            size = min(size, 1.0 - done)
            if 1.0 - done - size < 1e-9:
                size = 1.0 - done
            fraction = 1.0 if size == 1.0 - done else done + size
            pulls = self.target if fraction == 1.0 else state.pulls + fraction * (self.target - state.pulls)
            bounds = Bounds(problem.length_bounds(pulls), (1.0 - fraction) * inside)
            point = solve_sqp(problem, y, tensions, forces, bounds)
            self.iterations += point.iterations
            moved = point.at.points[problem.points.backbone] - centres
            far = float(np.sqrt((moved * moved).sum(axis=1)).max())
            suspect = far > 1e-3 + gain * size * change
            if (not point.converged or suspect) and size > _SMALLEST_STEP:
                size *= 0.5
                continue
            if not point.converged:
                break
            self.jumped |= suspect
            self.substeps += 1
            last, done = point, fraction
            y, tensions, forces = point.at.y, point.tensions, point.forces
            centres = point.at.points[problem.points.backbone]
            size *= 2.0 if point.iterations <= 5 else 1.0
            size = min(size, problem.settings.max_pull_step / max(change, 1e-12))
        if last is None:
            bounds = Bounds(problem.length_bounds(state.pulls), inside)
            last = solve_sqp(problem, state.y, state.tensions, state.forces, bounds)
            self.iterations += last.iterations
        return last, None if done == 1.0 else done


def solve(
    finger: Finger,
    pulls: Mapping[str, float] | Sequence[float] | np.ndarray,
    settings: SolverSettings | None = None,
) -> Solution:
    """Return the pose of a finger for cable pulls [m], from rest. One-off; see `FingerSolver`."""
    return FingerSolver(finger, settings).solve(pulls)


def _without_obstacles(finger: Finger) -> Finger:
    from dataclasses import replace

    return replace(finger, obstacles=())
