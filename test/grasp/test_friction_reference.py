# SPDX-License-Identifier: Apache-2.0
"""A ball that three fingers carry, against an independent solution: stick, slip, reversal, heat."""

import json
from pathlib import Path

import numpy as np
import pytest
from friction_cases import about, around

from ccr_ros.grasp.statics import GraspSolver, sphere_body
from ccr_ros.model import MountedFinger, Pose, SolverSettings

PATH = Path(__file__).parents[1] / "data" / "reference_friction" / "ball.json"
STATES = json.loads(PATH.read_text())


def followed(settings, friction_step):
    """Solutions at the pulls of the reference."""
    fingers = around(3, 0.03)
    turned = Pose(fingers[0].base.position, about([0, 0, 1], np.pi + 0.25))
    fingers[0] = MountedFinger(fingers[0].finger, turned)
    ball = sphere_body(0.04, 0.006, Pose(np.array([0.0, 0.0, 0.1055])), 0.2)
    solver = GraspSolver(fingers, ball, settings, friction_step=friction_step)
    solver.solve({name: [0.001] for name in solver.names}).require_converged()
    solver.support(ball.pose)  # from here on friction begins anew
    solver.solve({}).require_converged()
    found = [solver.let_go().require_converged()]
    for state in STATES[1:]:
        pulls = {name: [pull] for name, pull in zip(solver.names, state["pulls"], strict=True)}
        found.append(solver.solve(pulls).require_converged())
    return found


@pytest.mark.parametrize(
    ("settings", "friction_step", "force", "way", "share"),
    [
        # the same arcs of constant curvature, small steps; what the package does by itself
        (
            SolverSettings(arcs_per_segment=2, curvature_order=0, time_limit=60.0),
            2e-4,
            4e-3,
            2.5e-5,
            0.02,
        ),
        (SolverSettings(time_limit=60.0), 1.25e-3, 1e-2, 4e-5, 0.045),
    ],
)
def test_a_ball_is_carried_as_the_reference_says(settings, friction_step, force, way, share):
    heat = 0.0
    for state, solution in zip(STATES, followed(settings, friction_step), strict=True):
        pose = solution.body.pose
        assert np.allclose(pose.position, state["centre"], rtol=0, atol=way)
        turn = 2 * np.arccos(min(1.0, abs(pose.orientation @ np.array(state["quaternion"]))))
        assert turn * 0.02 < way
        tensions = np.concatenate([finger.tensions for finger in solution.fingers])
        assert np.allclose(tensions, state["tensions"], rtol=force)
        assert solution.energy == pytest.approx(state["energy"], rel=force)
        heat += 0.0 if state is STATES[0] else solution.dissipated
        assert heat == pytest.approx(state["heat"], abs=share * STATES[-1]["heat"])
        for contact, wanted in zip(solution.contacts, state["contacts"], strict=True):
            assert (contact.finger, contact.disk) == (wanted["finger"], wanted["disk"])
            assert contact.status == wanted["status"]
            assert contact.force == pytest.approx(wanted["force"], rel=force)
            off = contact.friction_force - np.array(wanted["friction"])
            assert np.linalg.norm(off) < force * wanted["force"]
            assert np.allclose(contact.position, wanted["position"], rtol=0, atol=way)


def test_the_reference_has_all_that_friction_does():
    status = [[contact["status"] for contact in state["contacts"]] for state in STATES]
    assert status[0] == ["stick"] * 3
    assert any("slip" in s for s in status[1:3]) and any("slip" in s for s in status[3:])
    assert STATES[-1]["heat"] > STATES[2]["heat"] > STATES[0]["heat"] == 0.0
