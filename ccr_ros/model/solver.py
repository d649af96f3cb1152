# SPDX-License-Identifier: Apache-2.0
"""The warm solver of one finger: continuation in pulls and obstacles around the SQP."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .equilibrium import EquilibriumProblem
from .errors import InvalidValue
from .finger import Finger
from .obstacles import Obstacle
from .result import make_solution, meeting_disks, softest_direction
from .sensitivity import Sensitivity, sensitivity
from .settings import SolverSettings
from .solution import Solution
from .sqp import Bounds, KktPoint, derive, solve_sqp

_SMALLEST_STEP = 1.0 / 512  # of the way to the target
_NUDGE = 3e-2  # departure from a saddle, in the coordinates of which energy is 1/2 y.y


@dataclass(frozen=True)
class Move:
    """How a `FingerSolver.move` ended: converged or not, with a jump, or where disks would meet."""

    converged: bool
    jumped: bool
    met: tuple[int, int] | None


@dataclass(frozen=True, eq=False)
class Standing:
    """Where a `FingerSolver` stands (see `FingerSolver.standing`); nothing in it ever changes."""

    of: FingerSolver
    obstacles: tuple[Obstacle, ...]
    point: KktPoint
    pulls: np.ndarray
    obstacles_changed: bool
    solved: bool


class FingerSolver:
    """Finds the pose of one finger for a stream of cable pulls, warm from the last pose.

    The way from the last pulls to the new ones is taken in steps small enough to stay on the
    branch of equilibria that the finger is on. An obstacle that is put where the finger stands
    is likewise pushed out in steps. Not for use by several threads at once.

    Args:
        finger: The finger; its ``obstacles`` are the first ones.
        settings: Discretisation and tolerances.
    """

    def __init__(self, finger: Finger, settings: SolverSettings | None = None) -> None:
        self.finger = finger
        self.problem = EquilibriumProblem(finger, settings)
        self.settings = self.problem.settings
        self._solved = False
        self._obstacles_changed = False
        self._point: KktPoint
        self._pulls: np.ndarray
        self.reset()

    @property
    def rest_lengths(self) -> np.ndarray:
        """(m,) cable lengths inside the finger at rest [m]; what a percentage of pull is of."""
        return self.problem.rest_lengths * self.finger.length

    @property
    def rest(self) -> Solution:
        """The rest shape: no pulls, no obstacles."""
        solver = FingerSolver(replace(self.finger, obstacles=()), self.settings)
        return solver.solve(np.zeros(len(self.finger.cables)))

    @property
    def point(self) -> KktPoint:
        """Where the solver stands: the last pose that converged, with all derivatives."""
        return self._point

    @property
    def obstacles(self) -> tuple[Obstacle, ...]:
        """What the finger may touch, in its base frame; assign to replace.

        Raises:
            InvalidValue: On assigning one that overlaps the base disk; the old ones stay.
        """
        return self.problem.obstacles

    @obstacles.setter
    def obstacles(self, obstacles: Sequence[Obstacle]) -> None:
        obstacles = tuple(obstacles)
        for obstacle in obstacles:
            self.finger.check_clear_of_base(obstacle, f"obstacles.{obstacle.name}")
        # Obstacles that stay keep their contact forces as a guess.
        old = {id(o): row for o, row in zip(self.obstacles, self._point.forces, strict=True)}
        none = np.zeros(len(self.problem.points.labels))
        forces = [old.get(id(o), none) for o in obstacles]
        self.problem.obstacles = obstacles
        self._point = self._derived(self._point.at.y, self._point.tensions, forces)
        self._obstacles_changed, self._solved = True, False

    def reset(self) -> None:
        """Forget the last pose: the next solve starts from the rest shape."""
        self._pulls = np.zeros(len(self.finger.cables))
        self._point = self._at_rest()
        self._obstacles_changed, self._solved = True, False

    def solve(self, pulls: Mapping[str, float] | Sequence[float] | np.ndarray) -> Solution:
        """Return the pose for cable pulls [m]: a mapping by cable name, or one per cable in order.

        A solve that does not converge says so in the certificate, shows the last pose on the way
        that did, and leaves the solver where it was.

        Raises:
            InvalidValue, UnknownName: Bad pulls; nothing has moved.
        """
        begin = time.perf_counter()
        target = self.checked_pulls(pulls)
        walk = self._walk(self._point, self._pulls, target)
        if walk.reached is not None and self.obstacles and np.any(self._point.at.y):
            # Stuck: an obstacle that came where the finger stands, say. From rest there may be a
            # way round it, which is a jump from where the finger was.
            again = self._walk(self._at_rest(), np.zeros_like(target), target)
            again.iterations += walk.iterations
            if again.reached is None:
                again.jumped = True
                walk = again
        self._take(walk, target)
        return make_solution(
            self.problem, target, walk, elapsed=lambda: time.perf_counter() - begin
        )

    def move(self, pulls: Mapping[str, float] | Sequence[float] | np.ndarray) -> Move:
        """Solve on the branch that the finger is on, without a `Solution`, which costs extra.

        Raises:
            InvalidValue, UnknownName: As for `solve`.
        """
        target = self.checked_pulls(pulls)
        walk = self._walk(self._point, self._pulls, target)
        self._take(walk, target)
        return Move(walk.reached is None, walk.jumped, walk.met)

    def checked_pulls(
        self, pulls: Mapping[str, float] | Sequence[float] | np.ndarray
    ) -> np.ndarray:
        """Return pulls as `solve` takes them as (m,) [m]; nothing is solved.

        Raises:
            InvalidValue, UnknownName: Bad pulls.
        """
        target = self.finger.pulls_array(pulls)
        for name, pull, rest in zip(
            self.finger.cable_names, target, self.rest_lengths, strict=True
        ):
            if pull >= rest:
                raise InvalidValue(
                    f"pulls.{name}",
                    float(pull),
                    f"less than the cable's length inside the finger, {rest:.6g} m",
                )
        return target

    def _take(self, walk: _Walk, target: np.ndarray) -> None:
        if walk.reached is None:
            self._point, self._pulls = walk.point, target
            self._obstacles_changed, self._solved = False, True

    def sensitivity(self) -> Sensitivity:
        """Return the derivatives of the last converged pose with respect to the pulls.

        Raises:
            InvalidValue: Nothing has been solved since the start, a reset or new obstacles.
        """
        if not self._solved:
            raise InvalidValue("sensitivity", None, "asked for after a converged solve")
        return sensitivity(self.problem, self._point)

    @property
    def standing(self) -> Standing:
        """Where the solver stands; a solver of the same finger can `resume` from it."""
        return Standing(
            self, self.obstacles, self._point, self._pulls, self._obstacles_changed, self._solved
        )

    def resume(self, standing: Standing) -> None:
        """Go back, or over, to where a solver of the same finger and settings stood.

        Raises:
            InvalidValue: It is of another finger, or of one that is discretised otherwise.
        """
        other, mine = standing.of.problem, self.problem
        same = other.settings.cable_model == mine.settings.cable_model
        if (
            other.finger is not self.finger
            or other.rod.order != mine.rod.order
            or not (same and other.arcs == mine.arcs)
        ):
            allowed = f"of a solver of finger {self.finger.name!r} itself, with the same settings"
            raise InvalidValue("standing", other.finger.name, allowed)
        self.problem.obstacles = standing.obstacles
        self._point, self._pulls = standing.point, standing.pulls
        self._obstacles_changed, self._solved = standing.obstacles_changed, standing.solved

    def _walk(self, point: KktPoint, pulls: np.ndarray, target: np.ndarray) -> _Walk:
        """Walk from a point under pulls to the target; each walk has the time limit to itself."""
        deadline = time.thread_time() + self.settings.time_limit
        walk = _Walk(self.problem, point, pulls, deadline)
        if self._obstacles_changed:
            # Objects come and go at once, and the finger with them: that is no jump of its own.
            walk.run(pulls, watched=False)
        if walk.reached is None:
            walk.run(target, watched=True)
        return walk

    def _at_rest(self) -> KktPoint:
        none = np.zeros(len(self.problem.points.labels))
        tensions = np.zeros(len(self.problem.group_cable))
        return self._derived(np.zeros(self.problem.size), tensions, [none] * len(self.obstacles))

    def _derived(
        self, y: np.ndarray, tensions: np.ndarray, forces: Sequence[np.ndarray]
    ) -> KktPoint:
        count = len(self.problem.points.labels)
        table = np.array(forces).reshape(len(forces), count)
        return derive(self.problem, self.problem.evaluate(y), tensions, table)


class _Walk:
    """A continuation from an equilibrium to other pulls and unrelaxed obstacles.

    Attributes:
        point: Where it stands; pulls: (m,) the pulls there.
        reached: None once the target is reached; else the fraction of the way that was, in [0, 1).
        iterations: QP steps taken; substeps: continuation steps accepted.
        jumped: A step could not be made short enough for the pose to change in proportion.
        met: Disks that would meet beyond ``point``, or None.
        late: The time limit ended the walk.
    """

    def __init__(
        self, problem: EquilibriumProblem, point: KktPoint, pulls: np.ndarray, deadline: float
    ) -> None:
        self.problem = problem
        self.point = point
        self.pulls = pulls
        self.reached: float | None = None
        self.iterations = 0
        self.substeps = 0
        self.jumped = False
        self.met: tuple[int, int] | None = None
        self.late = False
        self._deadline = deadline

    def run(self, target: np.ndarray, watched: bool) -> None:
        """Walk to the target pulls; ``watched``: halve the steps until the pose follows them."""
        problem, settings = self.problem, self.problem.settings
        start = self.pulls
        inside = np.maximum(-self.point.at.distances, 0.0)
        inside[:, problem.fixed] = 0.0
        inside[inside < 10 * settings.tolerance] = 0.0
        change = float(np.abs(target - start).max()) / problem.finger.length
        change = max(change, float(inside.max(initial=0.0)))
        largest = min(1.0, settings.max_pull_step / change) if change > 0 else 1.0
        # A step that moves the finger more than this, per change, is suspected of a jump. Bending
        # moves the tip by up to about L / (2 a) per pull.
        gain = 3.0 * problem.finger.length / problem.finger.disk_radius
        done, size, patience = 0.0, largest, settings.max_iterations
        begin = self.point
        while done < 1.0:
            if self._is_late():
                self.reached = done
                return
            fraction = 1.0 if done + size > 1.0 - 1e-9 else done + size
            pulls = start + fraction * (target - start)
            bounds = Bounds(problem.length_bounds(pulls), (1.0 - fraction) * inside)
            result = solve_sqp(problem, begin, bounds, patience, self._deadline)
            self.iterations += result.iterations
            self.met = meeting_disks(problem, result.point) if result.converged else None
            good = result.converged and self.met is None
            suspect = good and watched and self._moved(result.point) > 1e-3 + gain * size * change
            leaving = patience > settings.max_iterations
            if (suspect or not good) and not leaving:
                if size > _SMALLEST_STEP and not self._at_saddle():
                    size *= 0.5
                    continue
                if not good and self.met is None:
                    # A saddle, or a symmetry that leaves the QP no solution: go off it.
                    begin = self._nudged()
                    size, patience = largest, 4 * settings.max_iterations
                    continue
            if not good:
                self.reached = done
                return
            self.jumped |= suspect or leaving
            self.substeps += 1
            self.point, self.pulls, done = result.point, pulls, fraction
            begin, patience = self.point, settings.max_iterations
            size = min(largest, size * (2.0 if result.iterations <= 5 else 1.0))
        self.pulls = target

    def _is_late(self) -> bool:
        self.late = time.thread_time() > self._deadline
        return self.late

    def _at_saddle(self) -> bool:
        return softest_direction(self.point)[0] < 0.0

    def _nudged(self) -> KktPoint:
        """A departure from the point along its softest direction, of a sign chosen once for all."""
        point, (_, way) = self.point, softest_direction(self.point)
        way = way * np.sign(way[np.argmax(np.abs(way))])
        at = self.problem.evaluate(point.at.y + _NUDGE * way)
        return derive(self.problem, at, point.tensions, point.forces)

    def _moved(self, point: KktPoint) -> float:
        """Farthest way of a disk centre from the last point (units of L)."""
        centres = self.problem.points.backbone
        way = point.at.points[centres] - self.point.at.points[centres]
        return float(np.sqrt((way * way).sum(axis=1).max()))


def solve(
    finger: Finger,
    pulls: Mapping[str, float] | Sequence[float] | np.ndarray,
    settings: SolverSettings | None = None,
) -> Solution:
    """Return the pose of a finger for cable pulls [m], from rest. One-off; see `FingerSolver`."""
    return FingerSolver(finger, settings).solve(pulls)
