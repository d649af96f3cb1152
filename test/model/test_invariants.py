# SPDX-License-Identifier: Apache-2.0
"""What must hold of any pose: symmetry, similarity, energy, independence of path and of mesh."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ccr_ros.model import (
    Cable,
    Finger,
    FingerSolver,
    Pose,
    SolverSettings,
    Sphere,
    load_finger,
    solve,
)
from ccr_ros.resources import find_config

from .fingers import helical_cable, make_finger, rms, straight_cable

ANGLES = st.lists(st.floats(0, 2 * np.pi), min_size=10, max_size=10)
# Routings that wander by up to a quarter turn a disk, as a real cable would.
TURNS = st.lists(st.floats(-1.2, 1.2), min_size=9, max_size=9)


def wandering(turns: list[float], start: float, name: str = "w") -> Cable:
    return Cable(name, np.concatenate([[start], start + np.cumsum(turns)]))


def pose_of(finger: Finger, pull: float, **settings: object) -> np.ndarray:
    solution = solve(finger, [pull] * len(finger.cables), SolverSettings(time_limit=60, **settings))  # type: ignore[arg-type]
    assert solution.certificate.converged
    return solution.backbone


@given(turns=TURNS, start=st.floats(0, 6), turn=st.floats(-3, 3))
def test_turning_the_holes_turns_the_pose(turns: list[float], start: float, turn: float) -> None:
    """A rigid motion about the base axis: holes, rest shape and obstacle turned alike."""
    about_z = Pose(np.zeros(3), np.array([0, 0, np.sin(turn / 2), np.cos(turn / 2)]))
    rest = np.tile([2.0, -1.0, 0.5], (9, 1))
    ball = Sphere(np.array([0.03, 0.02, 0.15]), 0.02)
    finger = make_finger(wandering(turns, start), rest_curvature=rest, obstacles=(ball,))
    turned = replace(
        finger,
        cables=(wandering(turns, start + turn),),
        # The segments' frames turn with the base: curvature vectors turn about z.
        rest_curvature=about_z.vectors(rest),
        obstacles=(ball.moved(about_z),),
    )
    a, b = solve(finger, [0.005]), solve(turned, [0.005])
    assert a.certificate.converged == b.certificate.converged
    if a.certificate.converged and a.certificate.stable:
        assert b.backbone == pytest.approx(about_z.points(a.backbone), abs=1e-7)
        assert b.tensions == pytest.approx(a.tensions, rel=1e-5)


@given(turns=TURNS, start=st.floats(0, 6))
def test_mirror(turns: list[float], start: float) -> None:
    """Mirrored in the x-z plane, a routing gives the mirrored pose."""
    finger = make_finger(wandering(turns, start), rest_curvature=np.tile([1.0, 3.0, 0.4], (9, 1)))
    # A mirror in y turns an axial vector's x and z components about.
    mirrored = replace(
        finger,
        cables=(wandering([-t for t in turns], -start),),
        rest_curvature=np.tile([-1.0, 3.0, -0.4], (9, 1)),
    )
    a, b = pose_of(finger, 0.006), pose_of(mirrored, 0.006)
    assert b == pytest.approx(a * [1, -1, 1], abs=1e-8)


def test_planar_finger_stays_in_its_plane() -> None:
    backbone = pose_of(make_finger(straight_cable(1)), 0.008)
    assert np.abs(backbone[:, 1]).max() < 1e-12
    assert backbone[-1, 0] > 0.05  # towards the cable


def test_similarity() -> None:
    """Twice as large in everything: the pose twice as large, tension per EI a quarter."""
    small = make_finger(helical_cable())
    large = replace(small, length=0.364, disk_radius=0.016, backbone_diameter=0.005)
    a, b = solve(small, [0.006]), solve(large, [0.012])
    assert b.backbone == pytest.approx(2 * a.backbone, rel=1e-9, abs=1e-12)
    assert b.tensions == pytest.approx(a.tensions / 4, rel=1e-8)


def test_youngs_modulus_scales_forces_alone() -> None:
    plain = make_finger(helical_cable())
    stiff = replace(plain, youngs_modulus=2.8e9)
    a, b = solve(plain, [0.006]), solve(stiff, [0.006])
    ei = 2.8e9 * np.pi * 0.0025**4 / 64
    assert (a.finger.forces_are, b.finger.forces_are) == ("per_EI", "newton")
    assert b.backbone == pytest.approx(a.backbone, abs=1e-12)
    assert b.tensions == pytest.approx(a.tensions * ei, rel=1e-9)
    assert b.energy == pytest.approx(a.energy * ei, rel=1e-9)


def test_constant_bending_in_closed_form() -> None:
    """A straight cable bends a finger to an arc: the chord of each span gives the angle exactly.

    Span between disks at angle t: 2 (l0 / t - a) sin(t / 2); tension from dU/dt = T d(span)/dt.
    """
    finger = make_finger(straight_cable(1))
    solution = solve(finger, [0.008], SolverSettings(tolerance=1e-12))
    n, l0, a = 9, finger.segment_length, finger.disk_radius
    axes = solution.frames[:, :, 2]
    t = np.arccos(np.clip(np.sum(axes[1:] * axes[:-1], axis=1), -1, 1))
    assert t == pytest.approx(np.full(n, t[0]), rel=1e-6)
    span = 2 * (l0 / t[0] - a) * np.sin(t[0] / 2)
    assert n * span == pytest.approx(finger.length - 0.008, abs=1e-9)
    slope = -2 * l0 / t[0] ** 2 * np.sin(t[0] / 2) + (l0 / t[0] - a) * np.cos(t[0] / 2)
    assert solution.tensions[0] == pytest.approx(-t[0] / l0 / slope, rel=1e-6)


@pytest.mark.parametrize("name", ["helical", "general_1", "contact_cylinder", "prebent_2_left"])
def test_one_big_step_is_many_small_ones(name: str) -> None:
    finger = load_finger(find_config(name))
    pull = 0.02 * finger.length
    one, many = FingerSolver(finger), FingerSolver(finger)
    big = one.solve([pull])
    for k in range(1, 41):
        small = many.solve([pull * k / 40])
    round_trip = many.solve([0.0])
    assert small.backbone == pytest.approx(big.backbone, abs=1e-9)
    assert small.energy == pytest.approx(big.energy, rel=1e-8)
    assert round_trip.backbone == pytest.approx(one.rest.backbone, abs=1e-9)
    assert round_trip.energy < 1e-12


@pytest.mark.parametrize("order", [[0, 1], [1, 0]])
def test_order_of_pulling_two_cables_does_not_matter(order: list[int]) -> None:
    finger = make_finger(straight_cable(), helical_cable())
    solver, pulls = FingerSolver(finger), np.zeros(2)
    for cable in order:
        for pull in np.linspace(0, 0.004, 9):
            pulls[cable] = pull
            solution = solver.solve(pulls)
    direct = solve(finger, [0.004, 0.004])
    assert solution.backbone == pytest.approx(direct.backbone, abs=1e-9)


@given(turns=TURNS, start=st.floats(0, 6), pull=st.floats(0.001, 0.008))
def test_tension_is_the_slope_of_energy(turns: list[float], start: float, pull: float) -> None:
    """The cable's work is all that feeds the finger: dU/d(pull) = T."""
    solver = FingerSolver(make_finger(wandering(turns, start)), SolverSettings(tolerance=1e-11))
    step = 1e-5
    low, mid, high = (solver.solve([pull + d]) for d in (-step, 0.0, step))
    assert (high.energy - low.energy) / (2 * step) == pytest.approx(mid.tensions[0], rel=1e-5)


