# SPDX-License-Identifier: Apache-2.0
"""One row: a solver swept from rest to a pull in warm steps, timed and compared with the truth."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any, Protocol

import numpy as np

from ccr_ros.model import Finger, FingerSolver, SolverSettings

from .baselines import UNFINISHED, Baseline, Step
from .cases import Case, rms

OWN = "ccr_ros"


class Sweeper(Protocol):
    """What is timed: a solver that goes from pull to pull."""

    def reset(self) -> None:
        """Go back to the rest shape."""

    def step(self, pull: float, deadline: float) -> Step:
        """Solve at a pull (a fraction of rest length) from the last pose; mind the deadline."""

    def backbone(self) -> np.ndarray:
        """Return the disk centres (n+1, 3) [m] of the last pose."""


class OwnSweeper:
    """This project's `FingerSolver` as a sweeper."""

    def __init__(self, finger: Finger, settings: SolverSettings | None = None) -> None:
        self._solver = FingerSolver(finger, settings)
        self._full = self._solver.rest_lengths

    def reset(self) -> None:
        """Go back to the rest shape."""
        self._solver.reset()

    def step(self, pull: float, deadline: float) -> Step:
        """Solve; the deadline is minded between steps."""
        if time.perf_counter() > deadline:
            return UNFINISHED
        pulls = pull * self._full
        cpu_begin, begin = time.process_time(), time.perf_counter()
        self._solution = self._solver.solve(pulls)
        seconds, cpu_seconds = time.perf_counter() - begin, time.process_time() - cpu_begin
        certificate = self._solution.certificate
        return Step(seconds, cpu_seconds, certificate.iterations, certificate.converged)

    def backbone(self) -> np.ndarray:
        """Return the disk centres (n+1, 3) [m] of the last pose."""
        return self._solution.backbone


class BaselineSweeper:
    """A Cartesian baseline as a sweeper."""

    def __init__(self, baseline: Baseline) -> None:
        self._baseline = baseline
        self.reset, self.step = baseline.reset, baseline.step

    def backbone(self) -> np.ndarray:
        """Return the disk centres (n+1, 3) [m] of the last step."""
        return self._baseline.problem.backbone(self._baseline.w)


@dataclass(frozen=True)
class Plan:
    """What one row will measure.

    Attributes:
        group: The table it belongs to.
        name: Of the solver, or of its variant.
        case: The finger, obstacles and pull.
        make: Builds the solver; timed as its build.
        baseline: Name of the row of the same group, case and n that ratios refer to.
        steps: Of the sweep, equal in pull.
        repeats: Sweeps at most; more than one only while they fit ``repeat_seconds``.
        cap: Seconds after which the first sweep is stopped.
        repeat_seconds: No further sweep begins after so many seconds.
    """

    group: str
    name: str
    case: Case
    make: Callable[[], Sweeper]
    baseline: str
    steps: int = 20
    repeats: int = 1
    cap: float = 30.0
    repeat_seconds: float = 2.0

    @property
    def id(self) -> str:
        """What ``--rows`` matches: group/case/n/name."""
        return f"{self.group}/{self.case.name}/n{self.case.finger.segments}/{self.name}"


