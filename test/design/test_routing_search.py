# SPDX-License-Identifier: Apache-2.0
"""The parts of the search for routings, against the forward model and finite differences."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from model.fingers import make_finger

from ccr_ros.design import routing_free
from ccr_ros.design.routing_chain import Chain, Target, extended, laid
from ccr_ros.design.routing_forecast import Forecast
from ccr_ros.design.routing_search import RoutingSearch
from ccr_ros.design.routing_table import SegmentTable
from ccr_ros.design.routing_tensions import bending_energy, likely_tensions
from ccr_ros.design.segments import SegmentModel
from ccr_ros.model import Cable, FingerSolver

HOLES = 2 * np.pi * np.arange(12) / 12
LENGTH = 0.182


def choices(cables: int) -> np.ndarray:
    return np.array(list(product(range(12), repeat=cables)))


def posed(cables: int, seed: int = 0, kind: str = "frames"):
    """A finger pulled through random holes: its model, states, tensions and its pose as target."""
    rng = np.random.default_rng(seed)
    holes = rng.integers(0, 12, (cables, 10))
    finger = make_finger(
        *(Cable(f"c{i}", HOLES[h]) for i, h in enumerate(holes)),
        rest_curvature=rng.normal(size=(9, 3)) * 2,
    )
    solver = FingerSolver(finger)
    part = np.array([0.012, 0.009])[:cables]
    solution = solver.solve(part * solver.rest_lengths).require_converged()
    assert not solution.slack.any()
    target = Target(
        solution.backbone / LENGTH,
        solution.frames if kind == "frames" else None,
        solution.frames[:, :, 2] if kind == "tangents" else None,
        1 / 9,
        part,
        np.zeros(cables),
    )
    states = np.array([[int(s) for s in 12 ** np.arange(cables)[::-1] @ holes]])
    return SegmentModel(finger), states, solution.tensions * LENGTH**2, target, solution


@pytest.mark.parametrize("cables", [1, 2])
@pytest.mark.parametrize("kind", ["frames", "tangents", "centres"])
def test_a_laid_routing_is_the_forward_models_pose(cables, kind):
    model, states, tensions, target, solution = posed(cables, kind=kind)
    table = SegmentTable(model, HOLES[choices(cables)], tensions)
    chain = laid(states, table, target)
    assert chain.position[0] * LENGTH == pytest.approx(solution.backbone[-1], abs=1e-8)
    assert chain.rotation[0] == pytest.approx(solution.frames[-1], abs=1e-6)
    change, cost = chain.settled(target)
    assert np.abs(change / tensions).max() < 1e-6 and abs(cost[0]) < 1e-12


@pytest.mark.parametrize("cables", [1, 2])
@pytest.mark.parametrize("kind", ["frames", "tangents", "centres"])
def test_errors_are_quadratic_in_a_change_of_tension(cables, kind):
    """From a table made for other tensions: to second order in the change."""
    model, states, tensions, target, _ = posed(cables, kind=kind)
    left = []
    for change in (0.04, 0.02):
        table = SegmentTable(model, HOLES[choices(cables)], tensions * (1 + change))
        chain = laid(states, table, target)
        found, cost = chain.settled(target)
        assert found[0] == pytest.approx(-change * tensions, rel=0.05)
        assert cost[0] < 0.05 * chain.ee[0]
        assert chain.costs(1e-20 * np.eye(cables))[0] <= cost[0] * (1 + 1e-9)
        left.append(np.sqrt(cost[0]))
    assert left[1] < 0.3 * left[0]  # a fourth, were it exact


def test_two_cables_through_the_same_holes_share_their_tension():
    model, _, tensions, target, _ = posed(2)
    table = SegmentTable(model, HOLES[choices(2)], np.full(2, tensions.mean()))
    same = laid(np.full((1, 10), 13 * 5), table, replace(target, fractions=np.full(2, 0.01)))
    change, _ = same.settled(replace(target, fractions=np.full(2, 0.01)))
    assert np.isfinite(change).all() and change[0, 0] == pytest.approx(change[0, 1], rel=1e-3)


def test_a_table_solves_each_pair_once_and_forgets_none():
    model, _, tensions, _, _ = posed(1)
    table = SegmentTable(model, HOLES[:, None], tensions)
    first = table.pieces(3, np.array([1, 2, 1]), np.array([5, 5, 5]))
    again = table.pieces(3, np.array([2]), np.array([5]))
    assert np.array_equal(first.rotation[0], first.rotation[2])
    assert np.array_equal(first.rotation[1], again.rotation[0])
    assert not np.array_equal(
        first.rotation[0], table.pieces(4, np.array([1]), np.array([5])).rotation[0]
    )


def test_beyond_reason_a_table_has_no_segments():
    model, _, _, target, _ = posed(1)
    table = SegmentTable(model, HOLES[:, None], np.array([1e9]))
    chain = laid(np.zeros((1, 10), dtype=int), table, target)
    assert not np.isfinite(chain.ee).any()


@pytest.mark.parametrize("cables", [1, 2])
@pytest.mark.parametrize("kind", ["frames", "tangents", "centres"])
def test_a_forecast_is_right_to_first_order(cables, kind):
    """At small tensions it is what laying the routings exactly gives."""
    model, states, tensions, target, _ = posed(cables, kind=kind)
    weak = 0.01 * tensions
    table = SegmentTable(model, HOLES[choices(cables)], weak)
    forecast = Forecast(model, HOLES, target)
    prior = 1e-3 * np.eye(cables)
    chain = Chain.at_base(states[:, 0], cables)
    chain = extended(chain, np.zeros(1, dtype=int), states[:, 1], table, target)
    guess = forecast.costs(chain, choices(cables)[chain.states[:, -1]], weak, prior)
    assert guess.shape == (1,) + (12,) * cables
    every = np.arange(12**cables)
    exact = extended(chain, np.zeros(len(every), dtype=int), every, table, target).costs(prior)
    assert guess.ravel() == pytest.approx(exact, rel=0.02, abs=1e-7)
    assert guess.min() < guess.max()


def test_bending_energy_of_an_arc_is_that_of_its_curvature():
    angle, n = np.radians(50), 50
    s = np.linspace(0, 1, n + 1) * angle
    arc = np.stack([(1 - np.cos(s)) / angle, 0 * s, np.sin(s) / angle], axis=1)
    straight = np.linspace([0, 0, 0], [0, 0, 1.0], n + 1)
    assert bending_energy(arc, straight) == pytest.approx(0.5 * angle**2, rel=0.02)
    assert bending_energy(arc, arc) == pytest.approx(0, abs=1e-20)
    turned = arc @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1.0]])
    assert bending_energy(turned, straight) == pytest.approx(bending_energy(arc, straight))


@pytest.mark.parametrize("seed", range(8))
def test_some_tension_that_is_tried_is_near_the_true_one(seed):
    model, _, tensions, target, _ = posed(1, seed)
    tried = np.array(likely_tensions(model, target, small=False))
    assert np.abs(np.log(tried / tensions)).min() < 0.15


@pytest.mark.parametrize("most", [0, 1, 3, None])
def test_a_search_keeps_to_the_largest_change(most):
    model, _, _, target, _ = posed(1, kind="centres")
    found = RoutingSearch(model, HOLES, target, 32, most).run()
    costs = [f.cost for f in found]
    assert costs == sorted(costs) and len({f.states for f in found}) == len(found)
    change = np.abs(np.diff([f.states for f in found], axis=1))
    assert np.minimum(change, 12 - change).max() <= (12 if most is None else most)


@pytest.mark.parametrize("cables", [1, 2])
@pytest.mark.parametrize("kind", ["frames", "tangents", "centres"])
def test_the_jacobian_in_the_hole_angles_is_that_of_finite_differences(cables, kind):
    model, states, tensions, target, _ = posed(cables, kind=kind)
    angles = HOLES[choices(cables)[states[0]]]
    step = 1e-6

    def at(angles):
        here = routing_free.balanced(model, target, angles, tensions)
        assert here is not None
        return routing_free._linearized(model, target, here)

    error, jacobian = at(angles)
    assert np.abs(error).max() < 1e-6
    for column, unit in enumerate(np.eye(angles.size)):
        turn = step * unit.reshape(angles.shape)
        slope = (at(angles + turn)[0] - at(angles - turn)[0]) / (2 * step)
        assert slope == pytest.approx(jacobian[:, column], abs=1e-7)


def test_no_equilibrium_to_begin_at_gives_no_fit():
    model, _, tensions, target, _ = posed(1)
    beyond = replace(target, fractions=np.array([1.1]))
    assert routing_free.fitted(model, beyond, np.zeros((10, 1)), tensions) is None
