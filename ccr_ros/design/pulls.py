# SPDX-License-Identifier: Apache-2.0
"""The pulls that bring a finger to a target: Gauss-Newton on the exact sensitivities.

Every pose on the way is an equilibrium that `FingerSolver` followed the finger to, so the answer
is one, and on the branch that the finger is on. `pulls_step` says what a step is.
"""

from __future__ import annotations

import math
import time
from collections.abc import Generator, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from ccr_ros.model import checks
from ccr_ros.model.errors import InvalidValue, NotConverged
from ccr_ros.model.finger import Finger
from ccr_ros.model.settings import SolverSettings
from ccr_ros.model.solution import Solution
from ccr_ros.model.solver import FingerSolver, Standing

from .pulls_limits import PullLimits
from .pulls_step import PullModel, Step
from .pulls_targets import Target, TargetError

_OPTIMAL = 1e-3  # relative offset; less than 1e-6 of the error could still be gained
_EASED = 1e-3  # relative; tensions this near to the least ones are
_FULL = 1e-6  # relative; a tension may be above its limit by this
_LONGEST = 0.04  # units of L; largest change of a pull in one step
_SHORTEST = 1e-5  # units of L; the same, where the search ends before what bars the way
_LET_OUT = 0.01  # units of L; by how much a cable that shall be slack is let out beyond taut
_TIGHTEST = 1e-9  # units of L; closer to taut than this is not told from it
_PROBE = 0.01  # units of L; see `_Search._lower`
_GENTLE = 1e-3  # relative; a fall of the error by less is no fall
_MOST_REFUSALS = 12
_SHORT = 0.25  # s of the CPU; where no equilibrium is found soon there mostly is none


@dataclass(frozen=True, eq=False)
class PullSolution:
    """Pulls, and the pose they bring the finger to, which is always a converged one.

    Attributes:
        pulls: (m,) [m]. A slack cable's is as much below where it would be taut as the planner's
            ``slack`` says, within its limits.
        solution: The pose, tensions and contacts for these pulls, with its certificate.
        error: How far it is from the target.
        reached: The weighted error is within the planner's tolerance.
        optimal: Reached; or the pose is a local minimum of the error within the limits: its
            gradient leaves less than a millionth of the error to be gained (``offset``), and no
            pull of one cable, 1 % of the finger's length more or less, lessens it.
        offset: The relative offset of Bates and Watts: what share of the residual the directions
            within the limits could still take away; 0 where reached.
        limits: The limits that hold the pose back, in words.
        direct: The finger comes to this pose when pulled straight from where it stood; ``None``:
            not tried.
        iterations: Steps tried; each is one solve or a few.
        seconds: Wall time.
        message: What to know, one line; empty if the target was reached and all is well.
    """

    pulls: np.ndarray
    solution: Solution
    error: TargetError
    reached: bool
    optimal: bool
    offset: float
    limits: tuple[str, ...]
    direct: bool | None
    iterations: int
    seconds: float
    message: str