@given(a=st.floats(0.0005, 0.004), b=st.floats(0.0005, 0.004))
def test_work_around_a_loop_of_pulls_is_nothing(a: float, b: float) -> None:
    """Energy is a function of the pulls, not of the way there, with contact on part of the way."""
    ball = Sphere(np.array([-0.01, 0.045, 0.16]), 0.02)
    finger = make_finger(straight_cable(), helical_cable(), obstacles=(ball,))
    solver = FingerSolver(finger)
    loop = [(a, 0.0), (a, b), (0.0, b), (0.0, 0.0), (a, b)]
    poses = [solver.solve(p) for p in loop]
    if all(p.certificate.stable and not p.certificate.branch_jump for p in poses):
        assert poses[1].energy == pytest.approx(poses[4].energy, rel=1e-7)
        assert poses[3].energy < 1e-12


@pytest.mark.parametrize("order", [0, 1])
def test_finer_meshes_converge_at_their_order(order: int) -> None:
    """Constant arcs converge with the square of their length, linear ones with the fourth power."""
    finger = make_finger(helical_cable())
    fine = pose_of(finger, 0.0073, arcs_per_segment=16)
    errors = [
        rms(
            pose_of(finger, 0.0073, arcs_per_segment=k, curvature_order=order, tolerance=1e-11),
            fine,
        )
        for k in (1, 2, 4)
    ]
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(rates > (3.7 if order else 1.9))
