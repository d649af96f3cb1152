# SPDX-License-Identifier: Apache-2.0
"""Curves and objects as people write them."""

from __future__ import annotations

import argparse
import math

import numpy as np
import pytest
from model.fingers import make_finger

from ccr_ros.cli.design.curve_arguments import (
    add_curve_arguments,
    curve_from_args,
    shape_from_args,
)
from ccr_ros.design.contours import contour
from ccr_ros.design.curve_text import SizedObject, curve_from_text, object_from_text
from ccr_ros.design.curves import arc, helix, s_curve
from ccr_ros.design.placement import place
from ccr_ros.design.section import Section
from ccr_ros.model import CcrError, InvalidValue

FINGER = make_finger()
L, S = FINGER.length, np.linspace(0, FINGER.length, 50)


@pytest.mark.parametrize(
    ("text", "curve"),
    [
        ("arc:90", arc(L, math.pi / 2)),
        ("arc:-45,direction=30", arc(L, -math.pi / 4, math.pi / 6)),
        ("s:40,direction=-90", s_curve(L, math.radians(40), -math.pi / 2)),
        ("helix:0.02,turns=-1.2", helix(L, 0.02, -1.2)),
        ("helix:0.02,direction=90,turns=1", helix(L, 0.02, 1, math.pi / 2)),
        (
            "sphere:0.112,x=0.042,z=0.110",
            contour("", L, Section.circle(0.056, 0.042, 0.110), 0.008),
        ),
        (
            "sphere:0.112,x=0.042,z=0.110,clearance=0.002,join=-0.02",
            contour("", L, Section.circle(0.056, 0.042, 0.110), 0.010, -0.02),
        ),
        (
            "box:0.05x0.9x0.1,x=0.02,z=0.11,corner=0.01",
            contour("", L, Section(0.025, 0.05, 0.01, 0.02, 0.11), 0.008),
        ),
        (
            "cylinder:0.05x0.1,x=0.02,z=0.11",
            contour("", L, Section(0.025, 0.05, 0.001, 0.02, 0.11), 0.008),
        ),
    ],
)
def test_families(text, curve):
    assert np.array_equal(curve_from_text(text, FINGER).points(S), curve.points(S))


def test_arguments_of_commands(tmp_path):
    parser = argparse.ArgumentParser()
    add_curve_arguments(parser)
    points = tmp_path / "points.csv"
    np.savetxt(points, 1e3 * arc(L, 1.0).points(S), delimiter=",")
    args = parser.parse_args(["--curve", str(points), "--unit", "mm"])
    curve = curve_from_args(args, FINGER)
    assert curve.length == pytest.approx(L, rel=1e-6) and curve.name == "points.csv"
    named = shape_from_args(parser.parse_args(["--curve", "arc:60"]), FINGER)
    assert np.array_equal(named.points, place(arc(L, math.pi / 3), FINGER).points)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("loop:3", "unknown curve 'loop:3'; valid: a file.csv, arc:ANGLE"),
        ("no_such.csv", "no_such.csv: cannot be read"),
        ("arc:", "must be a finite number, as in arc:ANGLE"),
        ("arc:x", "arc:x: 'x' is not allowed"),
        ("arc:nan", "must be a finite number"),
        ("arc:90,direction", "'direction' is not allowed; must be arc:ANGLE[,direction=ANGLE]"),
        ("arc:90,turns=2", "'turns=2' is not allowed"),
        ("arc:90,direction=1,direction=2", "'direction=2' is not allowed"),
        ("arc:400", "arc:400.angle: 400.0 is not allowed; must be a finite number >= -360 and"),
        ("s:-181", "s:-181.angle: -181.0 is not allowed; must be a finite number >= -180 and"),
        ("helix:0.02", "'no turns' is not allowed"),
        ("helix:-1,turns=1", "lengths > 0"),
        ("sphere:0.1x0.2,x=0,z=1", "must be a finite number, as in sphere:DIAMETER"),
        ("sphere:0.112,x=0.042", "'no z' is not allowed"),
        ("sphere:0.112,x=0.042,z=inf", "'inf' is not allowed"),
        ("box:0.1x0.1,x=0,z=1", "'0.1x0.1' is not allowed; must be box:LENGTHxWIDTHxHEIGHT"),
        ("box:0.1x0x0.1,x=0,z=1", "lengths > 0"),
        ("sphere:0.112,x=0,z=0.01", "base: [0.0, 0.0] is not allowed"),
    ],
)
def test_refused(text, words):
    with pytest.raises(CcrError) as caught:
        curve_from_text(text, FINGER)
    assert words in str(caught.value)


def test_objects():
    assert object_from_text("sphere:0.112") == SizedObject("sphere", (0.112,))
    assert object_from_text("cylinder:0.06x0.1").extent == (0.06, 0.06, 0.1)
    box = object_from_text("box:0.05x0.06x0.07")
    assert box.extent == (0.05, 0.06, 0.07) and box.corner_radius == 0.001
    assert box.section(0.02, 0.1, across=True) == Section(0.03, 0.035, 0.001, 0.02, 0.1)
    assert object_from_text("sphere:0.1").section(0, 1) == Section.circle(0.05, 0, 1)


@pytest.mark.parametrize("text", ["cone:1", "sphere", "sphere:", "sphere:-1", "box:1x1", "arc:90"])
def test_no_objects(text):
    with pytest.raises(CcrError) as caught:
        object_from_text(text)
    assert "sphere" in str(caught.value) or isinstance(caught.value, InvalidValue)
