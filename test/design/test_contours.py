# SPDX-License-Identifier: Apache-2.0
"""Contours of objects: on the contour to rounding, nothing jumps at the join, the least bending."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.integrate import trapezoid

from ccr_ros.design.contours import contour, lead_in, least_lead_in
from ccr_ros.design.section import Section
from ccr_ros.model import InvalidValue

from .test_curves import check_is_a_curve

L = 0.182
BALL = Section.circle(0.056, 0.042, 0.110)  # the paper's sphere, seen from a finger's base
BLOCK = Section(0.03, 0.04, 0.004, 0.02, 0.11)


def flat(points):
    return points[..., [0, 2]]


def ends(curve, section, clearance):
    """Arc length from which on the curve is on the contour."""
    s = np.linspace(0, curve.length, 4001)
    off = np.abs(section.grown(clearance).signed_distance(flat(curve.points(s))))
    return s[np.flatnonzero(off > 1e-9)[-1] + 1]


@pytest.mark.parametrize("section", [BALL, BLOCK], ids=["sphere", "block"])
@pytest.mark.parametrize("clearance", [0.008, 0.011])
def test_it_leads_to_the_contour_and_follows_it(section, clearance):
    curve = contour("c", L, section, clearance)
    wanted = section.grown(clearance)
    lead = least_lead_in(wanted)
    s = np.linspace(0, L, 2001)
    off = wanted.signed_distance(flat(curve.points(s)))
    assert np.abs(off[s >= lead.length]).max() < 1e-12
    assert off.min() > -1e-5  # the search looks at 65 points of the lead-in alone
    assert np.all(curve.points(s)[:, 1] == 0)
    assert ends(curve, section, clearance) == pytest.approx(lead.length, abs=2e-3)


def test_it_is_a_smooth_curve():
    curve = contour("c", L, BALL, 0.008)
    check_is_a_curve(curve, 1e-6)
    s = np.linspace(0, L, 20_001)
    # Its curvature changes by no more than a finger's segments take: no jump where it joins.
    signed = np.diff(np.arctan2(*flat(curve.tangents(s)).T)) / np.diff(s)
    assert np.abs(np.diff(signed)).max() < 0.05
    assert signed[-1] == pytest.approx(1 / 0.064, rel=1e-6)


def test_positions_count_from_the_middle_of_the_side():
    around = BLOCK.grown(0.008)
    for join in (-0.045, -0.03, 0.0, 0.03, 0.045):
        forward, up, heading, curvature = around.at(join)
        assert abs(around.signed_distance(np.array([[forward, up]]))[0]) < 1e-15
        on_side = abs(join) <= 0.036
        assert (heading == 0) == on_side and curvature == (0 if on_side else 1 / 0.012)
        if on_side:
            assert (forward, up) == (pytest.approx(0.02 - 0.038), pytest.approx(0.11 + join))
        assert math.copysign(1, heading or join) == math.copysign(1, join)
    positions, headings = around.knots()
    assert np.interp(-0.045, positions, headings) == pytest.approx(around.at(-0.045)[2])


def test_the_join_can_be_chosen_and_the_least_bending_one_bends_least():
    wanted = BALL.grown(0.008)
    least = least_lead_in(wanted)
    bending = [lead_in(wanted, float(j)).bending for j in np.linspace(-0.03, 0.01, 41)]
    assert least.bending <= min(bending) < 1.001 * least.bending
    chosen = contour("c", L, BALL, 0.008, join=-0.02)
    lead = lead_in(wanted, -0.02)
    assert lead.join == -0.02
    assert ends(chosen, BALL, 0.008) == pytest.approx(lead.length, abs=2e-3)
    bounded = least_lead_in(wanted, lambda x: x.join <= -0.025)
    assert bounded.join == pytest.approx(-0.025, abs=1e-6) and bounded.join <= -0.025
    # The bending that it states is that of the curve.
    s = np.linspace(0, lead.length, 4001)
    squares = chosen.curvatures(s) ** 2
    assert lead.bending == pytest.approx(trapezoid(squares, s), rel=1e-6)


@settings(deadline=None, max_examples=12)
@given(
    st.floats(0.01, 0.1), st.floats(0.01, 0.1), st.floats(0, 1), st.floats(-0.1, 0.1),
    st.floats(0.05, 0.3), st.floats(0.002, 0.02),
)  # fmt: skip
def test_any_section(width, height, roundness, forward, up, clearance):
    section = Section(width, height, roundness * min(width, height), forward, up)
    try:
        curve = contour("c", 1.0, section, clearance)
    except InvalidValue as error:
        assume(error.place in ("base", "length"))
        return
    wanted = section.grown(clearance)
    s = np.linspace(0, 1.0, 801)
    points = curve.points(s)
    off = wanted.signed_distance(flat(points))
    assert off.min() > -2e-5
    assert abs(off[-1]) < 1e-10
    assert np.allclose(curve.tangents(0.0), [0, 0, 1], atol=1e-12)
    chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert np.all(chords < np.diff(s) * (1 + 1e-9))


@pytest.mark.parametrize(
    ("section", "clearance", "join", "length", "place", "words"),
    [
        (Section.circle(0.05, 0.0, 0.05), 0.008, None, L, "base", "it is 8 mm inside"),
        (Section(0.05, 0.02, 0.001, 0.03, 0.035), 0.008, None, L, "base", "its side -28 mm in"),
        (Section.circle(0.056, 0.042, 0.5), 0.008, None, L, "length", "that lead to the contour"),
        (Section.circle(0.01, 0.0, 0.1), 0.002, None, L, "length", "that end behind the object"),
        (BALL, 0.0, None, L, "clearance", "> 0"),
        (BALL, math.nan, None, L, "clearance", "finite"),
        (BALL, 0.008, 0.1, L, "join", "<= 0.0893"),
        (BALL, 0.008, math.nan, L, "join", "finite"),
        (BLOCK, 0.008, -0.03, 0.0, "length", "> 0"),
        (BALL, 0.008, 0.04, L, "join", "passes"),
    ],
)
def test_refused(section, clearance, join, length, place, words):
    with pytest.raises(InvalidValue) as caught:
        contour("c", length, section, clearance, join)
    assert caught.value.place == place and words in str(caught.value)


@pytest.mark.parametrize(
    ("values", "place"),
    [
        ((0, 0.04, 0, 0, 0.1), "half_width"),
        ((0.03, -1, 0, 0, 0.1), "half_height"),
        ((0.03, 0.04, 0.031, 0, 0.1), "corner_radius"),
        ((0.03, 0.04, 0.01, math.inf, 0.1), "forward"),
        ((0.03, 0.04, 0.01, 0, "0"), "up"),
    ],
)
def test_sections_out_of_range(values, place):
    with pytest.raises(InvalidValue) as caught:
        Section(*values)
    assert caught.value.place == place
