# SPDX-License-Identifier: Apache-2.0
import dataclasses
import math

import numpy as np
import pytest

from ccr_ros.model import Cable, Finger, InvalidValue, Sphere, UnknownName

from .fingers import helical_cable, make_finger, straight_cable


def refused(make, place):
    with pytest.raises(InvalidValue) as caught:
        make()
    assert caught.value.place == place
    return caught.value


def test_holes_are_clock_holes_from_x_about_z():
    cable = Cable.from_holes("a", list(range(1, 13)))
    np.testing.assert_allclose(cable.angles, np.radians(30 * np.arange(12)), rtol=1e-15)
    assert cable.last_disk == 11
    cable = Cable.from_holes("a", np.array([1, 2, 4]), holes_per_disk=4)
    np.testing.assert_allclose(cable.angles, np.radians([0, 90, 270]), rtol=1e-15)


def test_cables_take_any_sequence_of_numbers():
    for angles in (
        [0, 1],
        (0.0, 1),
        np.array([0, 1]),
        np.array([0, 1], np.float32),
        [0, np.int8(1)],
    ):
        cable = Cable("a", angles)
        assert cable.angles.tolist() == [0.0, 1.0] and cable.angles.dtype == float
    source = np.array([0.0, 1.0])
    cable = Cable("a", source)
    source[0] = 5  # the cable has its own copy
    assert cable.angles[0] == 0
    with pytest.raises(ValueError, match="read-only"):
        cable.angles[0] = 1


@pytest.mark.parametrize(
    ("angles", "place"),
    [
        (None, "angles"),
        (1.0, "angles"),
        ("01", "angles"),
        ([], "angles"),
        ([0.0], "angles"),
        (np.array(1.0), "angles"),
        (np.zeros((2, 2)), "angles[0]"),
        ([0, math.nan], "angles[1]"),
        ([0, "1"], "angles[1]"),
        ([True, 1], "angles[0]"),
        (iter([0, 1]), "angles"),
    ],
)
def test_bad_angles(angles, place):
    refused(lambda: Cable("a", angles), place)


@pytest.mark.parametrize("holes", [3, "12", [], [1], None, np.array(3)])
def test_bad_hole_lists(holes):
    refused(lambda: Cable.from_holes("a", holes), "holes")


@pytest.mark.parametrize("hole", [0, 13, -1, 1.0, True, "1", None, np.bool_(True), np.float64(2)])
def test_bad_holes(hole):
    error = refused(lambda: Cable.from_holes("a", [1, hole]), "holes[1]")
    assert error.value is hole and error.allowed == "an integer 1..12"


def test_properties_follow_the_formulas():
    finger = make_finger(youngs_modulus=2.8e9)
    inertia = math.pi * 0.0025**4 / 64
    assert finger.segment_length == pytest.approx(0.182 / 9)
    assert finger.second_moment == pytest.approx(inertia)
    assert finger.bending_stiffness == pytest.approx(2.8e9 * inertia)
    assert finger.torsion_ratio == pytest.approx(1 / 1.39)
    assert finger.forces_are == "newton"
    assert make_finger().forces_are == "per_EI" and make_finger().bending_stiffness == 1.0


def test_a_finger_does_not_change():
    finger = make_finger(rest_curvature=np.ones((9, 3)))
    with pytest.raises(dataclasses.FrozenInstanceError):
        finger.length = 1.0
    with pytest.raises(ValueError, match="read-only"):
        finger.rest_curvature[0, 0] = 2
    assert dataclasses.replace(finger, length=0.2).rest_curvature.tolist() == [[1, 1, 1]] * 9


def test_rest_curvature_at_several_places_of_segments():
    constant = np.random.default_rng(1).normal(size=(9, 3))
    finger = make_finger(rest_curvature=constant)
    assert not finger.rest_varies and finger.rest_pieces == 1 and not make_finger().rest_varies
    assert np.array_equal(finger.rest_curvature_ends[:, 0], np.stack([constant] * 2, axis=1))
    for pieces in (1, 2, 8):
        ends = np.stack([k * constant for k in range(2 * pieces)], axis=1)
        finger = make_finger(rest_curvature=ends)
        assert finger.rest_varies and finger.rest_pieces == pieces
        assert np.array_equal(finger.rest_curvature_ends, ends.reshape(9, pieces, 2, 3))
    with pytest.raises(ValueError, match="read-only"):
        finger.rest_curvature_ends[0, 0, 0, 0] = 2


def test_numpy_numbers_become_plain_ones():
    finger = make_finger(length=np.float32(0.25), segments=np.int32(9))
    assert type(finger.length) is float and type(finger.segments) is int


