# SPDX-License-Identifier: Apache-2.0
"""Forces and moments balance at every disk, checked by code that shares nothing with the solver.

Cut the finger just above a disk. All that acts on the part beyond the cut (cables that cross it,
contacts beyond it) is what the backbone must carry there: its internal force and moment. A
Kirchhoff rod that starts in the disk's frame with these, integrated by SciPy, must land on the
next disk. The gap, as the moment that would close it, is what is out of balance.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from ccr_ros.model import Finger, FingerSolver, Solution, SolverSettings, Sphere, load_finger
from ccr_ros.resources import find_config

from .fingers import helical_cable, make_finger, straight_cable


def stiffness(finger: Finger) -> np.ndarray:
    """Bending, bending and torsion stiffness, from the material's own formulas."""
    if finger.youngs_modulus is None:
        ei = 1.0
    else:
        ei = finger.youngs_modulus * np.pi * (finger.backbone_diameter / 2) ** 4 / 4
    return np.array([ei, ei, ei / (1 + finger.poisson_ratio)])


def carried(solution: Solution, disk: int) -> tuple[np.ndarray, np.ndarray]:
    """Force, and moment about the disk's centre, of all that acts beyond a cut above the disk."""
    centre = solution.backbone[disk]
    force, moment = np.zeros(3), np.zeros(3)
    for j, cable in enumerate(solution.finger.cables):
        points = solution.cables[cable.name]
        if disk + 1 < len(points):
            way = points[disk] - points[disk + 1]
            pull = solution.tensions[j] * way / np.linalg.norm(way)
            force += pull
            moment += np.cross(points[disk + 1] - centre, pull)
    for contact in solution.contacts:
        if contact.disk > disk:
            push = contact.force * contact.normal
            force += push
            moment += np.cross(contact.position - centre, push)
    return force, moment


def landed(solution: Solution, disk: int) -> tuple[np.ndarray, np.ndarray]:
    """Where a rod that starts at the disk and carries what it must has the next disk."""
    finger = solution.finger
    assert finger.rest_curvature is not None
    force, moment = carried(solution, disk)
    k, rest = stiffness(finger), finger.rest_curvature[disk]

    def slope(_: float, state: np.ndarray) -> np.ndarray:
        frame, bending = state[3:12].reshape(3, 3), state[12:]
        u = rest + (frame.T @ bending) / k
        spin = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
        return np.concatenate([frame[:, 2], (frame @ spin).ravel(), -np.cross(frame[:, 2], force)])

    start = np.concatenate([solution.backbone[disk], solution.frames[disk].ravel(), moment])
    end = solve_ivp(slope, (0, finger.segment_length), start, rtol=1e-10, atol=1e-12).y[:, -1]
    return end[:3], end[3:12].reshape(3, 3)


def imbalance(solution: Solution) -> float:
    """Largest moment that would be needed to close the gap at a disk."""
    finger = solution.finger
    worst = 0.0
    for disk in range(finger.segments):
        position, frame = landed(solution, disk)
        turn = Rotation.from_matrix(solution.frames[disk + 1].T @ frame).magnitude()
        shift = (
            float(np.linalg.norm(position - solution.backbone[disk + 1])) / finger.segment_length
        )
        worst = max(worst, turn + shift)
    return worst * stiffness(finger)[0] / finger.segment_length


def cases() -> list[tuple[str, Finger, list[float]]]:
    rng = np.random.default_rng(7)
    ball = Sphere(np.array([-0.01, 0.055, 0.15]), 0.02)
    return [
        ("straight", load_finger(find_config("straight")), [0.009]),
        ("helical", load_finger(find_config("helical")), [0.0073]),
        ("cylinder", load_finger(find_config("contact_cylinder")), [0.0036]),
        ("two cables", make_finger(straight_cable(), helical_cable()), [0.004, 0.005]),
        (
            "one slack",
            make_finger(straight_cable(), straight_cable(10, name="other")),
            [0.006, -0.02],
        ),
        ("short cable", make_finger(straight_cable(), straight_cable(8, 6, "low")), [0.004, 0.002]),
        ("ball", make_finger(helical_cable(), straight_cable(), obstacles=(ball,)), [0.004, 0.009]),
        ("pre-bent", make_finger(rest_curvature=rng.normal(size=(9, 3)) * [4, 4, 2]), [0.006]),
    ]


@pytest.mark.parametrize(("name", "finger", "pulls"), cases(), ids=[c[0] for c in cases()])
def test_every_disk_is_in_balance(name: str, finger: Finger, pulls: list[float]) -> None:
    solution = FingerSolver(finger, SolverSettings(arcs_per_segment=6)).solve(pulls)
    assert solution.certificate.converged
    assert bool(solution.contacts) == (name in ("cylinder", "ball"))
    # Relative to the moment of the largest tension about the backbone.
    assert imbalance(solution) < 1e-3 * solution.tensions.max() * finger.disk_radius


def test_the_check_sees_a_wrong_tension() -> None:
    """The balance is lost when the tension is off by one percent: the check can fail."""
    finger = load_finger(find_config("helical"))
    solution = FingerSolver(finger, SolverSettings(arcs_per_segment=6)).solve([0.0073])
    wrong = replace(solution, tensions=solution.tensions * 1.01)
    assert imbalance(wrong) > 5e-3 * solution.tensions[0] * finger.disk_radius


def test_the_check_sees_a_wrong_contact_force() -> None:
    finger = load_finger(find_config("contact_cylinder"))
    solution = FingerSolver(finger, SolverSettings(arcs_per_segment=6)).solve([0.0036])
    (contact,) = solution.contacts
    wrong = replace(solution, contacts=(replace(contact, force=1.05 * contact.force),))
    assert imbalance(wrong) > 5e-3 * solution.tensions[0] * finger.disk_radius
