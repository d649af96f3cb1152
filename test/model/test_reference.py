# SPDX-License-Identifier: Apache-2.0
"""Poses, tensions and contact forces against an independent solution of the same rods."""

from __future__ import annotations

import numpy as np
import pytest

from ccr_ros.model import FingerSolver, Solution, SolverSettings

from .fingers import REFERENCES, reference, reference_finger, rms

# RMS over disk centres [of the length], tension, contact force; all relative.
DEFAULT = (SolverSettings(), 1e-3, 1e-2, 4e-2)
LINEAR_8 = (SolverSettings(arcs_per_segment=8), 5e-5, 1e-3, 3e-3)
CONSTANT_2 = (SolverSettings(arcs_per_segment=2, curvature_order=0), 1e-3, 1e-2, 4e-2)
CONSTANT_8 = (SolverSettings(arcs_per_segment=8, curvature_order=0), 5e-5, 1e-3, 3e-3)


def test_all_cases_are_there() -> None:
    assert len(REFERENCES) == 11


@pytest.mark.parametrize("name", REFERENCES)
@pytest.mark.parametrize(
    ("settings", "pose", "tension", "force"),
    [DEFAULT, LINEAR_8, CONSTANT_2, CONSTANT_8],
    ids=["default", "linear-8", "constant-2", "constant-8"],
)
def test_matches(
    name: str, settings: SolverSettings, pose: float, tension: float, force: float
) -> None:
    data = reference(name)
    solver = FingerSolver(reference_finger(data), settings)
    rest = np.array(data["rest_backbone"])
    assert rms(solver.rest.backbone, rest) < 1e-12
    for state in data["states"]:
        solution = solver.solve(np.array(state["pull"]) * solver.rest_lengths)
        check(solution, data, state, pose, tension, force)


def check(
    solution: Solution, data: dict, state: dict, pose: float, tension: float, force: float
) -> None:
    assert solution.certificate.converged
    assert solution.certificate.stable
    length = data["length"]
    assert rms(solution.backbone, np.array(state["backbone"])) < pose * length
    for i, points in enumerate(state["cables"]):
        # A hole is off by the centre's error and by the disk's small turn.
        assert rms(solution.cables[f"c{i}"], np.array(points)) < 2 * pose * length
    turn = np.array(state["frames"]).transpose(0, 2, 1) @ solution.frames
    angle = np.arccos(np.clip((np.trace(turn, axis1=1, axis2=2) - 1) / 2, -1, 1))
    assert angle.max() < 10 * pose
    assert solution.tensions == pytest.approx(state["tension_over_EI"], rel=tension)
    wanted = [(c["disk"], c["point"]) for c in data.get("contacts", [])]
    assert [(c.disk, c.point) for c in solution.contacts] == wanted
    forces = [c.force for c in solution.contacts]
    assert forces == pytest.approx(state["contact_over_EI"], rel=force)


def test_default_beats_two_constant_arcs() -> None:
    """One linear arc has as many unknowns as two constant ones, and a third of their error."""
    for name in ("general_1", "helical", "contact_sphere"):
        data = reference(name)
        finger, state = reference_finger(data), data["states"][-1]
        errors = []
        for settings, *_ in (DEFAULT, CONSTANT_2):
            solver = FingerSolver(finger, settings)
            solution = solver.solve(np.array(state["pull"]) * solver.rest_lengths)
            errors.append(rms(solution.backbone, np.array(state["backbone"])))
        assert errors[0] < errors[1] / 3
