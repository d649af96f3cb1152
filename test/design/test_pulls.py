# SPDX-License-Identifier: Apache-2.0
"""Pulls for a target: reached where they can be, nearest elsewhere, least tension, limits kept."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from model.fingers import helical_cable, make_finger, straight_cable

from ccr_ros.design.pulls import PullPlanner, PullSolution
from ccr_ros.design.pulls_limits import PullLimits
from ccr_ros.design.pulls_targets import PointsTarget, PressTarget, TipTarget
from ccr_ros.model import (
    Finger,
    FingerSolver,
    InvalidValue,
    SolverSettings,
    Sphere,
    UnknownName,
    load_finger,
    solve,
)
from ccr_ros.resources import find_config

THREE = make_finger(*(straight_cable(hole, name=f"c{hole}") for hole in (1, 5, 9)))
FOUR = make_finger(*(straight_cable(hole, name=f"c{hole}") for hole in (1, 4, 7, 10)))
TWO = make_finger(straight_cable(), helical_cable())
PRESSING = load_finger(find_config("contact_cylinder"))


def check(found: PullSolution, finger: Finger) -> None:
    """What holds of every answer: it is an equilibrium, and the one that its pulls have."""
    assert found.solution.certificate.converged
    assert np.all(found.solution.tensions >= 0)
    assert found.solution.pulls == pytest.approx(found.pulls, abs=1e-12)
    assert not found.reached or found.optimal
    if found.direct:
        again = solve(finger, found.pulls)
        assert again.certificate.converged
        assert again.backbone == pytest.approx(found.solution.backbone, abs=1e-6)


@settings(max_examples=12)
@given(pulls=st.tuples(*[st.floats(0.0, 0.009)] * 2))
def test_tip_that_pulls_can_reach(pulls: tuple[float, float]) -> None:
    wanted = solve(TWO, pulls)
    found = PullPlanner(TWO).reach(TipTarget(wanted.backbone[-1]))
    check(found, TWO)
    assert found.reached and found.direct and not found.limits
    assert found.error.position is not None and found.error.position < 2e-7
    assert found.solution.backbone[-1] == pytest.approx(wanted.backbone[-1], abs=3e-7)


def test_full_pose_gives_the_pulls_back() -> None:
    pulls = [0.004, 0.006]
    wanted = solve(TWO, pulls)
    target = TipTarget(wanted.tip.position, wanted.tip.orientation)
    found = PullPlanner(TWO).reach(target)
    check(found, TWO)
    assert found.reached
    assert found.pulls == pytest.approx(pulls, abs=1e-6)
    assert found.error.rotation is not None and found.error.rotation < 1e-5


def test_points_along_the_backbone_give_the_pulls_back() -> None:
    pulls = [0.005, 0.003]
    wanted = solve(TWO, pulls)
    target = PointsTarget({disk: wanted.backbone[disk] for disk in range(1, 10)})
    found = PullPlanner(TWO).reach(target)
    check(found, TWO)
    assert found.reached
    assert found.pulls == pytest.approx(pulls, abs=1e-6)


def test_weights_choose_what_gives_way() -> None:
    wanted = solve(TWO, [0.004, 0.006])
    away = wanted.backbone[-1] + np.array([0.0, 0.0, 0.01])  # what no pulls reach

    def off(weights: tuple[float, float, float]) -> np.ndarray:
        found = PullPlanner(TWO).reach(TipTarget(away, position_weight=weights))
        check(found, TWO)
        return np.abs(found.solution.backbone[-1] - away)

    assert off((1, 1, 0))[:2].max() < 1e-6
    assert off((0, 0, 1))[2] < off((1, 1, 1))[2] < off((1, 1, 0))[2]


@pytest.mark.parametrize("finger", [THREE, FOUR], ids=["three", "four"])
@pytest.mark.parametrize("angle", [0.0, 0.9, 2.5, 4.4])
def test_redundant_cables_are_left_slack(finger: Finger, angle: float) -> None:
    """Of all tensions that hold the pose, the least sum of squares, found by brute force."""
    bend = 0.006 * np.cos(angle - np.array([c.angles[0] for c in finger.cables]))
    wanted = solve(finger, np.where(bend > 0, bend, -0.03)).backbone[-1]
    found = PullPlanner(finger).reach(TipTarget(wanted))
    check(found, finger)
    assert found.reached
    # Parallel cables bend as a moment: any tension common to all of a ring does nothing.
    rings = [[0, 1, 2]] if finger is THREE else [[0, 2], [1, 3]]
    for ring in rings:
        assert found.solution.tensions[ring].min() == pytest.approx(0.0, abs=1e-3)
    assert found.direct


def test_twins_do_not_confuse() -> None:
    """Two cables in the same holes: which of them carries is not determined, their sum is."""
    finger = make_finger(straight_cable(4, name="a"), straight_cable(4, name="b"))
    alone = solve(make_finger(straight_cable(4)), [0.005])
    found = PullPlanner(finger).reach(TipTarget(alone.backbone[-1]))
    check(found, finger)
    assert found.reached
    assert found.solution.tensions.sum() == pytest.approx(alone.tensions[0], rel=1e-4)


@pytest.mark.parametrize(
    ("target", "limits", "held"),
    [
        ([0.3, 0.1, 0.1], {}, ()),
        ([0.1, 0.0, 0.1], {"tension": {"c1": 300.0}}, ("tension of c1",)),
        ([0.1, 0.0, 0.1], {"high": [0.005] * 3}, ("largest pull of c1",)),
        ([0.05, 0.0, 0.16], {"low": {"c5": -0.001}}, ("least pull of c5",)),
    ],
)
def test_out_of_reach_gives_the_nearest(target, limits, held) -> None:
    limits = PullLimits.of(THREE, **limits)
    found = PullPlanner(THREE, limits).reach(TipTarget(target))
    check(found, THREE)
    assert not found.reached and found.optimal and found.offset < 1e-3
    assert "out of reach" in found.message
    assert set(held) <= set(found.limits)
    assert np.all(found.solution.tensions <= limits.tension * (1 + 2e-6))
    assert np.all(found.pulls >= limits.low - 1e-12) and np.all(found.pulls <= limits.high + 1e-12)
    # No neighbour within the limits is nearer.
    assert found.error.position is not None
    solver, taut = FingerSolver(THREE), found.solution.tensions > 0
    solver.solve(found.pulls)
    rng = np.random.default_rng(5)
    for _ in range(12):
        near = found.pulls + np.where(taut, 2e-4 * rng.normal(size=3), 0.0)
        other = solver.solve(np.clip(near, limits.low, limits.high))
        if other.certificate.converged and np.all(other.tensions <= limits.tension):
            gap = float(np.linalg.norm(other.backbone[-1] - target))
            assert gap > found.error.position - 1e-8


def test_a_saddle_of_the_error_is_left() -> None:
    """A point far down on the axis of a straight finger: the gradient of the error is 0 at rest."""
    found = PullPlanner(THREE).reach(TipTarget([0.0, 0.0, 0.02]))
    check(found, THREE)
    assert found.optimal and found.solution.tensions.max() > 0
    assert found.error.position is not None and found.error.position < 0.01  # 162 mm at rest


def test_warm_starts_and_unloading() -> None:
    planner = PullPlanner(THREE)
    first = planner.reach(TipTarget(solve(THREE, [0.006, -0.03, -0.03]).backbone[-1]))
    other = planner.reach(TipTarget(solve(THREE, [-0.03, 0.006, -0.03]).backbone[-1]))
    check(other, THREE)
    assert first.reached and other.reached
    assert (first.solution.tensions > 1).tolist() == [True, False, False]
    assert (other.solution.tensions > 1).tolist() == [False, True, False]
    again = planner.reach(TipTarget(other.solution.backbone[-1]))
    assert again.iterations == 0 and again.reached


def test_path_is_tracked() -> None:
    turns = np.linspace(0, 2 * np.pi, 40)
    path = [
        solve(TWO, [0.003 + 0.002 * np.cos(a), 0.003 + 0.002 * np.sin(a)]).backbone[-1]
        for a in turns
    ]
    planner = PullPlanner(TWO)
    found = list(planner.track(TipTarget(point) for point in path))
    assert all(f.reached for f in found)
    assert max(f.error.position for f in found) < 2e-7
    assert max(f.iterations for f in found[1:]) <= 4


@pytest.mark.parametrize("force", [0.05, 0.2, 1.0])
def test_disk_presses_with_the_force(force: float) -> None:
    planner = PullPlanner(PRESSING)
    found = planner.reach(PressTarget(7, "rod", force))
    check(found, PRESSING)
    assert found.reached
    (contact,) = found.solution.contacts
    assert (contact.disk, contact.obstacle) == (7, "rod")
    assert contact.force == pytest.approx(force, abs=1e-5)
    eased = planner.reach(PressTarget(7, "rod", force / 2))  # back from more
    assert eased.solution.contacts[0].force == pytest.approx(force / 2, abs=1e-5)


def test_more_force_than_the_finger_can_stand() -> None:
    """Beyond some force it slips off; the answer is the last pose before, and says so."""
    found = PullPlanner(PRESSING).reach(PressTarget(7, "rod", 3.0))
    check(found, PRESSING)
    assert not found.reached and "not" in found.message
    assert found.error.force is not None and found.error.force < -1.0


def test_pull_that_disks_bar() -> None:
    """One cable, a point on the other side of the base: disks meet before the tip is nearest."""
    finger = make_finger(straight_cable(1))
    found = PullPlanner(finger).reach(TipTarget([-0.02, 0.0, -0.05]))
    check(found, finger)
    assert not found.reached


def test_starts_from_the_pose_of_a_solver_and_leaves_it() -> None:
    solver = FingerSolver(TWO)
    stands = solver.solve([0.006, 0.001])
    solver.obstacles = (Sphere(np.array([0.2, 0.2, 0.1]), 0.01),)
    solver.solve([0.006, 0.001])
    planner = PullPlanner(solver)
    found = planner.reach(TipTarget(stands.backbone[-1]))
    assert found.reached and found.iterations == 0
    assert planner.solver.obstacles == solver.obstacles
    planner.reach(TipTarget(solve(TWO, [0.001, 0.006]).backbone[-1]))
    assert solver.solve([0.006, 0.001]).certificate.iterations == 0


def test_standing_of_another_finger_is_refused() -> None:
    planner = PullPlanner(TWO)
    for other in (FingerSolver(THREE), FingerSolver(TWO, SolverSettings(arcs_per_segment=2))):
        with pytest.raises(InvalidValue, match="standing"):
            planner.solver.resume(other.standing)


def test_steps_let_others_work_between() -> None:
    planner = PullPlanner(TWO)
    steps = planner.steps(TipTarget(solve(TWO, [0.004, 0.006]).backbone[-1]))
    count = 0
    with pytest.raises(StopIteration) as end:
        while True:
            next(steps)
            count += 1
    assert end.value.value.reached and count >= end.value.value.iterations


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda: TipTarget(), "tip"),
        (lambda: TipTarget([0, 0]), "tip.position"),
        (lambda: TipTarget([0, 0, float("nan")]), "tip.position"),
        (lambda: TipTarget(None, [0, 0, 0, 2]), "tip.orientation"),
        (lambda: TipTarget([0, 0, 0], position_weight=(0, 0, 0)), "position_weight"),
        (lambda: TipTarget([0, 0, 0], position_weight=(1, -1, 0)), "position_weight"),
        (lambda: TipTarget([0, 0, 0], rotation_weight=float("inf")), "rotation_weight"),
        (lambda: PointsTarget({}), "points"),
        (lambda: PointsTarget({0: [0, 0, 0]}), "points"),
        (lambda: PointsTarget({1: [0, 0]}), r"points\[1\]"),
        (lambda: PointsTarget({1: [0, 0, 0]}, {1: 0.0}), "weights"),
        (lambda: PointsTarget({1: [0, 0, 0]}, {2: 1.0}), "weights"),
        (lambda: PressTarget(0, "rod", 1.0), "press.disk"),
        (lambda: PressTarget(1, "rod", 0.0), "press.force"),
        (lambda: PressTarget(1, "rod", float("nan")), "press.force"),
        (lambda: PullLimits.of(TWO, tension=[1.0]), "limits.tension"),
        (lambda: PullLimits.of(TWO, tension={"helical": 0.0}), "limits.tension.helical"),
        (lambda: PullLimits.of(TWO, low={"helical": 0.1}), "limits.low.helical"),
        (lambda: PullLimits.of(TWO, high=[float("nan"), 1]), "limits.high.straight"),
        (lambda: PullLimits.of(TWO, high=["a", 1]), "limits.high.straight"),
        (lambda: PullLimits.of(TWO, high={"x": 1.0}), "x"),
        (lambda: PullPlanner(TWO, tolerance=0.5), "tolerance"),
        (lambda: PullPlanner(TWO, slack=-1.0), "slack"),
        (lambda: PullPlanner(TWO, max_iterations=0), "max_iterations"),
        (
            lambda: PullPlanner(TWO, settings=SolverSettings(cable_model="proportional")),
            "cable_model",
        ),
    ],
)
def test_bad_input_is_refused(make, word) -> None:
    with pytest.raises((InvalidValue, UnknownName), match=word):
        make()


@pytest.mark.parametrize(
    "target", [PointsTarget({10: [0, 0, 0]}), PressTarget(10, "rod", 1.0), PressTarget(7, "no", 1)]
)
def test_target_that_does_not_fit_moves_nothing(target) -> None:
    planner = PullPlanner(PRESSING)
    before = planner.solver.standing
    with pytest.raises((InvalidValue, UnknownName)):
        planner.reach(target)
    assert planner.solver.standing.point is before.point
