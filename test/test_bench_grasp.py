# SPDX-License-Identifier: Apache-2.0
"""The benchmark of grasps: its baseline solves the same problem, rows tell what was measured."""

import numpy as np
import pytest

from benchmarks.coupled import CoupledIpopt
from benchmarks.grasping import BASELINE, PLAN, ball_path, ball_solver, grasps, measure_grasp
from ccr_ros.grasp.statics import GraspSolver, box_body
from ccr_ros.model import Pose, load_gripper
from ccr_ros.resources import find_config


@pytest.mark.long
def test_the_baseline_finds_the_same_poses():
    solver = ball_solver()
    peer = CoupledIpopt(solver)
    for pulls in ball_path(12)[::4]:
        assert peer.solve(list(pulls.values()))[0]
        found = solver.solve(pulls).require_converged()
        assert peer.centre == pytest.approx(found.body.pose.position, abs=1e-7)
    assert np.linalg.norm(peer.centre[:2]) > 1e-6  # out of the middle: pulls were unlike


def test_the_baseline_is_stated_for_a_ball_without_friction():
    with pytest.raises(ValueError, match="without friction"):
        CoupledIpopt(ball_solver(0.5))
    fingers = load_gripper(find_config("gripper_cube")).fingers
    body = box_body(np.full(3, 0.04), 0.01, Pose(np.array([0.0, 0.0, 0.170])))
    with pytest.raises(ValueError, match="a ball"):
        CoupledIpopt(GraspSolver(fingers, body))


@pytest.mark.parametrize("name", ["ccr_ros", "ccr_ros, friction"])
def test_a_row_tells_the_stream_of_solves(name):
    row = next(g for g in grasps(quick=True) if g.solver == name).row()
    measure_grasp(row, quick=True)
    assert (row.steps, row.converged, row.samples) == (30, 30, 30)
    assert row.p99_ms >= row.p50_ms > 0 and row.cpu_ms > 0 and 1 <= row.iterations <= 6
    assert row.baseline == BASELINE and row.id == f"grasp/ball/n9/{name}"


def test_a_plan_tells_what_a_degree_takes():
    plan = next(g for g in grasps(quick=False) if g.solver == PLAN)
    row = plan.row()
    measure_grasp(row, quick=True)
    assert row.steps == row.converged > 1
    assert "ms a degree of turn" in row.note and row.id == "grasp/turn/n9/ccr_ros, plan_move"
