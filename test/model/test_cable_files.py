# SPDX-License-Identifier: Apache-2.0
"""Cables and rest curvature in finger files."""

import math

import numpy as np
import pytest

from ccr_ros.model import finger_from_dict

from .finger_files import changed, refused


@pytest.mark.parametrize(
    "name", ["", "1a", "_a", "a b", "a/b", "a-b", "a.b", "a__b", "~a", "{a}", "é", "a\n", "a" * 65]
)
def test_names_of_cables_must_fit_into_ros_topics(name):
    allowed = "a name of at most 64 letters, digits and single '_' that starts with a letter"
    error = refused(changed(cables=[{"name": name, "holes": [1, 1]}]))
    assert (error.place, error.value, error.allowed) == ("cables[0].name", name, allowed)


@pytest.mark.parametrize(
    ("cables", "place", "value"),
    [
        ([], "cables", []),
        ("main", "cables", "main"),
        ({"main": [1, 2, 3]}, "cables", {"main": [1, 2, 3]}),
        (["main"], "cables[0]", "main"),
        ([{"holes": [1, 1, 1]}], "cables[0].name", None),
        ([{"name": "a"}], "cables[0]", ["name"]),
        (
            [{"name": "a", "holes": [1, 1], "angles": [0, 0]}],
            "cables[0]",
            ["angles", "holes", "name"],
        ),
        ([{"name": "a", "holes": 1}], "cables[0].holes", 1),
        ([{"name": "a", "holes": "123"}], "cables[0].holes", "123"),
        ([{"name": "a", "holes": []}], "cables[0].holes", []),
        ([{"name": "a", "holes": [1]}], "cables[0].holes", [1]),
        ([{"name": "a", "holes": [1, 2, 3, 4]}], "cables[0].holes", [1, 2, 3, 4]),
        ([{"name": "a", "angles": [1.0]}], "cables[0].angles", [1.0]),
        ([{"name": "a", "angles": [0, 0, 0, 0]}], "cables[0].angles", [0, 0, 0, 0]),
        ([{"name": "a", "angles": {}}], "cables[0].angles", {}),
        ([{"name": "a", "holes": [1, 0, 3]}], "cables[0].holes[1]", 0),
        ([{"name": "a", "holes": [1, 2, 13]}], "cables[0].holes[2]", 13),
        ([{"name": "a", "holes": [1.0, 2, 3]}], "cables[0].holes[0]", 1.0),
        ([{"name": "a", "holes": [1, True, 3]}], "cables[0].holes[1]", True),
        ([{"name": "a", "holes": [1, None, 3]}], "cables[0].holes[1]", None),
        ([{"name": "a", "angles": [0, "x", 3]}], "cables[0].angles[1]", "x"),
        ([{"name": "a", "holes": [1, 1, 1], "last_disk": 1}], "cables[0].holes", [1, 1, 1]),
        ([{"name": "a", "angles": [1, 1], "last_disk": 2}], "cables[0].angles", [1, 1]),
        ([{"name": "a", "holes": [1, 1], "last_disk": 0}], "cables[0].last_disk", 0),
        ([{"name": "a", "holes": [1, 1], "last_disk": 3}], "cables[0].last_disk", 3),
        ([{"name": "a", "holes": [1, 1], "last_disk": True}], "cables[0].last_disk", True),
        ([{"name": "a", "holes": [1, 1]}, {"name": "a", "holes": [2, 2]}], "cables[1].name", "a"),
    ],
)
def test_bad_cables(cables, place, value):
    error = refused(changed(cables=cables))
    assert (error.place, error.value) == (place, value)


def test_bad_counts_say_how_many_are_wanted():
    error = refused(changed(cables=[{"name": "a", "holes": [1, 2, 3, 4]}]))
    assert error.allowed == "a list of 2..3 numbers, one per disk from the base (got 4)"
    error = refused(changed(cables=[{"name": "a", "holes": [1, 1, 1], "last_disk": 1}]))
    assert error.allowed == "2 numbers, for disks 0..1 (last_disk); got 3"
    error = refused(changed(rest_curvature=[[0, 0, 0]]))
    assert "2 vectors of 3 numbers [1/m], one per segment (got 1)" in str(error)


