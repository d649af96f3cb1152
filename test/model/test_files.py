# SPDX-License-Identifier: Apache-2.0
"""Finger files as a careless user, and a fuzzer, would write them."""

import copy
import math
import string

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from ccr_ros.model import (
    Box,
    CcrError,
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
from ccr_ros.model.files import obstacles_from_list

TEXT = """\
name: small
length: 0.1
segments: 2
disk_radius: 0.008
backbone_diameter: 0.0025
poisson_ratio: 0.39
cables:
  - {name: main, holes: [1, 2, 12]}
"""
DATA = yaml.safe_load(TEXT)


@pytest.fixture
def write(tmp_path):
    """Return a function that writes a file and returns its path."""

    def write(content, name="finger.yaml"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


def changed(**keys):
    return {**copy.deepcopy(DATA), **keys}


def refused(data):
    with pytest.raises(InvalidValue) as caught:
        finger_from_dict(data, source="x.yaml")
    error = caught.value
    assert error.source == "x.yaml"
    assert "\n" not in str(error)
    assert str(error).startswith(f"x.yaml: {error.place}: " if error.place else "x.yaml: ")
    return error


def test_every_key_arrives(write):
    text = TEXT + (
        "youngs_modulus: 2.8e9\n"
        "holes_per_disk: 12\n"
        "rest_curvature: [[0, 1.5, 0], [-1, 0, 2]]\n"
        "obstacles:\n"
        "  - {type: sphere, name: ball, center: [0, 0, 1], radius: 0.1}\n"
        "  - {type: cylinder, point: [0.1, 0, 0], axis: [0, 0, 2], radius: 0.02}\n"
        "  - {type: box, center: [0, 1, 0], orientation: [0, 0, 0, 1], size: [1, 2, 3]}\n"
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


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "is empty"),
        (b"# only a remark\n", "is empty"),
        (b"- 1\n- 2\n", "holds a list"),
        (b"straight\n", "holds a single value"),
        (b"\x89PNG\r\n\x1a\n\x00", "not UTF-8 text (line 1)"),
        (b"# x\nname: \xe9\n", "not UTF-8 text (line 2)"),
        (TEXT.encode("utf-16"), "not UTF-8"),
        (b"name: a\nlength: \x00\n", "line 2: character #x0000"),
        (TEXT + "\tnu: 1\n", "line 9, column 1: found a tab"),
        (TEXT + "length: 0.2\n", "line 9, column 1: the key 'length' is given twice"),
        (TEXT.replace("{name", "{name: x, name"), "line 8, column 15: the key 'name' is given"),
        (TEXT + "a: [1, 2\n", "line 10, column 1: expected ',' or ']'"),
        (TEXT + "a: *b\n", "line 9, column 4: found undefined alias 'b'"),
        (TEXT + "---\n" + TEXT, "line 9, column 1: but found another document"),
        ("? [1, 2]\n: 3\n", "found unhashable key"),
        ("a: " + "[" * 5000 + "]" * 5000, "line 1, column 35: nested too deeply"),
        ("a: !!python/object/apply:os.getcwd []\n", "could not determine a constructor"),
        ("a: !!int x\n", "line 1, column 4: not a valid value"),
        ("a: !!bool x\n", "line 1, column 4: not a valid value"),
        ("a: !!timestamp x\n", "line 1, column 4: not a valid value"),
        ("a: " + "9" * 5000, "line 1, column 4: not a valid value"),
        (b"# " + b"x" * 2_000_000, "larger than 2 MB"),
    ],
)
def test_what_is_no_mapping_in_yaml_is_said_in_one_line(write, content, reason):
    path = write(content)
    with pytest.raises(InvalidFile) as caught:
        load_finger(path)
    assert reason in caught.value.reason
    assert caught.value.path == str(path)
    assert str(caught.value) == f"{path}: {caught.value.reason}"
    assert "\n" not in str(caught.value)


