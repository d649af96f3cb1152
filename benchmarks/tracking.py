# SPDX-License-Identifier: Apache-2.0
"""How fast a tip path is turned into pulls: this project's planner next to nested SciPy searches.

The path is one that the finger can follow: where its tip goes as the pulls go once around. The
baselines search the pulls with `scipy.optimize.least_squares` around the same warm forward
solver, from the last point's pulls: by differences, as one would write it first, or handed the
exact Jacobian. Where cables are redundant they weigh tensions by a little, lest pulls be arbitrary.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from ccr_ros.design.pulls import PullPlanner
from ccr_ros.design.pulls_targets import TipTarget
from ccr_ros.model import Cable, Finger, FingerSolver

from .measure import OWN, Row

GROUP, BASELINE = "pulls", "least_squares"
SOLVERS = (OWN, BASELINE, "least_squares, exact Jacobian")
CASES = ("two_cables", "three_cables")
_LENGTH = 0.182  # m, of the paper's finger
_TOLERANCE = 1e-6  # of the length; a point is reached within it
_EASE = 1e-7  # weight of a tension, T L^2 / EI, in the baselines' residual
_CAP = 30.0  # s; a solver that needs longer is stopped
_FAILED = 10.0  # residual, units of L, where the finger has no pose


@dataclass(frozen=True)
class Track:
    """What one row will measure."""

    case: str
    solver: str

    def row(self) -> Row:
        """The row, to be filled."""
        row_id = f"{GROUP}/{self.case}/n9/{self.solver}"
        return Row(GROUP, self.solver, self.case, 9, False, BASELINE, row_id)


def tracks(quick: bool) -> list[Track]:
    """What is measured."""
    cases = CASES[:1] if quick else CASES
    return [Track(case, solver) for case in cases for solver in SOLVERS]


def track_finger(case: str) -> Finger:
    """Return the paper's finger with the case's cables: bending alike, or three around."""
    routings = {
        "two_cables": {"straight": [4] * 10, "helical": [7, 8, 9, 10, 11, 12, 1, 2, 3, 4]},
        "three_cables": {f"hole_{hole}": [hole] * 10 for hole in (1, 5, 9)},
    }[case]
    cables = tuple(Cable.from_holes(name, holes) for name, holes in routings.items())
    return Finger(case, _LENGTH, 9, 0.008, 0.0025, 0.39, cables)


def track_path(case: str, points: int) -> np.ndarray:
    """Return a closed path (points, 3) of the finger's tip [m]."""
    solver = FingerSolver(track_finger(case))
    tips = []
    for angle in np.linspace(0, 2 * np.pi, points):
        if case == "two_cables":
            pulls = 0.003 + 0.002 * np.array([np.cos(angle), np.sin(angle)])
        else:
            bend = 0.006 * np.cos(angle - np.array([0, 2, 4]) * np.pi / 3)
            pulls = np.where(bend > 0, bend, -0.02)
        tips.append(solver.solve(pulls).require_converged().backbone[-1])
    return np.array(tips)


def measure_track(row: Row, quick: bool) -> None:
    """Follow the path and fill in the row; the first point warms up and is not timed."""
    path = track_path(row.case, 25 if quick else 200)
    row.steps_wanted = len(path) - 1
    begin = time.perf_counter()
    follow = follower(row.name, track_finger(row.case))
    row.build_ms = 1e3 * (time.perf_counter() - begin)
    follow(path[0])
    walls, cpus, counts, errors = [], [], [], []
    begin = time.perf_counter()
    for point in path[1:]:
        if time.perf_counter() - begin > _CAP:
            row.stopped_after_s = _CAP
            break
        wall, cpu = time.perf_counter(), time.process_time()
        tip, count = follow(point)
        walls.append(1e3 * (time.perf_counter() - wall))
        cpus.append(1e3 * (time.process_time() - cpu))
        counts.append(count)
        errors.append(float(np.linalg.norm(tip - point)))
    off = np.array(errors)
    row.steps = row.samples = len(walls)
    row.converged = int((off <= 1.01 * _TOLERANCE * _LENGTH).sum())
    row.p50_ms, row.p99_ms = (float(v) for v in np.percentile(walls, [50, 99]))
    row.cpu_ms, row.iterations = float(np.median(cpus)), float(np.median(counts))
    notes = [
        f"{1e3 / row.p50_ms:.0f} points a second ({1e3 / row.cpu_ms:.0f} by CPU time)",
        f"tip off by {1e3 * np.sqrt(np.mean(off**2)):.1g} mm",
    ]
    if row.converged < row.samples:
        notes.append(f"{row.samples - row.converged} of {row.samples} not reached")
    if row.steps < row.steps_wanted:
        notes.append(f"stopped at {_CAP:g} s")
    row.note = "; ".join(notes)


Follower = Callable[[np.ndarray], tuple[np.ndarray, int]]  # point -> tip reached, steps


def follower(name: str, finger: Finger) -> Follower:
    """Return the solver of a row: from a point to where it brings the tip, and its steps."""
    if name == OWN:
        planner = PullPlanner(finger, tolerance=_TOLERANCE)

        def follow(point: np.ndarray) -> tuple[np.ndarray, int]:
            found = planner.reach(TipTarget(point), thorough=False)
            return found.solution.backbone[-1], found.iterations

        return follow
    nested = _Nested(finger, exact=name != BASELINE)
    return nested.follow


class _Nested:
    """A search of the pulls around the warm forward solver."""

    def __init__(self, finger: Finger, exact: bool) -> None:
        self._solver, self._exact = FingerSolver(finger), exact
        redundant = len(finger.cables) > 2
        self._ease = _EASE * _LENGTH**2 if redundant else 0.0
        self._pulls: np.ndarray | None = None
        self._count = 0

    def follow(self, point: np.ndarray) -> tuple[np.ndarray, int]:
        """Search from the last pulls; return where the tip is, and how often it was solved."""
        if self._pulls is None:
            # Where all cables are slack no pull does anything: begin at the first point.
            planner = PullPlanner(self._solver.finger, slack=1e-4)
            self._pulls = planner.reach(TipTarget(point)).pulls
            self._solver.resume(planner.solver.standing)
        self._count = 0
        found = least_squares(
            self._residual,
            self._pulls,
            jac=self._jacobian if self._exact else "2-point",
            x_scale=0.001,
            diff_step=None if self._exact else 1e-5,
            xtol=1e-10,
            ftol=1e-14,
            gtol=1e-14,
            max_nfev=100,
            args=(point,),
        )
        self._pulls = found.x
        return self._solver.solve(found.x).backbone[-1], self._count

    def _residual(self, pulls: np.ndarray, point: np.ndarray) -> np.ndarray:
        self._count += 1
        solution = self._solver.solve(pulls)
        if not solution.certificate.converged:
            return np.full(3 + len(pulls), _FAILED)
        off = (solution.backbone[-1] - point) / _LENGTH
        return np.concatenate([off, self._ease * solution.tensions])

    def _jacobian(self, pulls: np.ndarray, point: np.ndarray) -> np.ndarray:
        if not self._solver.solve(pulls).certificate.converged:
            return np.zeros((3 + len(pulls), len(pulls)))
        slopes = self._solver.sensitivity()
        return np.concatenate([slopes.tip[:3] / _LENGTH, self._ease * slopes.tensions])
