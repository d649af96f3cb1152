# SPDX-License-Identifier: Apache-2.0
"""Named curves: closed forms, arc length that is one, and values out of range."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ccr_ros.design.curves import Curve, arc, helix, s_curve
from ccr_ros.model import CcrError, InvalidValue

L = 0.182


def check_is_a_curve(curve: Curve, tolerance: float = 1e-7) -> None:
    """It leaves the origin along z, and tangents and curvatures are the derivatives of points."""
    assert np.allclose(curve.points(0.0), 0, atol=1e-15)
    assert np.allclose(curve.tangents(0.0), [0, 0, 1], atol=1e-15)
    h = 1e-5 * curve.length
    s = np.linspace(2 * h, curve.length - 2 * h, 301)
    slopes = (curve.points(s + h) - curve.points(s - h)) / (2 * h)
    tangents = curve.tangents(s)
    assert np.allclose(slopes, tangents, atol=tolerance)
    assert np.allclose(np.linalg.norm(tangents, axis=1), 1, atol=1e-14)
    turning = np.linalg.norm(curve.tangents(s + h) - curve.tangents(s - h), axis=1) / (2 * h)
    # near a sign change of a planar curve's curvature the turning is one-sided
    assert np.allclose(turning, curve.curvatures(s), atol=1e-4 * max(1, curve.curvatures(s).max()))


@settings(deadline=None, max_examples=25)
@given(
    st.floats(0.01, 10), st.floats(-6.28, 6.28).filter(lambda a: abs(a) > 1e-3), st.floats(-9, 9)
)
def test_arc_is_a_circle(length, angle, direction):
    curve = arc(length, angle, direction)
    check_is_a_curve(curve)
    radius = length / angle
    forward = radius * (1 - math.cos(angle))
    tip = [math.cos(direction) * forward, math.sin(direction) * forward, radius * math.sin(angle)]
    assert np.allclose(curve.points(length), tip, atol=1e-14 * length / 1e-3)


@settings(deadline=None, max_examples=25)
@given(st.floats(-3.14, 3.14).filter(lambda a: abs(a) > 1e-3), st.floats(-9, 9))
def test_s_turns_and_turns_back(angle, direction):
    curve = s_curve(L, angle, direction)
    check_is_a_curve(curve)
    assert np.allclose(curve.tangents(L), [0, 0, 1], atol=1e-13)
    assert curve.tangents(L / 2) @ [0, 0, 1] == pytest.approx(math.cos(angle), abs=1e-13)
    # symmetric about its middle
    s = np.linspace(0, L / 2, 20)
    middle = curve.points(L / 2)
    assert np.allclose(curve.points(L - s) - middle, middle - curve.points(s), atol=1e-15)


def test_s_is_the_rest_shape_of_the_papers_pre_bent_finger():
    curve = s_curve(L, 4 * L / math.pi)  # config/contact_cylinder.yaml: 4 sin(2 pi s / L)
    s = (np.arange(9) + 0.5) * L / 9
    assert np.allclose(
        curve.curvatures(s),
        np.abs([1.36808, 3.46410, 3.93923, 2.57115, 0, 2.57115, 3.93923, 3.46410, 1.36808]),
        atol=1e-5,
    )


@settings(deadline=None, max_examples=25)
@given(st.floats(0.1, 5), st.booleans(), st.floats(0.05, 0.99), st.floats(-9, 9))
def test_helix_winds_round_a_cylinder(turns, left, share, direction):
    radius = share * L / (2 * math.pi * turns)
    curve = helix(L, radius, -turns if left else turns, direction)
    check_is_a_curve(curve)
    s = np.linspace(0, L, 200)
    # The cylinder: its axis goes through the centre of curvature plus the offset of the axis.
    pitch_angle = math.acos(share)
    axis = math.sin(pitch_angle) * np.array([0, 0, 1]) + (-1 if left else 1) * math.cos(
        pitch_angle
    ) * np.cross([0, 0, 1], [math.cos(direction), math.sin(direction), 0])
    foot = radius * np.array([math.cos(direction), math.sin(direction), 0])
    offset = curve.points(s) - foot
    distance = np.linalg.norm(offset - np.outer(offset @ axis, axis), axis=1)
    assert np.allclose(distance, radius, atol=1e-12)
    assert np.ptp(offset @ axis) == pytest.approx(L * math.sin(pitch_angle), rel=1e-9)
    # right-handed: going along the axis, it turns about it in the positive sense
    turning = np.einsum("ij,ij->i", np.cross(offset, curve.tangents(s)), np.tile(axis, (200, 1)))
    assert np.all(turning < 0 if left else turning > 0)


def test_shapes_of_results():
    curve = arc(L, 1.0)
    assert curve.points(0.1).shape == (3,) and curve.curvatures(0.1).shape == ()
    assert curve.points(np.zeros((4, 5))).shape == (4, 5, 3)
    assert curve.tangents([0.0, L]).shape == (2, 3)
    assert curve.curvatures(np.array([0.0, L])) == pytest.approx([1 / L] * 2)


@pytest.mark.parametrize("s", [-1e-6, L + 1e-6, math.nan, [0.0, math.inf]])
def test_beyond_its_ends_a_curve_is_not(s):
    with pytest.raises(InvalidValue, match=r"s: .*an arc length 0\.\.0\.182"):
        arc(L, 1.0).points(s)


@pytest.mark.parametrize(
    ("make", "place"),
    [
        (lambda: arc(0, 1), "length"),
        (lambda: arc(math.nan, 1), "length"),
        (lambda: arc(L, 0), "angle"),
        (lambda: arc(L, 7), "angle"),
        (lambda: arc(L, "1"), "angle"),
        (lambda: arc(L, 1, math.inf), "direction"),
        (lambda: s_curve(L, 3.2), "angle"),
        (lambda: s_curve(-L, 1), "length"),
        (lambda: helix(L, 0, 1), "radius"),
        (lambda: helix(L, 0.02, 0), "turns"),
        (lambda: helix(L, 0.02, 1.45), "turns"),
        (lambda: helix(L, 0.02, math.nan), "turns"),
    ],
)
def test_refused(make, place):
    with pytest.raises(InvalidValue) as caught:
        make()
    assert caught.value.place == place and isinstance(caught.value, CcrError)
