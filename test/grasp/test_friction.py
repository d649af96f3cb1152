# SPDX-License-Identifier: Apache-2.0
"""Friction between fingers and object, on problems whose answers are known."""

import numpy as np
import pytest

from ccr_ros.grasp.statics import Body, GraspSolver
from ccr_ros.model import (
    Box,
    Cable,
    Finger,
    MountedFinger,
    Pose,
    SolverSettings,
)

G = 9.80665
LONG = SolverSettings(time_limit=60.0)


def finger(name, modulus=2.8e9, holes=(0.0,)):
    cables = [Cable(f"c{i}", [angle] * 7) for i, angle in enumerate(holes)]
    return Finger(
        name=name,
        length=0.12,
        segments=6,
        disk_radius=0.008,
        backbone_diameter=0.0025,
        poisson_ratio=0.39,
        youngs_modulus=modulus,
        cables=cables,
    )


def about(axis, angle):
    return np.append(np.sin(angle / 2) * np.asarray(axis, dtype=float), np.cos(angle / 2))


def pinch(friction=0.5, mass=0.0, pull=0.0008, turn=None):
    """Two fingers face to face, a cube between their tips."""
    turn = Pose() if turn is None else turn
    fingers = [
        MountedFinger(finger("left"), turn @ Pose(np.array([-0.03, 0.0, 0.0]))),
        MountedFinger(
            finger("right"),
            turn @ Pose(np.array([0.03, 0.0, 0.0]), np.array([0.0, 0.0, 1.0, 0.0])),
        ),
    ]
    shape = Box(np.zeros(3), np.full(3, 0.04), edge_radius=0.001)
    body = Body(shape, mass, turn @ Pose(np.array([0.0, 0.0, 0.118])), friction)
    gravity = turn.vectors(np.array([0.0, 0.0, -G]))
    solver = GraspSolver(fingers, body, LONG, gravity=gravity)
    solver.solve({"left": [pull], "right": [pull]}).require_converged()
    return solver


def test_a_pinch_carries_what_friction_gives_and_then_slips():
    solver = pinch(friction=0.5, mass=0.002)
    first = solver.let_go().require_converged()
    assert [c.status for c in first.contacts] == ["stick", "stick"]
    for contact in first.contacts:
        assert contact.friction_force[2] == pytest.approx(-first.body.mass * G / 2, abs=1e-9)
        assert abs(np.dot(contact.friction_force, contact.normal)) < 1e-9
    held = first
    for step in range(1, 200):
        solution = solver.solve({}, mass=0.002 + 0.0005 * step)
        if not solution.converged:
            break
        held = solution
    limit = sum(0.5 * c.force for c in held.contacts)
    assert held.body.mass * G <= limit + 1e-9
    assert (held.body.mass + 0.0005) * G > 0.999 * limit
    assert solver.body.mass == held.body.mass  # the last that was held