def test_unreadable_paths(tmp_path, write):
    inside_a_file = write(TEXT) / "x"
    for path, reason in (
        (tmp_path / "absent.yaml", "No such file or directory"),
        (tmp_path, "Is a directory"),
        (inside_a_file, "Not a directory"),
        ("a\0b", "null byte"),
        ("x" * 5000, "name too long"),
    ):
        with pytest.raises(InvalidFile, match=f"cannot be read: .*{reason}") as caught:
            load_finger(path)
        assert caught.value.path == str(path)


def test_a_byte_order_mark_and_windows_line_ends_do_no_harm(write):
    assert load_finger(write("\ufeff" + TEXT.replace("\n", "\r\n"))).name == "small"


def test_a_gripper_file_is_no_finger_file(write):
    with pytest.raises(InvalidFile, match=r"describes a gripper .* a finger file is wanted"):
        load_finger(write("name: g\nfingers: []\n"))


def test_scalars_are_read_as_yaml_1_2_reads_them(write):
    # YAML 1.1 has 2.8e9 as a text, `on` as true and 010 as eight.
    finger = load_finger(write(TEXT.replace("small", "on") + "youngs_modulus: 2.8e9\n"))
    assert finger.name == "on" and finger.youngs_modulus == 2.8e9
    assert load_finger(write(TEXT + "youngs_modulus: 28E+8\n")).youngs_modulus == 2.8e9
    for written in ("010", "1:30", "1_0", "0x2"):
        with pytest.raises(InvalidValue) as caught:
            load_finger(write(TEXT.replace("segments: 2", f"segments: {written}")))
        assert (caught.value.place, caught.value.value) == ("segments", written)


def test_merge_keys_may_be_overridden(write):
    text = TEXT.replace("{name: main", "&m {name: main") + "  - {<<: *m, name: other}\n"
    finger = load_finger(write(text))
    assert finger.cable_names == ("main", "other")
    np.testing.assert_array_equal(*(c.angles for c in finger.cables))


def test_an_alias_bomb_is_refused_without_writing_it_out(write):
    lines = ["rest_curvature:", "  - &a0 [0, 0, 0, 0, 0, 0, 0, 0, 0, 0]"]
    lines += [f"  - &a{k} [{', '.join([f'*a{k - 1}'] * 10)}]" for k in range(1, 30)]
    with pytest.raises(InvalidValue) as caught:
        load_finger(write(TEXT + "\n".join(lines) + "\n"))
    assert caught.value.place == "rest_curvature"
    assert len(str(caught.value)) < 500


def test_merges_of_merges_do_not_multiply(write):
    lines = ["a0: &a0 {x: 1}"]
    lines += [f"a{k}: &a{k} {{<<: [{', '.join([f'*a{k - 1}'] * 10)}]}}" for k in range(1, 30)]
    with pytest.raises(UnknownKey) as caught:
        load_finger(write("\n".join(lines) + "\n"))
    assert (caught.value.place, caught.value.value) == ("a0", {"x": 1})


def test_a_list_that_holds_itself_is_refused(write):
    text = TEXT.partition("cables")[0] + "cables: &c [*c]\n"
    with pytest.raises(InvalidValue, match=r"cables\[0\]: .* must be a mapping"):
        load_finger(write(text))


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


@pytest.mark.parametrize(
    "name", ["", "1a", "_a", "a b", "a/b", "a-b", "a.b", "a__b", "~a", "{a}", "é", "a\n", "a" * 65]
)
def test_names_must_fit_into_ros_topics(name):
    allowed = "a name of at most 64 letters, digits and single '_' that starts with a letter"
    obstacle = {"type": "sphere", "center": [0, 0, 1], "radius": 0.1, "name": name}
    for data, place in (
        (changed(name=name), "name"),
        (changed(cables=[{"name": name, "holes": [1, 1]}]), "cables[0].name"),
        (changed(obstacles=[obstacle]), "obstacles[0].name"),
    ):
        error = refused(data)
        assert (error.place, error.value, error.allowed) == (place, name, allowed)


@pytest.mark.parametrize("name", ["a", "A1", "finger_1", "a_", "a" * 64])
def test_good_names(name):
    assert finger_from_dict(changed(name=name)).name == name


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
    ],
)
def test_bad_rest_curvature(value, place):
    assert refused(changed(rest_curvature=value)).place == place


