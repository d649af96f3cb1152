# SPDX-License-Identifier: Apache-2.0
"""Disks on a curve: true to its arc length, and what is refused by how much."""

from __future__ import annotations

import math

import numpy as np
import pytest
from model.fingers import make_finger

from ccr_ros.design.curve_files import SplineCurve
from ccr_ros.design.curves import arc, helix, s_curve
from ccr_ros.design.placement import place
from ccr_ros.model import InvalidValue

FINGER = make_finger()
L = FINGER.length


@pytest.mark.parametrize("curve", [arc(L, 1.5), s_curve(L, 1.0, 0.3), helix(L, 0.02, 1.0)])
def test_disks_are_a_segments_arc_length_apart(curve):
    shape = place(curve, FINGER)
    s = np.arange(10) * L / 9
    assert np.allclose(shape.points, curve.points(s), atol=1e-15)
    assert np.allclose(shape.tangents, curve.tangents(s), atol=1e-13)
    assert shape.frames is None
    for a, b, points in zip(s, s[1:], shape.points, strict=False):
        dense = curve.points(np.linspace(a, b, 20_001))
        assert np.allclose(dense[0], points, atol=1e-15)
        length = np.linalg.norm(np.diff(dense, axis=0), axis=1).sum()
        assert length == pytest.approx(FINGER.segment_length, rel=1e-8)
    shape.check_fits(FINGER)


@pytest.mark.parametrize("factor", [1 - 9e-4, 1 + 9e-4])
def test_a_length_within_the_tolerance_is_made_up_for(factor):
    curve = arc(factor * L, 1.5)
    shape = place(curve, FINGER)
    shape.check_fits(FINGER)
    tip = curve.points(min(L, curve.length))
    tip = tip + max(0.0, L - curve.length) * curve.tangents(curve.length)
    assert np.allclose(shape.points[-1], tip, atol=1e-15)


def test_a_start_within_the_tolerance_is_moved_to_the_base():
    aside = np.array([1e-4, -5e-5, 2e-5])
    curve = SplineCurve("aside", arc(L, 1.0).points(np.linspace(0, L, 60)) + aside)
    shape = place(curve, FINGER)
    assert np.allclose(shape.points, place(arc(L, 1.0), FINGER).points, atol=1e-7)


def spline(points):
    return SplineCurve("points", np.asarray(points, dtype=float))


UP = np.linspace([0, 0, 0], [0, 0, L], 30)


def leaning(degrees):
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return spline(UP @ np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]))


@pytest.mark.parametrize(
    ("curve", "place_", "words"),
    [
        (arc(1.01 * L, 1), "length", "(it is 1.82 mm too long)"),
        (arc(0.98 * L, 1), "length", "(it is 3.64 mm too short)"),
        (spline(UP + np.array([0.002, 0, 0])), "first point", "(it is 2 mm away)"),
        (leaning(1.2), "first tangent", "(it is 1.2 deg off)"),
        (spline(-UP), "first tangent", "(it is 180 deg off)"),
        (helix(L, 0.0074, 3.8), "curvature at 0 mm", "bent to a radius of 7.852 mm"),
    ],
)
def test_refused(curve, place_, words):
    with pytest.raises(InvalidValue) as caught:
        place(curve, FINGER)
    assert caught.value.place == f"curve {curve.name!r}: {place_}"
    assert words in str(caught.value)


def test_disks_that_would_cut_each_other():
    # The backbone turns by 220 degrees between two disks: their small rims would still clear it.
    coil = helix(L, 0.0049, 5.5)
    finger = make_finger(disk_radius=0.002)
    with pytest.raises(InvalidValue) as caught:
        place(coil, finger)
    assert caught.value.place.startswith("curve 'helix of 5.5 turns, radius 4.9 mm': disks ")
    assert "they cut each other by" in str(caught.value)


@pytest.mark.parametrize("angle", [1.0, 1.02, 1.19])
def test_a_curve_that_comes_round_through_a_disk_is_refused(angle):
    circle = np.linspace(0.0, 2 * math.pi * angle, 400)
    radius = L / (2 * math.pi * angle)
    curve = spline(radius * np.stack([1 - np.cos(circle), 0 * circle, np.sin(circle)], axis=1))
    with pytest.raises(InvalidValue, match=r"runs through disk [019] there, .* mm from its centre"):
        place(curve, FINGER)


def test_a_curve_that_comes_round_beside_its_disks_is_not_refused():
    assert place(helix(L, 0.02, 1.2), FINGER).segments == 9  # a turn rises by 92 mm
