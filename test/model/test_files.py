# SPDX-License-Identifier: Apache-2.0
"""Finger files as a careless user, and a fuzzer, would write them."""

import math
import string

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ccr_ros.model import (
    Box,
    Cylinder,
    Finger,
    InvalidFile,
    InvalidValue,
    Plane,
    Sphere,
    finger_from_dict,
    load_finger,
)
from ccr_ros.model.errors import MissingKey, UnknownKey

from .finger_files import DATA, TEXT, changed, refused


@pytest.fixture
def write(tmp_path):
    """Return a function that writes a file and returns its path."""

    def write(content, name="finger.yaml"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


def test_every_key_arrives(write):
    text = TEXT + (
        "youngs_modulus: 2.8e9\n"
        "holes_per_disk: 12\n"
        "rest_curvature: [[0, 1.5, 0], [-1, 0, 2]]\n"
        "obstacles:\n"
        "  - {type: sphere, name: ball, center: [0, 0, 1], radius: 0.1}\n"
        "  - {type: cylinder, point: [0.1, 0, 0], axis: [0, 0, 2], radius: 0.02}\n"
        "  - {type: box, center: [0, 3, 0], orientation: [0, 0, 0, 1], size: [1, 2, 3]}\n"
        "  - {type: plane, point: [0, 0, -1], normal: [0, 0, 3]}\n"
    )
    text = text.replace("12]}\n", "12]}\n  - {name: short, angles: [0.5, -0.25], last_disk: 1}\n")
    finger = load_finger(write(text))
    assert (finger.name, finger.length, finger.segments) == ("small", 0.1, 2)
    assert (finger.disk_radius, finger.backbone_diameter) == (0.008, 0.0025)
    assert (finger.poisson_ratio, finger.youngs_modulus) == (0.39, 2.8e9)
    assert finger.rest_curvature.tolist() == [[0, 1.5, 0], [-1, 0, 2]]
    assert finger.cable_names == ("main", "short")
    np.testing.assert_allclose(finger.cables[0].angles, np.radians([0, 30, 330]), rtol=1e-15)
    assert finger.cables[1].angles.tolist() == [0.5, -0.25]
    assert finger.cables[1].last_disk == 1
    ball, rod, box, plane = finger.obstacles
    assert isinstance(ball, Sphere) and ball.name == "ball" and ball.radius == 0.1
    assert isinstance(rod, Cylinder) and rod.name == "cylinder_1"
    assert rod.axis.tolist() == [0, 0, 1]
    assert isinstance(box, Box) and box.size.tolist() == [1, 2, 3]
    assert isinstance(plane, Plane) and plane.normal.tolist() == [0, 0, 1]


def test_optional_keys_may_be_absent_or_empty(write):
    empty = "youngs_modulus:\nholes_per_disk: ~\nrest_curvature: null\nobstacles:\n"
    for text in (TEXT, TEXT + empty):
        finger = load_finger(write(text))
        assert finger.youngs_modulus is None and finger.holes_per_disk == 12
        assert finger.obstacles == () and not finger.rest_curvature.any()


def test_a_gripper_file_is_no_finger_file(write):
    with pytest.raises(InvalidFile, match=r"describes a gripper .* a finger file is wanted"):
        load_finger(write("name: g\nfingers: []\n"))


@pytest.mark.parametrize("key", DATA)
def test_missing_keys(key):
    for data in ({k: v for k, v in DATA.items() if k != key}, changed(**{key: None})):
        error = refused(data)
        assert isinstance(error, MissingKey)
        assert str(error) == f"x.yaml: {key}: missing; this key is required"


def test_unknown_keys_suggest_the_nearest():
    error = refused(changed(lenght=0.2))
    assert isinstance(error, UnknownKey)
    assert (error.place, error.value) == ("lenght", 0.2)
    assert "unknown key (did you mean 'length'?); valid keys: backbone_diameter, " in str(error)
    assert "segments" in error.allowed
    assert "did you mean" not in str(refused(changed(zzz=1)))
    error = refused(changed(cables=[{"name": "a", "hole": [1, 2]}]))
    assert error.place == "cables[0].hole" and "did you mean 'holes'?" in str(error)


@pytest.mark.parametrize("key", [3, None, True, 1.5, "a\nb", "", "x" * 500, ("a", 1)])
def test_strange_keys_leave_the_message_on_one_line(key):
    error = refused({**DATA, key: 1})
    assert isinstance(error, UnknownKey) and len(error.place) <= 60


NUMBERS = {
    "length": ">= 1e-06 and <= 1000 [m]",
    "disk_radius": ">= 1e-06 and < 0.1 [m]",
    "backbone_diameter": ">= 1e-06 and < 0.016 [m]",
    "poisson_ratio": "> -1 and <= 0.5",
    "youngs_modulus": ">= 1 and <= 1e+15 [Pa]",
}
NO_NUMBERS = [True, "0.1", "", [0.1], {}, math.nan, math.inf, -math.inf, 1j, np.bool_(1), 10**400]
NO_NUMBERS += [np.array(0.1), np.array([0.1]), b"1", -1.0, -1e400, np.float64(np.nan), "1e400"]


@pytest.mark.parametrize("value", NO_NUMBERS, ids=repr)
@pytest.mark.parametrize("key", NUMBERS)
def test_numbers_must_be_numbers_in_their_range(key, value):
    error = refused(changed(**{key: value}))
    assert error.place == key
    assert error.value is value
    assert error.allowed == f"a finite number {NUMBERS[key]}"


@pytest.mark.parametrize(
    ("key", "bad", "good"),
    [
        ("length", [0, 9e-7, 1001], [1, 1000]),
        ("disk_radius", [0, 0.1, 0.2, 0.00125], [0.0999, 0.0013]),
        ("backbone_diameter", [0, 0.016], [0.0159, 1e-6]),
        ("poisson_ratio", [-1, 0.5000001, 1], [-0.999, 0, 0.5]),
        ("youngs_modulus", [0, 1e16], [1, 1e15]),
        ("segments", [1, 0, -2, 1001, 2.0, True, "2", math.nan], [np.int64(2), 1000]),
        ("holes_per_disk", [0, -1, 3601, 12.0, False], [12, 3600]),
    ],
)
def test_bounds(key, bad, good):
    for value in bad:
        place = refused(changed(**{key: value})).place
        # A disk must be wider than the backbone: the diameter is then the one to complain of.
        assert place == key or (key, place) == ("disk_radius", "backbone_diameter")
    for value in good:
        assert getattr(finger_from_dict(changed(**{key: value})), key) == value


@pytest.mark.parametrize("name", ["", " a", "a ", "a\n", "a\0b", "a" * 65, 3, None, True])
def test_names_of_fingers_and_obstacles_must_be_printable(name):
    obstacle = {"type": "sphere", "center": [0, 0, 1], "radius": 0.1, "name": name}
    for data, place in (
        (changed(name=name), "name"),
        (changed(obstacles=[obstacle]), "obstacles[0].name"),
    ):
        if name is None and place != "name":
            continue  # a null is not given, and an obstacle's name need not be
        assert refused(data).place == place


@pytest.mark.parametrize("name", ["a", "A1", "finger_1", "PB 2", "general-1", "a" * 64])
def test_good_names(name):
    assert finger_from_dict(changed(name=name)).name == name


scalars = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(string.printable, max_size=5),
    st.sampled_from([np.float32(1), np.int8(3), np.array([1.0, 2.0]), object(), {1}]),
)
values = st.recursive(
    scalars,
    lambda inner: st.one_of(
        st.lists(inner, max_size=4),
        st.dictionaries(
            st.sampled_from(["name", "holes", "angles", "type", "center", "radius", 1, "x"]),
            inner,
            max_size=4,
        ),
    ),
    max_leaves=12,
)
KEYS = [*DATA, "obstacles", "rest_curvature", "youngs_modulus", "holes_per_disk"]


@settings(derandomize=True, max_examples=120, deadline=None)
@given(st.sampled_from(KEYS), values)
def test_whatever_a_key_holds_is_taken_or_refused_in_one_line(key, value):
    data = changed(**{key: value})
    try:
        assert isinstance(finger_from_dict(data, "x.yaml"), Finger)
    except InvalidValue as error:
        assert error.place.startswith(key) and "\n" not in str(error) and len(str(error)) < 500