SPHERE = {"type": "sphere", "center": [0, 0, 1], "radius": 0.1}
CYLINDER = {"type": "cylinder", "point": [0, 0, 1], "axis": [0, 1, 0], "radius": 0.1}
BOX = {"type": "box", "center": [0, 0, 1], "size": [1, 1, 1], "orientation": [0, 0, 0, 1]}
PLANE = {"type": "plane", "point": [0, 0, -1], "normal": [0, 0, 1]}
ORIENTATIONS = ([0, 0, 0, 0], [0, 0, 0, 2], [0, 0, 1], [1e200] * 4, "none", [0, 0, 0, math.nan])


@pytest.mark.parametrize(
    ("good", "key", "values"),
    [
        (SPHERE, "center", [1, [0, 0], [0, 0, 0, 0], "abc", [0, 0, None], [0, 0, 1e7]]),
        (SPHERE, "radius", [0, -1, "1", math.inf, True, 1e7]),
        (CYLINDER, "point", [1, [0, 0], [0, math.nan, 0]]),
        (CYLINDER, "axis", [[0, 0, 0], [0, 0, 1e-200], [0, 0], 3, [True, 0, 0]]),
        (CYLINDER, "radius", [0, -1]),
        (BOX, "center", [0, [0]]),
        (BOX, "size", [1, [1, 1], [1, 0, 1], [1, -1, 1], [1, 1, math.inf]]),
        (BOX, "orientation", ORIENTATIONS),
        (BOX, "edge_radius", [0, -0.1, 0.51, "x", math.nan]),
        (PLANE, "point", [[0, 0], 0, [0, 0, "0"]]),
        (PLANE, "normal", [[0, 0, 0], 1]),
    ],
)
def test_bad_obstacle_values(good, key, values):
    finger_from_dict(changed(obstacles=[good]))
    for value in values:
        place = refused(changed(obstacles=[SPHERE, {**good, key: value}])).place
        assert place.startswith(f"obstacles[1].{key}")


@pytest.mark.parametrize("good", [SPHERE, CYLINDER, BOX, PLANE], ids=lambda o: o["type"])
def test_obstacle_keys(good):
    for key in good:
        absent = {k: v for k, v in good.items() if k != key}
        if key == "orientation":
            finger_from_dict(changed(obstacles=[absent]))
        else:
            error = refused(changed(obstacles=[absent]))
            assert isinstance(error, MissingKey) and error.place == f"obstacles[0].{key}"
    error = refused(changed(obstacles=[{**good, "colour": "red"}]))
    assert isinstance(error, UnknownKey) and error.place == "obstacles[0].colour"


@pytest.mark.parametrize("value", ["sphere", {}, SPHERE, False, 0, "", 3])
def test_obstacles_must_be_a_list(value):
    error = refused(changed(obstacles=value))
    assert (error.place, error.allowed) == ("obstacles", "a list")


@pytest.mark.parametrize("kind", ["ball", "Sphere", 3, ["sphere"], {}])
def test_obstacle_types_are_listed(kind):
    error = refused(changed(obstacles=[{"type": kind}]))
    assert (error.place, error.value) == ("obstacles[0].type", kind)
    assert error.allowed == "one of sphere, cylinder, box, plane"


def test_obstacle_names_are_unique_and_made_up_where_absent():
    names = [o.name for o in obstacles_from_list([SPHERE, PLANE, {**SPHERE, "name": "ball"}])]
    assert names == ["sphere_0", "plane_1", "ball"]
    clash = [{**PLANE, "name": "plane_1"}, PLANE]
    assert refused(changed(obstacles=clash)).place == "obstacles[1].name"


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


@settings(derandomize=True, max_examples=80, deadline=None)
@given(data=st.data())
def test_damaged_files_are_refused_in_one_line(data, tmp_path_factory):
    text = bytearray(TEXT.encode())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(text) - 1))
        text[at : at + data.draw(st.integers(0, 3))] = data.draw(st.binary(max_size=3))
    path = tmp_path_factory.getbasetemp() / "damaged.yaml"
    path.write_bytes(bytes(text))
    try:
        load_finger(path)
    except CcrError as error:
        assert "\n" not in str(error) and str(error).startswith(str(path))
