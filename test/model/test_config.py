# SPDX-License-Identifier: Apache-2.0
"""The files in config/: the paper's cases, the reference's shapes, and the sphere gripper."""

import numpy as np
import pytest

from ccr_ros.model import Cylinder, FingerSolver, load_finger, load_gripper, solve
from ccr_ros.model.yaml_reader import read_mapping
from ccr_ros.resources import config_names, find_config

from .fingers import reference

# Table I: case -> (holes base to tip, pull in percent). General 1's tenth hole completes it.
TABLE_1 = {
    "straight": ([4] * 10, 5.0),
    "helical": ([7, 8, 9, 10, 11, 12, 1, 2, 3, 4], 4.0),
    "general_1": ([1, 12, 11, 10, 10, 10, 10, 11, 12, 1], 3.7),
    "general_2": ([1, 12, 11, 10, 9, 8, 7, 7, 7, 7], 3.3),
    "prebent_1_right": ([1] * 10, 2.4),
    "prebent_1_left": ([7] * 10, 2.4),
    "prebent_2_right": ([1] * 10, 2.4),
    "prebent_2_left": ([7] * 10, 2.4),
    "contact_cylinder": ([7] * 10, 2.0),
}
# Beside grippers' and servos' files.
FINGERS = sorted(n for n in config_names() if "segments" in read_mapping(find_config(n)))


def pulled(name, percent):
    finger = load_finger(find_config(name))
    solver = FingerSolver(finger)
    return solver.solve(percent / 100 * solver.rest_lengths)


def test_every_row_of_table_1_has_a_file():
    assert len(TABLE_1) == 9
    assert set(TABLE_1) < set(FINGERS)


@pytest.mark.parametrize("name", FINGERS)
def test_fingers_are_the_papers_prototypes(name):
    finger = load_finger(find_config(name))
    assert finger.name == name
    assert (finger.length, finger.segments, finger.disk_radius) == (0.182, 9, 0.008)
    assert (finger.backbone_diameter, finger.holes_per_disk) == (0.0025, 12)
    # ABS with a straight backbone, PLA pre-bent
    assert finger.poisson_ratio == (0.35 if finger.rest_curvature.any() else 0.39)
    assert finger.forces_are == "newton"


@pytest.mark.parametrize("name", TABLE_1)
def test_holes_are_table_1s(name):
    (cable,) = load_finger(find_config(name)).cables
    holes = np.array(TABLE_1[name][0])
    np.testing.assert_allclose(cable.angles, np.radians(30 * (holes - 1)), atol=1e-14)


@pytest.mark.parametrize("name", TABLE_1)
def test_table_1_solves(name):
    percent = TABLE_1[name][1]
    solution = pulled(name, percent)
    c = solution.certificate
    assert c.converged and c.stable and not c.branch_jump and c.message == ""
    assert solution.tensions[0] > 0
    if name != "contact_cylinder":
        assert solution.contacts == ()


@pytest.mark.parametrize("name", [*TABLE_1, "two_cables"])
def test_files_agree_with_the_reference(name):
    finger, data = load_finger(find_config(name)), reference(name)
    assert (finger.length, finger.segments) == (data["length"], data["segments"])
    assert (finger.disk_radius, finger.poisson_ratio) == (data["disk_radius"], data["poisson"])
    # The files give curvatures to 12 digits.
    np.testing.assert_allclose(finger.rest_curvature, data["rest_curvature"], atol=1e-10)
    assert len(finger.cables) == len(data["hole_angles"])
    for cable, angles in zip(finger.cables, data["hole_angles"], strict=True):
        turns = (cable.angles - angles) / (2 * np.pi)
        np.testing.assert_allclose(turns, np.round(turns), atol=1e-12)
    solution = solve(finger, np.array(data["states"][-1]["pull"]) * lengths(finger))
    error = solution.backbone - data["states"][-1]["backbone"]
    assert np.sqrt((error**2).sum(axis=1).mean()) < 1e-3 * finger.length
    tension = np.array(data["states"][-1]["tension_over_EI"]) * finger.bending_stiffness
    np.testing.assert_allclose(solution.tensions, tension, rtol=0.01)


def lengths(finger):
    return FingerSolver(finger).rest_lengths


def test_the_contact_experiment():
    finger = load_finger(find_config("contact_cylinder"))
    (rod,) = finger.obstacles
    assert isinstance(rod, Cylinder)
    # 30 mm in diameter, 16 mm to the left of (-x) and 136 mm above the base disk
    assert rod.radius == 0.015
    assert rod.point.tolist() == [-0.016, 0, 0.136] and abs(rod.axis[1]) == 1
    (contact,) = pulled("contact_cylinder", 2.0).contacts
    assert contact.disk == finger.segments - 2  # the third disk from the tip
    assert contact.obstacle == rod.name and contact.force > 0
    assert abs(np.hypot(*(contact.position - rod.point)[[0, 2]]) - 0.015) < 1e-9


def test_gripper_fingers_stand_evenly_around_the_axis_and_face_it():
    gripper = load_gripper(find_config("gripper_sphere"))
    assert len(gripper.fingers) == len(set(gripper.finger_names)) == 3
    bases = [f.base for f in gripper.fingers]
    for base in bases:
        assert base.position[2] == 0
        assert np.hypot(*base.position[:2]) == pytest.approx(0.042, abs=1e-10)
        toward_axis = -base.position / 0.042
        np.testing.assert_allclose(base.rotation[:, 0], toward_axis, atol=1e-9)
        np.testing.assert_allclose(base.rotation[:, 2], [0, 0, 1], atol=1e-9)
    for a, b in zip(bases, [*bases[1:], bases[0]], strict=True):
        cosine = a.position @ b.position / 0.042**2
        assert cosine == pytest.approx(np.cos(np.radians(120)), abs=1e-9)


def test_at_three_percent_the_gripper_lies_on_the_sphere():
    gripper = load_gripper(find_config("gripper_sphere"))
    center = np.array([0, 0, 0.110])
    for mounted in gripper.fingers:
        finger = mounted.finger
        solution = solve(finger, 0.03 * lengths(finger))
        assert solution.certificate.converged and solution.certificate.stable
        disks = mounted.base.points(solution.backbone)
        distances = np.linalg.norm(disks - center, axis=1)
        # The disks' rims touch: their centres are the sphere's radius and the disk's away.
        np.testing.assert_allclose(distances[5:], 0.056 + 0.008, atol=1e-8)
        # The sphere must fit between the fingers: no disk centre comes nearer than that.
        assert distances.min() > 0.056 + 0.008 - 1e-8
        # It is held: some disks touch below its equator, and some above.
        heights = disks[5:, 2] - center[2]
        assert heights.min() < -0.01 and heights.max() > 0.05


def test_an_unpulled_gripper_is_open():
    gripper = load_gripper(find_config("gripper_sphere"))
    mounted = gripper.fingers[0]
    rest = mounted.base.points(solve(mounted.finger, [0.0]).backbone)
    closed = mounted.base.points(solve(mounted.finger, 0.03 * lengths(mounted.finger)).backbone)
    assert np.hypot(*rest[-1][:2]) > np.hypot(*closed[-1][:2]) + 0.005
