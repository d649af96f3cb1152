# SPDX-License-Identifier: Apache-2.0
"""How fast fingers and the object they hold are solved together, warm, and moves are planned.

``ball``: the paper's sphere gripper holds its ball of 112 mm and 20 g, and the pulls go round and
round by 0.2 % of the cables' lengths, each finger a little behind the other; IPOPT on the same
problem without friction (`coupled`) is what all rows of it are compared with. ``cube``: the cube
gripper turns its cube of 40 mm by 20 degrees about the vertical axis and back, along pulls that
were planned. ``turn``: that plan itself, in the steps that plans have.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ccr_ros.grasp.manipulation import MoveLimits, MoveTarget, Waypoint, plan_move
from ccr_ros.grasp.statics import GraspSolver, box_body, sphere_body
from ccr_ros.model import Pose, load_gripper
from ccr_ros.resources import find_config

from .coupled import CoupledIpopt
from .measure import OWN, Row

GROUP, BASELINE, ROUGH, PLAN = "grasp", "ipopt", "ccr_ros, friction", "ccr_ros, plan_move"
_SEGMENTS = 9
_CYCLE = 60  # solves
_WARM = 3  # solves that are not timed
_MIDDLE, _SWING, _LAG = 0.034, 0.002, 0.1  # of the cables' lengths; rad from finger to finger
_TURN = 20.0  # degrees
_FINE = 1e-5  # m; step of the cube's stream
_CUBE_PULLS = {"finger_1": [0.00217, 0.00217], "finger_2": [0.003524], "finger_3": [0.003524]}

Solve = Callable[[dict[str, np.ndarray]], tuple[bool, int]]  # pulls -> converged, iterations


@dataclass(frozen=True)
class Grasp:
    """What one row will measure."""

    case: str
    solver: str

    def row(self) -> Row:
        """The row, to be filled."""
        row_id = f"{GROUP}/{self.case}/n{_SEGMENTS}/{self.solver}"
        return Row(GROUP, self.solver, self.case, _SEGMENTS, True, BASELINE, row_id)


def grasps(quick: bool) -> list[Grasp]:
    """What is measured."""
    rows = [Grasp("ball", name) for name in (OWN, ROUGH, BASELINE)]
    return rows if quick else [*rows, Grasp("cube", ROUGH), Grasp("turn", PLAN)]


def ball_solver(friction: float = 0.0) -> GraspSolver:
    """Return the sphere gripper with its ball in hand."""
    pose = Pose(np.array([0.0, 0.0, 0.110]))
    fingers = load_gripper(find_config("gripper_sphere")).fingers
    solver = GraspSolver(fingers, sphere_body(0.112, 0.02, pose, friction))
    solver.solve(_ball_pulls(solver, 0)).require_converged()
    solver.let_go().require_converged()
    return solver


def cube_solver(friction: float = 0.8) -> GraspSolver:
    """Return the cube gripper with its cube in hand."""
    pose = Pose(np.array([0.0, 0.0, 0.170]))
    fingers = load_gripper(find_config("gripper_cube")).fingers
    solver = GraspSolver(fingers, box_body(np.full(3, 0.04), 0.01, pose, friction))
    solver.solve(_CUBE_PULLS).require_converged()
    solver.let_go().require_converged()
    return solver


def ball_maker(name: str) -> Callable[[], Solve]:
    """Return the maker of a row's solver of the ball, which has it in hand.

    IPOPT starts from where this project's solver holds the ball, which is no part of its making.
    """
    if name != BASELINE:
        return lambda: _own(ball_solver(0.5 if name == ROUGH else 0.0))
    held = ball_solver()

    def make() -> Solve:
        peer = CoupledIpopt(held)
        return lambda pulls: peer.solve(list(pulls.values()))

    return make


def ball_path(solves: int) -> list[dict[str, np.ndarray]]:
    """Return the pulls [m] by finger of each solve."""
    solver = GraspSolver(load_gripper(find_config("gripper_sphere")).fingers, sphere_body(0.112))
    return [_ball_pulls(solver, k) for k in range(solves)]


def measure_grasp(row: Row, quick: bool) -> None:
    """Measure and fill in a row; its first solves warm up and are not timed."""
    if row.name == PLAN:
        _measure_plan(row, quick)
        return
    if row.case == "ball":
        make = ball_maker(row.name)
        begin = time.perf_counter()
        solve = make()
        row.build_ms = 1e3 * (time.perf_counter() - begin)
        path = ball_path(_WARM + (_CYCLE // 2 if quick else 3 * _CYCLE))
    else:
        solver = cube_solver()
        solve = _own(solver)
        there = [w.pulls for w in _turned(solver, _TURN, _FINE)]
        path = there + there[::-1]
    walls, cpus, counts = [], [], []
    for k, pulls in enumerate(path):
        wall, cpu = time.perf_counter(), time.process_time()
        converged, count = solve(pulls)
        if k < _WARM:
            continue
        walls.append(1e3 * (time.perf_counter() - wall))
        cpus.append(1e3 * (time.process_time() - cpu))
        counts.append(count)
        row.converged += converged
    row.steps = row.steps_wanted = row.samples = len(walls)
    _fill(row, walls, cpus, counts)
    if row.converged < row.samples:
        row.note = f"{row.samples - row.converged} of {row.samples} not converged"
    elif row.name == ROUGH:
        row.note = f"friction {0.5 if row.case == 'ball' else 0.8}, sticking and slipping"


def _measure_plan(row: Row, quick: bool) -> None:
    """Time a plan from waypoint to waypoint."""
    solver = cube_solver()
    walls: list[float] = []
    cpus: list[float] = []
    for _ in range(1 if quick else 3):
        marks: list[tuple[float, float]] = []
        turned = float(np.rad2deg(_turned(solver, _TURN, marks=marks)[-1].moved[5]))
        wall, cpu = 1e3 * np.diff(np.array(marks), axis=0).T
        walls.extend(wall)
        cpus.extend(cpu)
    row.steps = row.samples = row.steps_wanted = len(walls)
    row.converged = row.samples if abs(turned - _TURN) <= 0.2 else 0
    _fill(row, walls, cpus, [1] * len(walls))
    row.note = (
        f"{wall.sum() / turned:.0f} ms a degree of turn ({cpu.sum() / turned:.0f} of the CPU),"
        f" {turned:.1f} degrees; a step is a waypoint"
    )


def _fill(row: Row, walls: list[float], cpus: list[float], counts: list[int]) -> None:
    row.p50_ms, row.p99_ms = (float(v) for v in np.percentile(walls, [50, 99]))
    row.cpu_ms, row.iterations = float(np.median(cpus)), float(np.median(counts))


def _turned(
    solver: GraspSolver,
    degrees: float,
    step: float = 1e-4,
    marks: list[tuple[float, float]] | None = None,
) -> tuple[Waypoint, ...]:
    """The waypoints of a turn to the left; ``marks``: wall and CPU time [s] at each."""
    begin = time.perf_counter(), time.process_time()
    if marks is not None:
        marks.append(begin)

    def mark(_: Waypoint) -> bool:
        if marks is not None:
            marks.append((time.perf_counter(), time.process_time()))
        return True

    target = MoveTarget(turn=np.array([0.0, 0.0, np.deg2rad(degrees)]))
    return plan_move(solver, target, MoveLimits(margin=0.1, step=step), watch=mark).waypoints


def _own(solver: GraspSolver) -> Solve:
    def solve(pulls: dict[str, np.ndarray]) -> tuple[bool, int]:
        found = solver.solve(pulls)
        return found.converged, found.iterations

    return solve


def _ball_pulls(solver: GraspSolver, k: int) -> dict[str, np.ndarray]:
    angle = 2 * np.pi * k / _CYCLE
    return {
        name: (_MIDDLE + _SWING * np.sin(angle + _LAG * index)) * problem.rest_lengths
        * problem.finger.length
        for index, (name, problem) in enumerate(
            zip(solver.names, solver.hand.problems, strict=True)
        )
    }  # fmt: skip
