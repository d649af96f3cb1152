# SPDX-License-Identifier: Apache-2.0
"""Designed grippers: the forward model lays fingers on the object, and bad geometry is told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ccr_ros.design.curve_text import SizedObject
from ccr_ros.design.gripper import GripperTask, NoRestShape, design_gripper, wanted_curve
from ccr_ros.design.gripper_layout import GripperLayout
from ccr_ros.design.pull import Pull
from ccr_ros.model import FingerSolver, InvalidValue, UnknownName, load_finger
from ccr_ros.resources import find_config

FINGER = load_finger(find_config("sphere_finger"))
BALL = SizedObject("sphere", (0.112,))
THREE_PERCENT = {"main": Pull(0.03, True)}


def task(body=BALL, height=0.110, radius=0.042, count=3, finger=FINGER, **values):
    values = {"pulls": THREE_PERCENT} | values
    return GripperTask(GripperLayout(body, height, radius, count), finger, **values)


@pytest.fixture(scope="module")
def paper():
    """The paper's section 4.1."""
    return design_gripper(task())


@pytest.fixture(scope="module")
def pressing():
    return design_gripper(task(press=0.8), "pressing")


def test_the_papers_sphere_is_reached_to_its_own_tolerance(paper):
    assert paper.reached
    for mounted, design in zip(paper.gripper.fingers, paper.fingers, strict=True):
        # Once more, with a solver of its own, and the object in the gripper's frame.
        solver = FingerSolver(mounted.finger)
        pose = solver.solve(0.03 * solver.rest_lengths)
        assert pose.certificate.converged and pose.certificate.stable
        assert design.shape.squared_error(pose.backbone) * 1e6 < 1e-10  # mm^2, the paper's e_d
        disks = mounted.base.points(pose.backbone)
        distances = np.linalg.norm(disks - [0, 0, 0.110], axis=1)
        on = slice(design.first_on_contour, None)
        assert np.allclose(distances[on], 0.056 + 0.008, atol=1e-8)
        assert distances.min() > 0.064 - 1e-6
        rims = mounted.base.points(pose.cables["main"])
        assert np.allclose(np.linalg.norm(rims - [0, 0, 0.110], axis=1)[on], 0.056, atol=1e-8)


def test_it_is_touched_on_both_sides_of_its_equator(paper):
    (design,) = {id(d): d for d in paper.fingers}.values()  # all three are one
    assert design.touching == tuple(range(design.first_on_contour, 10))
    heights = design.heights[list(design.touching)]
    assert heights[0] < -0.005 and heights[-1] > 0.05 and len(heights) >= 4
    assert np.abs(design.gaps[list(design.touching)]).max() < 1e-9
    assert not design.solution.contacts  # it touches, and does not press


def test_at_rest_it_is_open(paper):
    rest, closed = paper.fingers[0].rest.rest, paper.fingers[0].solution.backbone
    assert rest[-1, 0] < closed[-1, 0] - 0.005


def test_fingers_press_with_the_force_asked_for(pressing):
    assert pressing.reached and pressing.gripper.name == "pressing"
    design = pressing.fingers[0]
    contacts = design.solution.contacts
    assert [c.disk for c in contacts] == list(design.touching)
    assert all(c.point == "cable" for c in contacts)
    forces = [c.force for c in contacts]
    assert np.allclose(forces, 0.8 / len(forces), rtol=1e-5)
    center = np.array([0.042, 0, 0.110])
    for c in contacts:
        assert np.allclose(c.normal, (c.position - center) / 0.056, atol=1e-6)


@pytest.mark.parametrize(
    ("body", "count"),
    [
        (SizedObject("box", (0.06, 0.07, 0.14)), 4),
        (SizedObject("cylinder", (0.06, 0.14)), 3),
    ],
    ids=["box", "cylinder"],
)
def test_boxes_and_cylinders(body, count):
    design = design_gripper(task(body, 0.13, 0.045, count))
    assert design.reached
    kinds = {id(d): d for d in design.fingers}.values()
    assert len(kinds) == (2 if body.kind == "box" else 1)
    for kind in kinds:
        assert kind.path.squared_error * 1e6 < 1e-10
        heights = kind.heights[list(kind.touching)]
        assert len(heights) >= 2 and heights[0] < 0 < heights[-1]
    if body.kind == "box":
        # Seen from a finger's base, each stands off its own side.
        x, y = design.fingers[0], design.fingers[1]
        assert x.solution.backbone[-1, 0] == pytest.approx(0.045 - 0.03 - 0.008, abs=1e-6)
        assert y.solution.backbone[-1, 0] == pytest.approx(0.045 - 0.035 - 0.008, abs=1e-6)


def test_clearance_keeps_disks_off():
    design = design_gripper(task(count=2, clearance=0.002))
    finger = design.fingers[0]
    assert design.reached and finger.touching == ()
    assert np.allclose(finger.gaps[finger.first_on_contour :], 0.002, atol=1e-8)


def test_the_join_can_be_chosen():
    free, lead = wanted_curve(task(), task().layout.section(0))
    chosen, fixed = wanted_curve(task(join=-0.025), task().layout.section(0))
    assert fixed.join == -0.025 < lead.join
    assert chosen.points(0.18)[0] != pytest.approx(free.points(0.18)[0], abs=1e-5)


@pytest.mark.parametrize(
    ("values", "place", "words"),
    [
        ({"clearance": -0.001}, "clearance", ">= 0"),
        ({"press": -1.0}, "press", ">= 0"),
        ({"press": 1.0, "clearance": 0.001}, "clearance", "0 where fingers are to press"),
        ({"radius": 0.004, "count": 2}, "base_radius", "two bases are 8 mm apart"),
        ({"height": 0.2}, "length", "below and above the object's middle: with the gentlest lead"),
        ({"height": 0.2, "join": -0.01}, "length", "mm that lead to the contour"),
        ({"pulls": {"main": Pull(-0.05, True)}}, "pulls", "or the fingers would never open"),
        ({"body": SizedObject("sphere", (0.02,)), "join": 0.0}, "length", "behind the object"),
        (
            {"body": SizedObject("cylinder", (0.06, 0.1)), "height": 0.1},
            "length",
            "above the cylinder's top",
        ),
        ({"join": 0.2}, "join", "<= 0.089"),
        ({"height": 0.056, "radius": 0.02}, "base", "outside of the contour"),
        (
            {"finger": replace(FINGER, length=0.27, rest_curvature=None), "radius": 0.03},
            "fingers 1 and 2",
            "less than a disk is wide",
        ),
    ],
)
def test_refused(values, place, words):
    with pytest.raises(InvalidValue) as caught:
        design_gripper(task(**values))
    assert caught.value.place == place and words in str(caught.value)


def test_pulls_that_cannot_be():
    with pytest.raises(UnknownName, match="unknown cable 'thumb'"):
        design_gripper(task(pulls={"thumb": Pull(0.03, True)}))
    with pytest.raises(NoRestShape, match="no rest shape leads to the contour: ") as caught:
        design_gripper(task(pulls={"main": Pull(0.5, True)}))
    assert caught.value.reasons
