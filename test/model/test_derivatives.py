# SPDX-License-Identifier: Apache-2.0
"""Exact derivatives against finite differences, and the rod against its ODE."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from ccr_ros.model import Box, Cylinder, FingerSolver, SolverSettings, Sphere, load_finger
from ccr_ros.model.equilibrium import EquilibriumProblem
from ccr_ros.model.rod import Rod, centerline
from ccr_ros.model.rotation import cross, quaternion_from_matrix, skew
from ccr_ros.model.sensitivity import torsion_response
from ccr_ros.resources import find_config

from .fingers import helical_cable, make_finger, straight_cable

STEP = 1e-6


def difference(function, x: np.ndarray) -> np.ndarray:
    """Central differences, last axis over x."""
    columns = [
        (function(x + STEP * e) - function(x - STEP * e)) / (2 * STEP) for e in np.eye(len(x))
    ]
    return np.stack(columns, axis=-1)


@lru_cache
def problem(order: int, arcs: int) -> EquilibriumProblem:
    rng = np.random.default_rng(3)
    finger = make_finger(
        straight_cable(3, 6), helical_cable(),
        segments=9,
        rest_curvature=rng.normal(size=(9, 3)) * 4,
        obstacles=(
            Sphere(np.array([0.05, 0.01, 0.1]), 0.03),
            Box(np.array([0.0, 0.05, 0.1]), np.array([0.02, 0.03, 0.04])),
            Cylinder(np.array([0, -0.05, 0.1]), np.array([1, 0.2, 0.3]), 0.01),
        ),
    )  # fmt: skip
    return EquilibriumProblem(finger, SolverSettings(curvature_order=order, arcs_per_segment=arcs))


PAIRS = np.array([[0, 5], [1, 12], [2, 20], [0, 30]])
TENSIONS, FORCES = np.array([20.0, 9.0]), np.array([3.0, 4.0, 5.0, 1.0])


@pytest.mark.parametrize(("order", "arcs"), [(1, 1), (0, 2), (1, 2)])
@settings(max_examples=4)
@given(seed=st.integers(0, 10**6), size=st.floats(0.0, 0.6))
def test_first_derivatives(order: int, arcs: int, seed: int, size: float) -> None:
    p = problem(order, arcs)
    y = size * np.random.default_rng(seed).normal(size=p.size)
    at = p.evaluate(y)
    first = p.linearize(at)
    rows, _, _ = p.contact_rows(at, first, PAIRS)
    assert difference(lambda y: p.evaluate(y).points, y) == pytest.approx(first.points, abs=2e-8)
    assert difference(lambda y: p.evaluate(y).lengths, y) == pytest.approx(first.lengths, abs=2e-8)
    inside = difference(lambda y: -p.evaluate(y).distances[PAIRS[:, 0], PAIRS[:, 1]], y)
    assert inside == pytest.approx(rows, abs=1e-6)


@pytest.mark.parametrize(("order", "arcs"), [(1, 1), (0, 2)])
@settings(max_examples=4)
@given(seed=st.integers(0, 10**6), size=st.floats(0.0, 0.6))
def test_hessian_of_the_lagrangian(order: int, arcs: int, seed: int, size: float) -> None:
    p = problem(order, arcs)
    y = size * np.random.default_rng(seed).normal(size=p.size)

    def gradient(y: np.ndarray) -> np.ndarray:
        at = p.evaluate(y)
        first = p.linearize(at)
        rows, _, _ = p.contact_rows(at, first, PAIRS)
        return y + TENSIONS @ first.lengths + FORCES @ rows

    at = p.evaluate(y)
    first = p.linearize(at)
    _, normals, curvatures = p.contact_rows(at, first, PAIRS)
    hessian = p.hessian(at, first, TENSIONS, PAIRS, normals, curvatures, FORCES)
    assert hessian == pytest.approx(hessian.T, abs=1e-12)
    assert hessian == pytest.approx(difference(gradient, y), abs=1e-5)


@pytest.mark.parametrize("order", [0, 1])
def test_rod_follows_its_ode(order: int) -> None:
    """Frames and positions against integrating T' = T (e3, u)^ with the same curvature."""
    rng = np.random.default_rng(1)
    arcs = 4
    z = rng.normal(size=(arcs, 3 * (order + 1))) * 0.05
    a, b = z[:, :3] * arcs, (z[:, 3:] if order else np.zeros((arcs, 3))) * arcs
    state = np.concatenate([np.zeros(3), np.eye(3).ravel()])
    rod = Rod(arcs, order).state(z)
    for e in range(arcs):

        def slope(s: float, x: np.ndarray, e: int = e) -> np.ndarray:
            frame = x[3:].reshape(3, 3)
            u = a[e] + b[e] * (2 * arcs * s - 1)
            return np.concatenate([frame[:, 2], (frame @ skew(u)).ravel()])

        state = solve_ivp(slope, (0, 1 / arcs), state, rtol=1e-11, atol=1e-12).y[:, -1]
        tolerance = 1e-9 if order == 0 else 1e-4  # fourth-order Magnus, exact for constant arcs
        assert rod.positions[e + 1] == pytest.approx(state[:3], abs=tolerance)
        assert rod.rotations[e + 1] == pytest.approx(state[3:].reshape(3, 3), abs=tolerance)


