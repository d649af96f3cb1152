# SPDX-License-Identifier: Apache-2.0
"""Where fingers stand around an object, and what cannot be."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from model.fingers import helical_cable, make_finger, straight_cable

from ccr_ros.design.curve_text import SizedObject
from ccr_ros.design.gripper_layout import (
    GripperLayout,
    check_above_bases,
    check_apart,
    check_facing,
)
from ccr_ros.design.section import Section
from ccr_ros.model import Box, Cylinder, InvalidValue, Sphere, load_gripper
from ccr_ros.resources import find_config

BALL = SizedObject("sphere", (0.112,))
TIN = SizedObject("cylinder", (0.06, 0.12))
CRATE = SizedObject("box", (0.05, 0.08, 0.12))


def facing(base):
    return base.rotation[:, 0]


@pytest.mark.parametrize("count", [2, 3, 5, 12])
@pytest.mark.parametrize("body", [BALL, TIN])
def test_round_objects_are_surrounded_evenly(body, count):
    layout = GripperLayout(body, 0.11, 0.042, count)
    bases = layout.bases
    for base in bases:
        assert np.linalg.norm(base.position) == pytest.approx(0.042) and base.position[2] == 0
        assert np.allclose(facing(base), -base.position / 0.042, atol=1e-9)
        assert np.allclose(base.rotation[:, 2], [0, 0, 1])
    turn = 2 * math.pi / count
    for a, b in pairwise([*bases, bases[0]]):
        assert a.position @ b.position / 0.042**2 == pytest.approx(math.cos(turn), abs=1e-9)
    assert len({layout.section(i) for i in range(count)}) == 1


def test_the_papers_gripper_stands_as_in_its_file():
    layout = GripperLayout(BALL, 0.110, 0.042, 3)
    for base, mounted in zip(
        layout.bases, load_gripper(find_config("gripper_sphere")).fingers, strict=True
    ):
        assert np.allclose(base.position, mounted.base.position, atol=1e-9)
        assert np.allclose(base.rotation, mounted.base.rotation, atol=1e-9)
    assert layout.section(1) == Section.circle(0.056, 0.042, 0.110)


@pytest.mark.parametrize("count", [2, 3, 4])
def test_fingers_face_the_sides_of_a_box_squarely(count):
    layout = GripperLayout(CRATE, 0.11, 0.045, count)
    box = layout.obstacle()
    sides = []
    for i, base in enumerate(layout.bases):
        way = np.round(facing(base), 9)
        assert np.abs(way).max() == 1
        axis = int(np.argmax(np.abs(way)))
        assert base.position @ way == pytest.approx(-0.045)
        # straight ahead of the base, at the middle's height, is the side that its section has
        section = layout.section(i)
        ahead = base.points(np.array([[section.forward - section.half_width, 0, 0.11]]))
        assert box.signed_distance(ahead)[0] == pytest.approx(0, abs=1e-12)
        assert section.half_width == CRATE.size[axis] / 2
        sides.append(tuple(way[:2]))
    assert len(set(sides)) == min(count, 4) - (count == 3)
    if count == 3:  # two beside each other, half of the side apart
        apart = layout.bases[1].position - layout.bases[2].position
        assert np.allclose(np.abs(apart), [0, 0.04, 0])


def test_objects_as_obstacles():
    ball = GripperLayout(BALL, 0.11, 0.042, 3).obstacle()
    assert isinstance(ball, Sphere) and ball.radius == 0.056 and ball.center[2] == 0.11
    tin = GripperLayout(TIN, 0.11, 0.042, 3).obstacle()
    assert isinstance(tin, Cylinder) and tin.radius == 0.03 and tin.axis.tolist() == [0, 0, 1]
    box = GripperLayout(CRATE, 0.11, 0.042, 2).obstacle()
    assert isinstance(box, Box) and box.size.tolist() == [0.05, 0.08, 0.12]
    assert box.edge_radius == CRATE.corner_radius == 0.001


@pytest.mark.parametrize(
    ("values", "place", "words"),
    [
        ((BALL, 0.05, 0.042, 3), "center_height", "it reaches 6 mm below the base plane"),
        ((BALL, math.nan, 0.042, 3), "center_height", "finite"),
        ((BALL, 0.11, 0, 3), "base_radius", "> 0"),
        ((BALL, 0.11, 0.042, 1), "fingers", "2..12"),
        ((BALL, 0.11, 0.042, 13), "fingers", "2..12"),
        ((CRATE, 0.11, 0.042, 5), "fingers", "2..4"),
    ],
)
def test_refused(values, place, words):
    with pytest.raises(InvalidValue) as caught:
        GripperLayout(*values)
    assert caught.value.place == place and words in str(caught.value)


def test_room_for_the_bases():
    GripperLayout(BALL, 0.11, 0.042, 12).check_room(0.008)
    with pytest.raises(InvalidValue, match=r"base_radius.*two bases are 13\.86 mm apart"):
        GripperLayout(BALL, 0.11, 0.008, 3).check_room(0.008)
    with pytest.raises(InvalidValue, match=r"base_radius: 0\.037.*>= 0\.038 m"):
        GripperLayout(TIN, 0.11, 0.037, 3).check_room(0.008)
    with pytest.raises(InvalidValue, match=r"two bases are 14 mm apart"):
        narrow = SizedObject("box", (0.05, 0.028, 0.12))
        GripperLayout(narrow, 0.11, 0.042, 3).check_room(0.008)


def test_fingers_touch_with_holes_or_opposite_to_them():
    check_facing(make_finger(straight_cable(1)), 5)
    check_facing(make_finger(straight_cable(7)), 0)
    check_facing(make_finger(straight_cable(4), straight_cable(1, name="front")), 5)
    with pytest.raises(InvalidValue, match=r"finger: \[90\.0\].*a cable hole at 0 or 180 deg of"):
        check_facing(make_finger(straight_cable(4)), 5)
    with pytest.raises(InvalidValue, match="of disk 1:"):
        check_facing(make_finger(helical_cable()), 0)


def test_fingers_keep_apart():
    straight = np.linspace([0, 0, 0], [0, 0, 0.18], 10)
    check_apart([straight, straight + np.array([0.0161, 0, 0])], 0.008, "now")
    leaning = straight + np.linspace([0.03, 0, 0], [0.015, 0, 0], 10)
    with pytest.raises(InvalidValue) as caught:
        check_apart([straight + np.array([0, 1, 0]), straight, leaning], 0.008, "at rest")
    assert caught.value.place == "fingers 2 and 3"
    assert "apart at rest: disk 9 of one and disk 9 of the other come within 15 mm" in str(
        caught.value
    )


def test_fingers_stay_above_their_bases():
    up = np.linspace([0, 0, 0], [0, 0, 0.18], 10)
    check_above_bases([up], 0.008, "now")
    check_above_bases([np.linspace([0, 0, 0], [0, 0, 0.18], 61)], 0.008, "now")  # 3 mm segments
    curled = up.copy()
    curled[7, 2] = -0.014
    with pytest.raises(InvalidValue, match=r"disk 7 comes down to -14 mm") as caught:
        check_above_bases([up, curled], 0.008, "at rest")
    assert caught.value.place == "finger 2"