@dataclass
class Row:
    """One measured row; ``None`` where a quantity was not measured.

    Attributes:
        group, name, case, n: As in `Plan`.
        contact: Whether there is an obstacle.
        build_ms: Time to build the solver.
        steps, steps_wanted: Steps of the sweep done, and asked for.
        stopped_after_s: The cap that stopped the sweep, if it did.
        samples: Timed steps, all sweeps; ``converged`` of them converged.
        p50_ms, p99_ms: Percentiles of a step's wall time.
        cpu_ms: Median CPU time of a step; well below p50 where other programs took the CPU.
        iterations: Median per step.
        rms_mm, rms_percent: Over disk centres at the end of the sweep; % of the finger's length.
        rms_against: ``"reference"`` (the independent rod) or ``"ccr_ros"`` (this run's row).
        baseline: Name of the row that ratios refer to.
        ratio: This p50 (or memory) by the baseline's; below 1 is better than it.
        cpu_ratio: This cpu_ms by the baseline's.
        rms_ratio: This error by the baseline's; below 1 is better than it.
        memory_mb: Peak resident memory of build and steps, above the imported libraries.
        note: What a reader must know of this row.
        id: group/case/n/name.
    """

    group: str
    name: str
    case: str
    n: int
    contact: bool
    baseline: str
    id: str
    build_ms: float | None = None
    steps: int = 0
    steps_wanted: int = 0
    stopped_after_s: float | None = None
    samples: int = 0
    converged: int = 0
    p50_ms: float | None = None
    p99_ms: float | None = None
    cpu_ms: float | None = None
    iterations: float | None = None
    rms_mm: float | None = None
    rms_percent: float | None = None
    rms_against: str | None = None
    ratio: float | None = None
    cpu_ratio: float | None = None
    rms_ratio: float | None = None
    memory_mb: float | None = None
    note: str = ""
    backbone: np.ndarray | None = field(default=None, repr=False)

    def as_dict(self) -> dict[str, Any]:
        """Return what ``--json`` prints."""
        backbone, self.backbone = self.backbone, None
        values = asdict(self)
        self.backbone = backbone
        del values["backbone"]
        return values


def measure(plan: Plan) -> Row:
    """Build the solver, warm up with one step, and sweep."""
    row = Row(
        plan.group,
        plan.name,
        plan.case.name,
        plan.case.finger.segments,
        plan.case.contact,
        plan.baseline,
        plan.id,
        steps_wanted=plan.steps,
    )
    begin = time.perf_counter()
    sweeper = plan.make()
    row.build_ms = 1e3 * (time.perf_counter() - begin)
    pulls = float(plan.case.pull_fraction[0]) * np.arange(1, plan.steps + 1) / plan.steps

    # The first solve loads libraries and fills caches: it is not timed, but its deadline counts,
    # so that a solver too slow for a single step costs one cap, not two.
    warm_up = sweeper.step(pulls[0], time.perf_counter() + plan.cap)
    timed: list[Step] = []
    if warm_up.finished:
        begin = time.perf_counter()
        for sweep in range(plan.repeats):
            elapsed = time.perf_counter() - begin
            if sweep and elapsed > plan.repeat_seconds:
                break
            deadline = begin + plan.cap if sweep == 0 else np.inf
            done = _sweep(sweeper, pulls, deadline)
            if sweep == 0:
                row.steps = len(done)
                if row.steps == plan.steps:
                    row.backbone = sweeper.backbone()
            timed += done
            if row.steps < plan.steps:
                break
    _summarise(row, plan, timed)
    return row


def _sweep(sweeper: Sweeper, pulls: np.ndarray, deadline: float) -> list[Step]:
    sweeper.reset()
    done: list[Step] = []
    for pull in pulls:
        step = sweeper.step(float(pull), deadline)
        if not step.finished:
            break
        done.append(step)
    return done


def _summarise(row: Row, plan: Plan, timed: list[Step]) -> None:
    notes = []
    if row.steps < plan.steps:
        row.stopped_after_s = plan.cap
        notes.append(f"{row.steps} steps of {plan.steps}, stopped at {plan.cap:g} s")
    if timed:
        milliseconds = [1e3 * step.seconds for step in timed]
        row.p50_ms, row.p99_ms = (float(v) for v in np.percentile(milliseconds, [50, 99]))
        row.cpu_ms = 1e3 * float(np.median([step.cpu_seconds for step in timed]))
        row.iterations = float(np.median([step.iterations for step in timed]))
        row.samples, row.converged = len(timed), sum(step.converged for step in timed)
        if row.converged < row.samples:
            notes.append(f"{row.samples - row.converged} of {row.samples} steps not converged")
    if row.backbone is not None and plan.case.truth is not None:
        set_error(row, row.backbone, plan.case.truth, plan.case.finger.length, "reference")
    row.note = "; ".join(notes)


def set_error(
    row: Row, backbone: np.ndarray, truth: np.ndarray, length: float, against: str
) -> None:
    """Fill in the row's error of disk centres (n+1, 3) [m] for a finger of this length [m]."""
    error = rms(backbone, truth)
    row.rms_mm, row.rms_percent, row.rms_against = 1e3 * error, 100 * error / length, against