@pytest.mark.parametrize(
    ("changes", "place"),
    [
        ({"name": 3}, "name"),
        ({"length": "0.182"}, "length"),
        ({"length": math.nan}, "length"),
        ({"segments": 9.0}, "segments"),
        ({"segments": 8}, "cables[0].angles"),
        ({"disk_radius": 0.182}, "disk_radius"),
        ({"backbone_diameter": 0.016}, "backbone_diameter"),
        ({"poisson_ratio": -1}, "poisson_ratio"),
        ({"youngs_modulus": True}, "youngs_modulus"),
        ({"cables": ()}, "cables"),
        ({"cables": None}, "cables"),
        ({"cables": straight_cable()}, "cables"),
        ({"cables": ("main",)}, "cables[0]"),
        ({"cables": (straight_cable(1), straight_cable(2))}, "cables[1].name"),
        (
            {"cables": (straight_cable(1), straight_cable(2, disks=11, name="b"))},
            "cables[1].angles",
        ),
        ({"obstacles": Sphere([0, 0, 1], 0.1)}, "obstacles"),
        ({"obstacles": ["sphere"]}, "obstacles[0]"),
        ({"rest_curvature": np.zeros((8, 3))}, "rest_curvature"),
        ({"rest_curvature": np.zeros(27)}, "rest_curvature"),
        ({"rest_curvature": np.array(0.0)}, "rest_curvature"),
        ({"rest_curvature": np.zeros((9, 18, 3))}, "rest_curvature[0]"),
        ({"rest_curvature": np.full((9, 2, 3), 125.0)}, "rest_curvature[0][0]"),
        ({"rest_curvature": np.full((9, 3), np.inf)}, "rest_curvature[0][0]"),
    ],
)
def test_bad_fingers(changes, place):
    refused(lambda: make_finger(**changes), place)


def test_rest_curvature_ends_where_disks_meet_or_a_segment_turns_half_round():
    def bent(*curvature):
        return make_finger(rest_curvature=[curvature] + [[0, 0, 0]] * 8)

    bent(124.9, 0, 0)  # disks of 8 mm radius meet at 1 / 8 mm = 125
    assert "bending < 125 1/m" in str(refused(lambda: bent(125, 0, 0), "rest_curvature[0]"))
    refused(lambda: bent(90, 90, 0), "rest_curvature[0]")
    half_turn = math.pi / (0.182 / 9)
    bent(0, 0, 0.999 * half_turn)
    refused(lambda: bent(0, 0, -1.001 * half_turn), "rest_curvature[0]")


def two_cables() -> Finger:
    return make_finger(straight_cable(), helical_cable())


def test_pulls_by_name_or_in_order():
    finger = two_cables()
    for pulls in ([0.001, -0.002], (0.001, -0.002), np.array([0.001, -0.002])):
        assert finger.pulls_array(pulls).tolist() == [0.001, -0.002]
    assert finger.pulls_array({"helical": 0.003}).tolist() == [0, 0.003]
    assert finger.pulls_array({}).tolist() == [0, 0]
    given = np.zeros(2)
    assert finger.pulls_array(given) is not given


@pytest.mark.parametrize(
    ("pulls", "place"),
    [
        ([], "pulls"),
        ([0.001], "pulls"),
        ([0.001] * 3, "pulls"),
        (0.001, "pulls"),
        ("ab", "pulls"),
        (None, "pulls"),
        (np.zeros((2, 1)), "pulls"),
        (np.array(0.001), "pulls"),
        ([[0.001], 0.002], "pulls.straight"),
        ([0.0, math.nan], "pulls.helical"),
        ([0.0, math.inf], "pulls.helical"),
        ([0.0, "0.001"], "pulls.helical"),
        ([0.0, True], "pulls.helical"),
        ([None, 0.0], "pulls.straight"),
        ([0.37, 0.0], "pulls.straight"),
        ([0.0, -0.37], "pulls.helical"),
        ({"helical": None}, "pulls.helical"),
        ({"straight": "4%"}, "pulls.straight"),
    ],
)
def test_bad_pulls(pulls, place):
    error = refused(lambda: two_cables().pulls_array(pulls), place)
    assert "\n" not in str(error)


@pytest.mark.parametrize("key", ["main", "", "Helical", 0, None])
def test_unknown_cables_list_the_known(key):
    with pytest.raises(UnknownName) as caught:
        two_cables().pulls_array({"helical": 0.001, key: 0.001})
    error = caught.value
    assert (error.kind, error.name, error.valid) == ("cable", key, ("straight", "helical"))
    assert str(error) == f"unknown cable {key!r}; valid: straight, helical"