@given(turn=st.floats(0, 3.1))
def test_rod_at_any_angle(turn: float) -> None:
    """One constant arc of any bend up to half a turn, from straight on, has the circle's end."""
    rod = Rod(1, 0).state(np.array([[0.0, turn, 0.0]]))
    half = turn / 2
    chord = np.sinc(half / np.pi)  # sin(half) / half
    assert rod.positions[1] == pytest.approx(
        chord * np.array([np.sin(half), 0, np.cos(half)]), abs=1e-9
    )
    assert rod.rotations[1][:, 2] == pytest.approx([np.sin(turn), 0, np.cos(turn)], abs=1e-9)


@pytest.mark.parametrize("order", [0, 1])
@given(seed=st.integers(0, 10**6))
def test_centerline_passes_through_the_disks(order: int, seed: int) -> None:
    z = np.random.default_rng(seed).normal(size=(5, 3 * (order + 1))) * 0.15
    rod = Rod(5, order).state(z)
    curve = centerline(5 * z.reshape(5, order + 1, 3), 1.0, 7)
    assert curve.shape == (36, 3)
    assert curve[::7] == pytest.approx(rod.positions, abs=1e-8)
    steps = np.linalg.norm(np.diff(curve, axis=0), axis=1)
    assert np.all(steps < 1 / 35 + 1e-3)


@pytest.mark.parametrize(
    ("name", "pulls"),
    [
        ("helical", [0.006]),
        ("two_cables", [0.004, 0.005]),
        ("contact_cylinder", [0.0036]),
        ("prebent_2_right", [0.004]),
    ],
)
@pytest.mark.parametrize("model", ["frictionless", "proportional"])
def test_sensitivities(name: str, pulls: list[float], model: str) -> None:
    settings = SolverSettings(tolerance=1e-12, cable_model=model)
    solver = FingerSolver(load_finger(find_config(name)), settings)
    middle = solver.solve(pulls)
    found = solver.sensitivity()
    step = 1e-6
    for j in range(len(pulls)):
        sides = []
        for sign in (1, -1):
            moved = np.array(pulls)
            moved[j] += sign * step
            sides.append(solver.solve(moved))
        high, low = sides
        disks = (high.backbone - low.backbone) / (2 * step)
        assert found.disks[:, :, j] == pytest.approx(disks, abs=2e-5)
        assert found.tip[:3, j] == pytest.approx(disks[-1], abs=2e-5)
        turn = (high.frames[-1] - low.frames[-1]) / (2 * step) @ middle.frames[-1].T
        spin = np.array([turn[2, 1], turn[0, 2], turn[1, 0]])
        assert found.tip[3:, j] == pytest.approx(spin, abs=1e-3)
        slope = (high.tensions - low.tensions) / (2 * step)
        assert found.tensions[:, j] == pytest.approx(slope, rel=1e-4, abs=1e-3)
        turns = (high.frames - low.frames) / (2 * step) @ middle.frames.transpose(0, 2, 1)
        spins = np.stack([turns[:, 2, 1], turns[:, 0, 2], turns[:, 1, 0]], axis=1)
        assert found.turns[:, :, j] == pytest.approx(spins, abs=1e-3)
        forces = [[c.force for c in side.contacts] for side in sides]
        slope = (np.array(forces[0]) - forces[1]) / (2 * step)
        assert found.contacts[:, j] == pytest.approx(slope, rel=1e-4, abs=1e-3)
    assert len(found.contacts) == len(middle.contacts)
    assert bool(middle.contacts) == (name == "contact_cylinder")


@pytest.mark.parametrize(("name", "pulls"), [("helical", [0.006]), ("two_cables", [0.004, 0.005])])
def test_response_to_poissons_ratio(name: str, pulls: list[float]) -> None:
    finger = load_finger(find_config(name))
    settings = SolverSettings(tolerance=1e-12)
    solver = FingerSolver(finger, settings)
    solver.solve(pulls)
    disks, tensions = torsion_response(solver.problem, solver.point)
    step = 1e-5
    high, low = (
        FingerSolver(replace(finger, poisson_ratio=finger.poisson_ratio + h), settings).solve(pulls)
        for h in (step, -step)
    )
    assert disks == pytest.approx((high.backbone - low.backbone) / (2 * step), abs=1e-8)
    assert np.abs(disks).max() > 1e-4
    assert tensions == pytest.approx((high.tensions - low.tensions) / (2 * step), rel=1e-5)


def test_sensitivity_of_a_slack_cable_is_nothing() -> None:
    solver = FingerSolver(make_finger(straight_cable(4), straight_cable(10, name="far")))
    solution = solver.solve([0.005, -0.02])
    assert solution.slack.tolist() == [False, True]
    assert np.all(solver.sensitivity().disks[:, :, 1] == 0)


@given(seed=st.integers(0, 10**6))
def test_cross_is_numpys(seed: int) -> None:
    a, b = np.random.default_rng(seed).normal(size=(2, 4, 3))
    assert cross(a, b) == pytest.approx(np.cross(a, b))
    assert quaternion_from_matrix(np.eye(3)) == pytest.approx([0, 0, 0, 1])
