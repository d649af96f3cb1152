# SPDX-License-Identifier: Apache-2.0
"""Servo files: the one that comes along, defaults, and every error with its place."""

import math
from dataclasses import fields, replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from racks import joint, rack

from ccr_ros.actuation.rack import ServoJoint, load_servos
from ccr_ros.model import InvalidFile, InvalidValue, UnknownName, load_gripper
from ccr_ros.resources import config_dir, find_config

GRIPPER = load_gripper(find_config("gripper_sphere"))
NUMBERS = (
    "{spool_radius: 0.01, travel: [0, 0.01], max_rate: 0.02, max_acceleration: 0.1, max_tension: 9}"
)


def written(tmp_path, joints, defaults=NUMBERS, name="some"):
    path = tmp_path / "servos.yaml"
    path.write_text(f"name: {name}\ndefaults: {defaults}\njoints:\n{joints}", encoding="utf-8")
    return path


def three(first="{finger: finger_1, cable: main}"):
    others = "".join(f"  - {{finger: finger_{i}, cable: main}}\n" for i in (2, 3))
    return f"  - {first}\n{others}"


def test_the_file_that_comes_along_fits_its_gripper():
    servos = load_servos(find_config("servos_sphere"), GRIPPER)
    assert servos.names == ("finger_1_main", "finger_2_main", "finger_3_main")
    assert [j.id for j in servos.joints] == [1, 2, 3]
    # The paper's pull, 3 % of the finger, is within the travel.
    assert all(j.travel[1] > 0.03 * 0.182 for j in servos.joints)


def test_defaults_and_what_joints_say_themselves(tmp_path):
    first = "{finger: finger_1, cable: main, spool_radius: 0.02, direction: -1, id: 7}"
    one, two, _ = load_servos(written(tmp_path, three(first)), GRIPPER).joints
    assert (one.spool_radius, one.direction, one.id, one.max_tension) == (0.02, -1, 7, 9.0)
    assert (two.spool_radius, two.direction, two.id) == (0.01, 1, None)
    assert two.cable_stiffness == math.inf


@pytest.mark.parametrize(
    ("first", "text"),
    [
        ("{cable: main}", r"joints\[0\]\.finger: missing"),
        ("{finger: finger_9, cable: main}", r"joints\[0\]\.finger: 'finger_9'.*finger_1, finger_2"),
        ("{finger: finger_1, cable: tip}", r"joints\[0\]\.cable: 'tip'.*main"),
        ("{finger: finger_1, cable: main, gaer: 2}", r"joints\[0\]\.gaer: unknown.*'gear'"),
        ("{finger: finger_1, cable: main, id: 3.5}", r"joints\[0\]\.id: 3\.5"),
        ("{finger: finger_1, cable: main, spool_radius: 0}", r"joints\[0\]\.spool_radius: 0"),
        ("{finger: finger_1, cable: main, direction: 0}", r"joints\[0\]\.direction: 0"),
        ("{finger: finger_1, cable: main, travel: [0.001, 0.01]}", r"joints\[0\]\.travel"),
        ("{finger: finger_1, cable: main, travel: [0, .nan]}", r"joints\[0\]\.travel\[1\]: nan"),
        ("{finger: finger_1, cable: main, offset: 0.02}", r"joints\[0\]\.offset: 0\.02"),
        ("{finger: finger_2, cable: main}", r"joints\[1\]\.name: 'finger_2_main'.*unique"),
        ("finger_1", r"joints\[0\]: 'finger_1'.*a mapping"),
    ],
)
def test_errors_are_located(tmp_path, first, text):
    path = written(tmp_path, three(first))
    with pytest.raises(InvalidValue, match=text) as caught:
        load_servos(path, GRIPPER)
    assert str(caught.value).startswith(f"{path}: ")


@pytest.mark.parametrize(
    ("content", "text"),
    [
        ({"joints": three(), "defaults": "{id: 3}"}, "defaults.id: unknown key"),
        ({"joints": three(), "defaults": "{}"}, r"joints\[0\].max_acceleration: missing"),
        ({"joints": three(), "name": "a/b"}, "name: 'a/b'"),
        ({"joints": "  - {finger: finger_1, cable: main}\n"}, "'main' of 'finger_2' has no"),
        ({"joints": "  7\n"}, "joints: 7"),
    ],
)
def test_errors_of_the_whole(tmp_path, content, text):
    with pytest.raises(InvalidValue, match=text):
        load_servos(written(tmp_path, **content), GRIPPER)


def test_same_bus_number_twice(tmp_path):
    joints = "".join(f"  - {{finger: finger_{i}, cable: main, id: 4}}\n" for i in (1, 2, 3))
    with pytest.raises(InvalidValue, match=r"joints\[1\]\.id: 4"):
        load_servos(written(tmp_path, joints), GRIPPER)


def test_a_file_that_is_none(tmp_path):
    with pytest.raises(InvalidFile, match="cannot be read"):
        load_servos(tmp_path / "none.yaml", GRIPPER)
    with pytest.raises(InvalidValue, match="fingers: unknown key"):
        load_servos(config_dir() / "gripper_sphere.yaml", GRIPPER)


NUMERIC = [f.name for f in fields(ServoJoint) if f.name not in ("finger", "cable", "travel")]


@given(st.sampled_from(NUMERIC), st.sampled_from([math.nan, -math.inf, "much", [1.0], True, -1e9]))
def test_no_number_is_taken_unchecked(key, value):
    with pytest.raises(InvalidValue) as caught:
        replace(joint(), **{key: value})
    assert caught.value.place == key


def test_places_of_joints():
    pair = rack()
    assert pair.of_finger("index", ("main",)) == (1,)
    with pytest.raises(UnknownName, match="thumb_main, index_main"):
        pair.index("thumb_tip")
