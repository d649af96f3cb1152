# SPDX-License-Identifier: Apache-2.0
"""Residuals of targets, tensions and lengths: exact derivatives against finite differences."""

from __future__ import annotations

import numpy as np
import pytest
from model.fingers import helical_cable, make_finger, straight_cable

from ccr_ros.design.pulls_limits import PullLimits
from ccr_ros.design.pulls_step import PullModel
from ccr_ros.design.pulls_targets import PointsTarget, PressTarget, Target, TipTarget
from ccr_ros.model import Finger, FingerSolver, Pose, SolverSettings, load_finger
from ccr_ros.resources import find_config

TURN = Pose([0, 0, 0], [0.3, 0.5, -0.2, np.sqrt(1 - 0.38)]).orientation
PRESSING = load_finger(find_config("contact_cylinder"))
TWO = make_finger(straight_cable(), helical_cable())
PAIR = make_finger(straight_cable(4, name="near"), helical_cable(), straight_cable(8, name="far"))

CASES = [
    (TWO, [0.004, 0.005], TipTarget([0.01, 0.02, 0.15])),
    (TWO, [0.004, 0.005], TipTarget([0.01, 0.02, 0.15], TURN, (1, 0.5, 2), 0.02)),
    (TWO, [0.004, 0.005], TipTarget(None, TURN, rotation_weight=(0.1, 0.2, 0.0))),
    (TWO, [0.004, 0.005], PointsTarget({3: [0.01, 0, 0.1], 9: [0, 0, 0.2]}, {3: 0.5})),
    (PRESSING, [0.0035], PressTarget(7, "rod", 0.3)),  # in contact
    (PRESSING, [0.0010], PressTarget(7, "rod", 0.3)),  # before it
    (PAIR, [0.005, 0.002, -0.02], TipTarget([0.01, 0.02, 0.15], TURN)),  # the last one slack
]


def model(solver: FingerSolver, pulls: np.ndarray, target: Target) -> PullModel:
    assert solver.move(pulls).converged
    return PullModel(solver.problem, solver.point, target, PullLimits.of(solver.finger))


@pytest.mark.parametrize(("finger", "pulls", "target"), CASES)
def test_residual_tensions_and_lengths(finger: Finger, pulls: list[float], target: Target) -> None:
    solver = FingerSolver(finger, SolverSettings(tolerance=1e-12))
    middle = model(solver, np.array(pulls), target)
    step = 1e-6
    for cable in np.flatnonzero(middle.taut):
        sides = []
        for sign in (1, -1):
            moved = np.array(pulls)
            moved[cable] += sign * step
            sides.append(model(solver, moved, target))
        high, low = sides
        per = 2 * step / finger.length
        assert middle.jacobian[:, cable] == pytest.approx(
            (high.residual - low.residual) / per, abs=2e-4
        )
        change = np.zeros(len(pulls))
        change[cable] = 1e-3
        ahead = middle._ended(change, 0.0, 0.0, 0.0)
        assert (ahead.tensions - middle.tensions) / 1e-3 == pytest.approx(
            (high.tensions - low.tensions) / per, rel=1e-4, abs=1e-2
        )
        assert (ahead.lengths - middle.lengths) / 1e-3 == pytest.approx(
            (high.lengths - low.lengths) / per, abs=1e-4
        )


def test_response_to_the_tension_of_a_slack_cable() -> None:
    """From where the cable is just taut, a little more pull gives tension and motion at this rate.

    One-sided differences: on the other side nothing moves.
    """
    target = TipTarget([0.01, 0.02, 0.15], TURN)
    solver = FingerSolver(PAIR, SolverSettings(tolerance=1e-12))
    middle = model(solver, np.array([0.005, 0.002, -0.02]), target)
    assert middle.taut.tolist() == [True, True, False]
    just = np.array([0.005, 0.002, middle.lengths[2] * PAIR.length])
    more = model(solver, just + np.array([0, 0, 1e-7]), target)
    tension = more.tensions[2]
    assert tension > 0
    assert middle.jacobian[:, 2] == pytest.approx(
        (more.residual - middle.residual) / tension, rel=2e-3, abs=1e-7
    )
    change = np.array([0.0, 0.0, tension])
    ahead = middle._ended(change, 0.0, 0.0, 0.0)
    assert ahead.tensions == pytest.approx(more.tensions, rel=1e-3)
    assert ahead.lengths == pytest.approx(more.lengths, abs=1e-8)


def test_errors_in_the_units_of_people() -> None:
    solver = FingerSolver(TWO)
    solution = solver.solve([0.004, 0.005])
    tip, turn = solution.backbone[-1], solution.tip.orientation
    off = TipTarget(tip + np.array([0.003, 0, 0.004]), turn).error(solver.problem, solver.point)
    assert off.position == pytest.approx(0.005) and off.rotation == pytest.approx(0, abs=1e-6)
    assert off.text().startswith("5 mm")
    half = Pose(np.zeros(3), [0, 0, np.sin(0.25), np.cos(0.25)])  # 0.5 rad about z
    wanted = (solution.tip @ half).orientation
    assert TipTarget(None, wanted).error(solver.problem, solver.point).rotation == pytest.approx(
        0.5
    )
    points = PointsTarget({4: solution.backbone[4], 9: tip + np.array([0, 0.001, 0])})
    assert points.error(solver.problem, solver.point).position == pytest.approx(0.001)


def test_error_of_a_press() -> None:
    solver = FingerSolver(PRESSING)
    force = solver.solve([0.0035]).contacts[0].force
    error = PressTarget(7, "rod", 0.3).error(solver.problem, solver.point)
    assert error.force == pytest.approx(force - 0.3) and error.gap == 0.0
    away = solver.solve([0.0])
    error = PressTarget(7, "rod", 0.3).error(solver.problem, solver.point)
    rod = PRESSING.obstacles[0]
    points = np.stack([away.backbone[7], away.cables["main"][7], away.antagonists["main"][7]])
    assert error.force == -0.3 and error.gap == pytest.approx(rod.signed_distance(points).min())
