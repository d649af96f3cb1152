# SPDX-License-Identifier: Apache-2.0
"""Gripper files: what they give, and where their errors point."""

import numpy as np
import pytest
import yaml

from ccr_ros.model import InvalidFile, InvalidValue, load_gripper
from ccr_ros.model.errors import MissingKey, UnknownKey

FINGER = {
    "length": 0.1,
    "segments": 2,
    "disk_radius": 0.008,
    "backbone_diameter": 0.0025,
    "poisson_ratio": 0.39,
    "cables": [{"name": "main", "holes": [1, 2, 12]}],
}


def entry(name="left", **keys):
    result = {"name": name, "base": {"position": [0, 0, 0]}, "finger": FINGER, **keys}
    return {key: value for key, value in result.items() if value != "absent"}


@pytest.fixture
def write(tmp_path):
    def write(*fingers, name="gripper.yaml", **keys):
        path = tmp_path / name
        path.write_text(yaml.safe_dump({"name": "g", "fingers": list(fingers), **keys}))
        return path

    return write


def test_fingers_in_place_and_in_files(write, tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "one.yaml").write_text(yaml.safe_dump({"name": "one", **FINGER}))
    base = {"position": [0.1, 0, 0], "orientation": [0, 0, 1, 0]}
    path = write(entry(), entry("right", base=base, finger="absent", file="parts/one.yaml"))
    gripper = load_gripper(path)
    assert gripper.name == "g" and gripper.finger_names == ("left", "right")
    left, right = gripper.fingers
    assert right.finger.length == left.finger.length == 0.1
    assert left.base.orientation.tolist() == [0, 0, 0, 1]
    np.testing.assert_allclose(right.base.points(np.array([0.02, 0, 0])), [0.08, 0, 0], atol=1e-15)


@pytest.mark.parametrize(
    ("bad", "place", "value", "allowed"),
    [
        (entry(file="one.yaml"), "", ["base", "file", "finger", "name"], "exactly one of"),
        (entry(finger="absent"), "", ["base", "name"], "exactly one of 'file' and 'finger'"),
        (entry(finger="absent", file=3), ".file", 3, "a path relative to the gripper file"),
        (entry(finger=[1]), ".finger", [1], "a mapping"),
        (entry(finger={**FINGER, "length": -1}), ".finger.length", -1, ">= 1e-06 and <= 1000 [m]"),
        (
            entry(finger={**FINGER, "cables": [{"name": "m", "holes": [1, 13, 1]}]}),
            ".finger.cables[0].holes[1]",
            13,
            "an integer 1..12",
        ),
        (entry(name="a/b"), ".name", "a/b", "letters, digits and single '_'"),
        (entry(name="right"), ".name", "right", "unique in its gripper"),
        (entry(base=[0, 0, 0]), ".base", [0, 0, 0], "a mapping"),
        (entry(base={"position": [0, 0]}), ".base.position", [0, 0], "3 finite numbers [m]"),
        (
            entry(base={"position": [0, 0, 0], "orientation": [0, 0, 0, 0]}),
            ".base.orientation",
            [0, 0, 0, 0],
            "a unit quaternion (x, y, z, w); its length is 0",
        ),
        ("left", "", "left", "a mapping"),
    ],
)
def test_errors_say_file_place_value_and_range(write, bad, place, value, allowed):
    path = write(entry("right"), bad)
    with pytest.raises(InvalidValue) as caught:
        load_gripper(path)
    error = caught.value
    assert error.source == str(path)
    assert error.place == f"fingers[1]{place}"
    assert error.value == value
    assert allowed in error.allowed
    assert str(error).startswith(f"{path}: fingers[1]{place}: ") and "\n" not in str(error)


@pytest.mark.parametrize(
    ("bad", "kind", "place"),
    [
        (entry(colour=1), UnknownKey, ".colour"),
        (entry(base="absent"), MissingKey, ".base"),
        (entry(base=None), MissingKey, ".base"),
        (entry(name="absent"), MissingKey, ".name"),
        (entry(base={"orientation": [0, 0, 0, 1]}), MissingKey, ".base.position"),
        (entry(base={"position": [0, 0, 0], "pose": 1}), UnknownKey, ".base.pose"),
        (entry(finger={**FINGER, "lenght": 1}), UnknownKey, ".finger.lenght"),
        (entry(finger={**FINGER, "length": None}), MissingKey, ".finger.length"),
    ],
)
def test_keys_of_a_finger(write, bad, kind, place):
    with pytest.raises(kind) as caught:
        load_gripper(write(bad))
    assert caught.value.place == f"fingers[0]{place}"


@pytest.mark.parametrize("fingers", [None, [], {}, "left", 3])
def test_fingers_must_be_a_list_of_some(write, fingers):
    with pytest.raises(InvalidValue) as caught:
        load_gripper(write(**{"fingers": fingers}))
    assert caught.value.place == "fingers"


def test_keys_of_the_gripper(write):
    with pytest.raises(UnknownKey) as caught:
        load_gripper(write(entry(), finger=[]))
    assert caught.value.place == "finger" and "did you mean 'fingers'?" in str(caught.value)
    with pytest.raises(InvalidValue) as caught:
        load_gripper(write(entry(), name_="x", name="gripper.yaml"))
    assert caught.value.place == "name_"


def test_a_missing_finger_file_is_named_with_the_place_that_names_it(write, tmp_path):
    path = write(entry(), entry("right", finger="absent", file="nope.yaml"))
    with pytest.raises(InvalidFile) as caught:
        load_gripper(path)
    assert caught.value.path == str(tmp_path / "nope.yaml")
    assert caught.value.reason == (
        f"cannot be read: No such file or directory (named by {path}: fingers[1].file)"
    )


def test_an_error_in_a_finger_file_points_into_that_file(write, tmp_path):
    file = tmp_path / "one.yaml"
    file.write_text(yaml.safe_dump({"name": "one", **FINGER, "segments": 1}))
    with pytest.raises(InvalidValue) as caught:
        load_gripper(write(entry(finger="absent", file="one.yaml")))
    assert (caught.value.source, caught.value.place) == (str(file), "segments")


def test_a_gripper_that_names_itself_as_a_finger_is_refused(write):
    with pytest.raises(InvalidValue, match="fingers: unknown key"):
        load_gripper(write(entry(finger="absent", file="gripper.yaml")))


def test_a_finger_file_is_no_gripper_file(tmp_path):
    path = tmp_path / "one.yaml"
    path.write_text(yaml.safe_dump({"name": "one", **FINGER}))
    with pytest.raises(InvalidFile, match=r"describes a finger .* a gripper file is wanted"):
        load_gripper(path)