def test_holes_are_counted_against_holes_per_disk():
    error = refused(changed(holes_per_disk=4, cables=[{"name": "a", "holes": [4, 4, 5]}]))
    assert (error.place, error.value, error.allowed) == ("cables[0].holes[2]", 5, "an integer 1..4")
    finger = finger_from_dict(changed(holes_per_disk=4, cables=[{"name": "a", "holes": [4, 2, 1]}]))
    np.testing.assert_allclose(finger.cables[0].angles, np.radians([270, 90, 0]), rtol=1e-15)


def test_a_cable_may_end_before_the_tip():
    for last in ({}, {"last_disk": 1}):
        finger = finger_from_dict(changed(cables=[{"name": "a", "holes": [1, 4], **last}]))
        assert finger.cables[0].last_disk == 1


@pytest.mark.parametrize(
    ("value", "place"),
    [
        (3, "rest_curvature"),
        ("0 0 0", "rest_curvature"),
        ({}, "rest_curvature"),
        ([], "rest_curvature"),
        ([0, 0, 0], "rest_curvature"),
        ([[0, 0, 0]] * 3, "rest_curvature"),
        ([[0, 0, 0], 0], "rest_curvature[1]"),
        ([[0, 0, 0], [0, 0]], "rest_curvature[1]"),
        ([[0, 0, 0], [0, 0, 0, 0]], "rest_curvature[1]"),
        ([[0, 0, 0], [0, math.nan, 0]], "rest_curvature[1][1]"),
        ([[0, 0, 0], [0, "1", 0]], "rest_curvature[1][1]"),
        ([[0, 0, 0], [0, 200, 0]], "rest_curvature[1]"),
        ([[0, 0, 100], [0, 0, 0]], "rest_curvature[0]"),
        ([[1e200, 1e200, 0], [0, 0, 0]], "rest_curvature[0]"),
        ([[[0, 0, 0], [0, 1, 0]], [0, 0, 0]], "rest_curvature[1]"),
        ([[0, 0, 0], [[0, 0, 0], [0, 1, 0]]], "rest_curvature[1]"),
        ([[[0, 0, 0]] * 2, [[0, 0, 0]] * 3], "rest_curvature[1]"),
        ([[[0, 0, 0]]] * 2, "rest_curvature[0]"),
        ([[[0, 0, 0]] * 3] * 2, "rest_curvature[0]"),
        ([[[0, 0, 0]] * 18] * 2, "rest_curvature[0]"),
        ([[[0, 0, 0]] * 2, [[0, 0, 0], 0]], "rest_curvature[1][1]"),
        ([[[0, 0, 0]] * 2, [[0, 0, 0], [0, 0]]], "rest_curvature[1][1]"),
        ([[[0, 0, 0], [0, math.inf, 0]]] * 2, "rest_curvature[0][1][1]"),
        ([[[0, 0, 0], [0, 200, 0]], [[0, 0, 0]] * 2], "rest_curvature[0][1]"),
        ([[[[0]], [0, 1, 0]]] * 2, "rest_curvature[0][0]"),
        ([[]] * 2, "rest_curvature[0]"),
        ([[[]]] * 2, "rest_curvature[0]"),
    ],
)
def test_bad_rest_curvature(value, place):
    assert refused(changed(rest_curvature=value)).place == place


def test_rest_curvature_at_several_places_of_segments():
    pairs = [[[0, 1.5, 0], [0, 2, 0]], [[0, 2, 0], [-1, 0, 2]]]
    for ends in (pairs, [pair * 2 for pair in pairs]):
        finger = finger_from_dict(changed(rest_curvature=ends))
        assert finger.rest_curvature.tolist() == ends
        assert finger.rest_curvature_ends.reshape(2, -1, 3).tolist() == ends
    error = refused(changed(rest_curvature=[pairs[0], [[0, 0, 0]] * 4]))
    assert error.allowed.startswith("2 vectors of 3 numbers [1/m], at the start and the end of")
    error = refused(changed(rest_curvature=[[[0, 0, 0]], [[0, 0, 0]]]))
    assert error.allowed.startswith("2, 4, .. or 16 vectors")
