# SPDX-License-Identifier: Apache-2.0
"""Routings found for disk centres: this project's search next to nested SciPy searches.

The targets are poses of the forward model, given as disk centres alone: of the paper's Helical,
General 1 and General 2 at their pulls, and of random routings, with changes of hole of any size.
The baselines search around the same forward solver: holes, by differential evolution on integers;
or angles, by least squares from a straight cable, rounded to holes at the end.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from scipy.optimize import differential_evolution, least_squares

from ccr_ros.design.pull import Pull
from ccr_ros.design.routing import design_routing
from ccr_ros.design.target import DesiredShape
from ccr_ros.model import Cable, Finger, FingerSolver

from .measure import OWN, Row

GROUP, BASELINE = "routing", "differential_evolution"
SOLVERS = (OWN, BASELINE, "least_squares, rounded")
CASES = ("table_i", "random")
_PAPER = {
    "helical": (0.040, [7, 8, 9, 10, 11, 12, 1, 2, 3, 4]),
    "general_1": (0.037, [1, 12, 11, 10, 10, 10, 10, 11, 12, 1]),
    "general_2": (0.033, [1, 12, 11, 10, 9, 8, 7, 7, 7, 7]),
}
_RANDOM = 6
_HOLES, _DISKS, _LENGTH = 12, 10, 0.182  # of the paper's finger
_NEAR = 1e-4  # m; a routing whose disks are all within it is found
_CAP, _QUICK_CAP = 8.0, 0.25  # s of CPU for one search of a baseline
_FAILED = 1.0  # m, error where the finger has no pose


@dataclass(frozen=True)
class Search:
    """What one row will measure."""

    case: str
    solver: str

    def row(self) -> Row:
        """The row, to be filled."""
        row_id = f"{GROUP}/{self.case}/n9/{self.solver}"
        return Row(GROUP, self.solver, self.case, 9, False, BASELINE, row_id)


def searches(quick: bool) -> list[Search]:
    """What is measured."""
    cases = CASES[:1] if quick else CASES
    return [Search(case, solver) for case in cases for solver in SOLVERS]


@dataclass(frozen=True, eq=False)
class Wanted:
    """Disk centres (n+1, 3) [m] that a cable pulled by a fraction of its length gives."""

    points: np.ndarray
    pull: float


def wanted(case: str) -> list[Wanted]:
    """Return a case's targets."""
    if case == "table_i":
        routings = list(_PAPER.values())
    else:
        rng = np.random.default_rng(1)
        routings = [
            (float(rng.uniform(0.01, 0.05)), rng.integers(1, _HOLES + 1, _DISKS).tolist())
            for _ in range(_RANDOM)
        ]
    return [Wanted(_backbone(_angles(holes), pull), pull) for pull, holes in routings]


def _angles(holes: list[int]) -> np.ndarray:
    return 2 * np.pi * (np.array(holes) - 1) / _HOLES


def _finger(angles: np.ndarray) -> Finger:
    return Finger("routing", _LENGTH, 9, 0.008, 0.0025, 0.39, (Cable("main", angles),))


def _backbone(angles: np.ndarray, pull: float) -> np.ndarray:
    """Disk centres [m]; far away where there is no pose."""
    solver = FingerSolver(_finger(angles))
    solution = solver.solve(pull * solver.rest_lengths)
    if not solution.certificate.converged:
        return np.full((_DISKS, 3), _FAILED)
    return solution.backbone


def measure_search(row: Row, quick: bool) -> None:
    """Search for every target of the row's case and fill in the row; one more search warms up."""
    targets = wanted(row.case)
    row.steps_wanted = row.steps = row.samples = len(targets)
    find = _SEARCHES[row.name]
    cap = _QUICK_CAP if quick else _CAP
    if row.name == OWN:
        find(targets[0], cap)
    walls, cpus, counts, errors = [], [], [], []
    for target in targets:
        wall, cpu = time.perf_counter(), time.process_time()
        angles, count = find(target, cap)
        walls.append(1e3 * (time.perf_counter() - wall))
        cpus.append(1e3 * (time.process_time() - cpu))
        counts.append(count)
        off = np.linalg.norm(_backbone(angles, target.pull) - target.points, axis=1)
        errors.append(float(off.max()))
    row.p50_ms, row.p99_ms = (float(v) for v in np.percentile(walls, [50, 99]))
    row.cpu_ms, row.iterations = float(np.median(cpus)), float(np.median(counts))
    row.converged = sum(error <= _NEAR for error in errors)
    row.note = (
        f"{row.converged} of {row.samples} found; disks off by {1e3 * np.median(errors):.2g} mm"
        f" (median), {1e3 * max(errors):.2g} mm at most"
    )
    if row.name != OWN and max(cpus) >= 1e3 * cap:
        row.note += f"; stopped at {cap:g} s of CPU"


def _own(target: Wanted, cap: float) -> tuple[np.ndarray, int]:
    pulls = [Pull(target.pull, relative=True)]
    start = _finger(np.zeros(_DISKS))
    design = design_routing(start, DesiredShape(target.points), pulls, candidates=1)
    return design.best.finger.cables[0].angles, 1


class _Over(Exception):
    """Ends a search: at its cap, or at a routing that is near enough."""


class _Counted:
    """Errors of routings, counted and timed; remembers the nearest."""

    def __init__(self, target: Wanted, cap: float) -> None:
        self._target = target
        self._deadline = time.thread_time() + cap
        self.count = 0
        self.best = np.zeros(_DISKS)
        self._least = np.inf

    def errors(self, angles: np.ndarray) -> np.ndarray:
        """Errors (3 (n+1),) of the disks [m]."""
        if time.thread_time() > self._deadline:
            raise _Over
        self.count += 1
        off = (_backbone(angles, self._target.pull) - self._target.points).ravel()
        if off @ off < self._least:
            self._least, self.best = float(off @ off), angles
        return off


def _evolved(target: Wanted, cap: float) -> tuple[np.ndarray, int]:
    counted = _Counted(target, cap)

    def cost(holes: np.ndarray) -> float:
        off = counted.errors(2 * np.pi * np.round(holes) / _HOLES)
        if np.linalg.norm(off.reshape(-1, 3), axis=1).max() <= _NEAR:
            raise _Over
        return float(off @ off)

    bounds, integers = [(0, _HOLES - 1)] * _DISKS, [True] * _DISKS
    with suppress(_Over):
        differential_evolution(
            cost, bounds, integrality=integers, maxiter=10_000, tol=0, polish=False, seed=1
        )
    return counted.best, counted.count


def _rounded(target: Wanted, cap: float) -> tuple[np.ndarray, int]:
    counted = _Counted(target, cap)
    tip = target.points[-1]
    start = np.full(_DISKS, float(np.arctan2(tip[1], tip[0])))
    with suppress(_Over):
        least_squares(counted.errors, start, diff_step=1e-6, x_scale=0.1, max_nfev=200)
    step = 2 * np.pi / _HOLES
    return np.round(counted.best / step) * step, counted.count


_SEARCHES: dict[str, Callable[[Wanted, float], tuple[np.ndarray, int]]] = {
    OWN: _own,
    BASELINE: _evolved,
    "least_squares, rounded": _rounded,
}