class PullPlanner:
    """Finds pulls of one finger for a stream of targets, warm from the last pose.

    Args:
        finger: A finger; or a solver, whose own pose is then the start and is left alone.
        limits: Of tensions and pulls; default: tensions >= 0.
        slack: By how much a slack cable is let out beyond where it would be taut [m]; default: 1 %
            of the finger's length. With less, the pulls of a path are smoother where a cable
            begins or ceases to act, but a finger that goes to them in one stride, all cables in
            proportion, may be held up half-way by a cable that was to be slack.
        tolerance: Weighted error at which a target counts as reached, in units of the finger's
            length.
        max_iterations: Steps tried for one target.
        settings: Of the solver, where a finger is given.

    Raises:
        InvalidValue: A setting out of range, or the proportional cable model, in which a cable
            has no tension of its own.
    """

    def __init__(
        self,
        finger: Finger | FingerSolver,
        limits: PullLimits | None = None,
        slack: float | None = None,
        tolerance: float = 1e-6,
        max_iterations: int = 60,
        settings: SolverSettings | None = None,
    ) -> None:
        other = finger if isinstance(finger, FingerSolver) else None
        self.finger = finger.finger if isinstance(finger, FingerSolver) else finger
        settings = (other.settings if other else settings) or SolverSettings()
        short = min(settings.time_limit, _SHORT)
        self.solver = FingerSolver(self.finger, replace(settings, time_limit=short))
        if self.solver.settings.cable_model != "frictionless":
            raise InvalidValue("cable_model", self.solver.settings.cable_model, "'frictionless'")
        if other:
            self.solver.resume(other.standing)
        self.limits = limits or PullLimits.of(self.finger)
        length = self.finger.length
        slack = _LET_OUT * length if slack is None else slack
        self.slack = checks.real("slack", slack, low=0.0, high=length, unit="m")
        self.tolerance = checks.real("tolerance", tolerance, low=1e-9, high=1e-2)
        self.max_iterations = checks.integer("max_iterations", max_iterations, low=1, high=10_000)

    def reach(self, target: Target, *, thorough: bool = True) -> PullSolution:
        """Return the pulls that reach a target, or those that come nearest.

        Args:
            target: What shall be reached.
            thorough: See for a way on where the error's gradient ends, and whether the pulls lead
                to the pose when pulled straight from the start. For streams: False.

        Raises:
            InvalidValue, UnknownName: The target does not fit the finger; nothing has moved.
            NotConverged: The finger has no pose to start from.
        """
        steps = self.steps(target, thorough=thorough)
        while True:
            try:
                next(steps)
            except StopIteration as end:
                return end.value

    def track(self, targets: Iterable[Target]) -> Iterator[PullSolution]:
        """Yield the pulls for each of a stream of targets, each from the last one's pose."""
        for target in targets:
            yield self.reach(target, thorough=False)

    def steps(
        self, target: Target, *, thorough: bool = True
    ) -> Generator[None, None, PullSolution]:
        """Do what `reach` does, yielding after every solve: for who has other work between."""
        begin = time.perf_counter()
        target.check(self.solver.problem)
        start = self.solver.standing
        search = _Search(self, target, thorough)
        yield from search.run()
        settled, pulls = self._settled(search)
        direct = None
        if thorough:
            yield
            direct = yield from self._is_direct(start, pulls)
        message = _message(search, settled, direct)
        return PullSolution(
            pulls=pulls,
            solution=settled,
            error=target.error(self.solver.problem, self.solver.point),
            reached=search.reached,
            optimal=search.reached or search.optimal,
            offset=0.0 if search.reached else search.offset,
            limits=search.held_by(),
            direct=direct,
            iterations=search.iterations,
            seconds=time.perf_counter() - begin,
            message=message,
        )

    def _settled(self, search: _Search) -> tuple[Solution, np.ndarray]:
        """Solve for the pulls of where the search has ended."""
        slack = max(self.slack / self.finger.length, _TIGHTEST)
        pulls = search.model.settled_pulls(slack) * self.finger.length
        solution = self.solver.solve(pulls)
        return solution.require_converged(), pulls

    def _is_direct(self, start: Standing, pulls: np.ndarray) -> Generator[None, None, bool]:
        """Pull from the start straight to the pulls, in the strides that a solve takes."""
        end = self.solver.standing
        stride = self.solver.settings.max_pull_step * self.finger.length
        strides = max(1, math.ceil(float(np.abs(pulls - start.pulls).max()) / stride))
        there = start
        for k in range(1, strides + 1):
            self.solver.resume(there)
            part = k / strides
            moved = self.solver.move(start.pulls + part * (pulls - start.pulls))
            there = self.solver.standing
            self.solver.resume(end)
            if not moved.converged:
                return False
            yield
        way = np.abs(there.point.at.points - end.point.at.points).max()
        return bool(way < 1e-5)


class _Search:
    """The search for one target, from where the planner's solver stands."""

    def __init__(self, planner: PullPlanner, target: Target, thorough: bool) -> None:
        self._planner, self._target, self._thorough = planner, target, thorough
        self._solver, self._length = planner.solver, planner.finger.length
        self._damping, self._price, self._longest = 0.0, 0.0, _LONGEST
        self.iterations = 0
        self.optimal = self.jumped = False
        self.offset = 1.0
        self.barrier = ""  # what is on the way on
        self.model: PullModel

    @property
    def reached(self) -> bool:
        """Whether the target is reached, within the limits."""
        near = self.model.error <= self._planner.tolerance
        return bool(near and self.model.excess.max() <= _FULL)

    def run(self) -> Generator[None, None, None]:
        """Go to the target, or as near as the limits let."""
        standing = self._solver.standing
        if not standing.solved:
            if not self._solver.move(standing.pulls).converged:
                why = "the finger does not stand free of its obstacles; solve it first"
                raise NotConverged(self._planner.finger.name, why)
            yield
        self.model = self._model()
        curvature, refusals = np.zeros((len(self.model.taut),) * 2), 0
        barred = 0
        while self.iterations < self._planner.max_iterations:
            model = self.model
            newton = model.step(curvature, 0.0)
            if newton is None:
                return
            self.offset = model.offset(newton)
            if self.reached and newton.relief <= _EASED:
                return
            if not self.reached and self._is_flat(newton):
                lower = yield from self._lower()
                if not lower:
                    self.optimal = True
                    return
                curvature, refusals = np.zeros_like(curvature), 0
                continue
            step = newton if self._damping == 0.0 else model.step(curvature, self._damping)
            if step is None:
                return
            self._price = max(self._price, 2.0 * step.price)
            step = model.shortened(step, self._longest)
            tried = self._try(model.pulls(step, _LET_OUT), self._allowed(step))
            yield
            if tried is None:
                refusals += 1
                barred += bool(self.barrier)
                if max(refusals, barred) > _MOST_REFUSALS or self._longest < _SHORTEST:
                    return
                if self.barrier:  # up to it, in shorter steps
                    self._longest = 0.25 * min(self._longest, step.size)
                    continue
                size = float(np.trace(model.jacobian.T @ model.jacobian))
                self._damping = max(10.0 * self._damping, 1e-4 * max(size, 1e-9))
                continue
            curvature = _updated(curvature, model, tried)
            self._longest = min(_LONGEST, 2.0 * self._longest)
            refusals, self._damping = 0, 0.1 * self._damping if self._damping > 1e-9 else 0.0
            self.model = tried

    def held_by(self) -> tuple[str, ...]:
        """Name the limits that the pose is at; tensions of 0 are none."""
        words = []
        full, low, high = self.model.at_limits()
        for name, at, below, above in zip(
            self._planner.finger.cable_names, full, low, high, strict=True
        ):
            words += [f"tension of {name}"] * bool(at) + [f"least pull of {name}"] * bool(below)
            words += [f"largest pull of {name}"] * bool(above)
        return tuple(words)

    def _model(self) -> PullModel:
        planner = self._planner
        return PullModel(self._solver.problem, self._solver.point, self._target, planner.limits)

    def _is_flat(self, newton: Step) -> bool:
        return bool(self.offset <= _OPTIMAL and self.model.excess.max() <= _FULL)

    def _allowed(self, step: Step) -> float:
        """The merit below which a step is taken; one that eases tensions may lose a little."""
        merit = self._merit(self.model)
        if step.relief > _EASED and self.model.error < 1e-3:
            return max(merit, 0.5e-6)
        return merit - 1e-4 * min(step.gain, merit)

    def _merit(self, model: PullModel) -> float:
        return 0.5 * model.error**2 + self._price * float((model.excess).sum())

    def _try(self, pulls: np.ndarray, allowed: float) -> PullModel | None:
        """Move the finger; back again, and None, unless the merit is allowed there."""
        self.iterations += 1
        before = self._solver.standing
        longest = self._solver.problem.rest_lengths * 0.999
        moved = self._solver.move(np.minimum(pulls, longest) * self._length)
        if moved.converged:
            model = self._model()
            if self._merit(model) <= allowed:
                self.jumped |= moved.jumped
                self.barrier = ""
                return model
        elif moved.met:
            self.barrier = "disks {} and {} meet".format(*moved.met)
        else:
            self.barrier = "no equilibrium is found"
        self._solver.resume(before)
        return None

    def _lower(self) -> Generator[None, None, bool]:
        """Look for a lower error by pulling each cable more, and less, on its own.

        Where the gradient ends the error may have a saddle, as for a straight finger and a point
        on its axis: whichever way it bends, the tip comes nearer.
        """
        if not self._thorough:
            return False
        model = self.model
        allowed = self._merit(model) * (1.0 - _GENTLE)
        for cable in range(len(model.taut)):
            for sign in (1.0, -1.0):
                if sign < 0 and not model.taut[cable]:
                    continue
                pulls = model.settled_pulls(_LET_OUT)
                pulls[cable] = model.lengths[cable] + sign * _PROBE
                low, high = self._planner.limits.low[cable], self._planner.limits.high[cable]
                if not low <= pulls[cable] * self._length <= high:
                    continue
                tried = self._try(pulls, allowed)
                yield
                if tried is not None:
                    self.model = tried
                    return True
        return False


def _updated(curvature: np.ndarray, old: PullModel, new: PullModel) -> np.ndarray:
    """S of the next step, from what the last one has shown of the residual's curvature."""
    if np.any(old.taut != new.taut) or new.error < 1e-3 * old.error:
        return np.zeros_like(curvature)
    moved = np.where(new.taut, new.lengths - old.lengths, new.tensions - old.tensions)
    shown = (new.jacobian - old.jacobian).T @ new.residual
    bent = curvature @ moved
    if moved @ bent != 0.0:  # the residual has shrunk, and its curvature's weight with it
        part = min(1.0, abs(float(moved @ shown)) / abs(float(moved @ bent)))
        curvature, bent = part * curvature, part * bent
    left = shown - bent
    weight = float(left @ moved)
    if abs(weight) <= 1e-8 * float(np.linalg.norm(left) * np.linalg.norm(moved)):
        return curvature
    return curvature + np.outer(left, left) / weight


def _message(search: _Search, solution: Solution, direct: bool | None) -> str:
    notes = []
    if not search.reached:
        held = search.held_by()
        if search.optimal:
            why = f" within the limits ({', '.join(held)})" if held else ""
            notes.append(f"out of reach; this is the nearest pose{why} on this branch")
        elif search.barrier:
            notes.append(f"not reached: on the way on {search.barrier}")
        else:
            notes.append("not reached, and it is not shown that no pose is nearer")
    if search.jumped:
        notes.append("the finger snapped to another branch of equilibria on the way")
    if direct is False:
        notes.append(
            "pulled straight from where it stood the finger comes to another pose:"
            " pull in the steps of a path"
        )
    if not solution.certificate.stable:
        notes.append("the pose is not stable: a disturbance moves it")
    return "; ".join(notes)
