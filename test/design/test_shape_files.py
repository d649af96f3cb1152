# SPDX-License-Identifier: Apache-2.0
"""Wanted shapes from files: CSV of disk centres, and poses of `ccr solve --json`."""

from __future__ import annotations

import json

import numpy as np
import pytest
from model.fingers import make_finger

from ccr_ros.design.shape_files import load_shape
from ccr_ros.model import InvalidFile, InvalidValue, solve

POSE = solve(make_finger(), [0.006])


def written(path, points) -> str:
    path.write_text("\n".join(", ".join(repr(float(x)) for x in p) for p in points))
    return str(path)


def test_csv_of_centres(tmp_path):
    path = written(tmp_path / "centres.csv", POSE.backbone)
    shape = load_shape(path)
    assert np.array_equal(shape.points, POSE.backbone)
    assert shape.frames is None and shape.tangents is None
    in_mm = written(tmp_path / "mm.csv", POSE.backbone * 1e3)
    assert load_shape(in_mm, "mm").points == pytest.approx(POSE.backbone, abs=1e-15)


def test_a_base_measured_beside_the_origin_is_put_there(tmp_path):
    points = POSE.backbone.copy()
    points[0] = [2e-4, -1e-4, 1e-4]
    assert np.array_equal(load_shape(written(tmp_path / "c.csv", points)).points, POSE.backbone)
    points[0] = [5e-3, 0, 0]
    with pytest.raises(InvalidValue, match=r"points\[0\].*at the base.*5 mm away"):
        load_shape(written(tmp_path / "c.csv", points))


def test_a_printed_pose(tmp_path):
    path = tmp_path / "pose.json"
    path.write_text(json.dumps(POSE.to_dict()))
    shape = load_shape(path)
    assert np.array_equal(shape.points, POSE.backbone)
    assert shape.frames == pytest.approx(POSE.frames, abs=1e-12)
    assert load_shape(path, frames=False).frames is None


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("{", "is not JSON"),
        ("[" * 5000, "is not JSON"),
        ("[1]", "has no 'backbone'"),
        ('{"frames": []}', "has no 'backbone'"),
    ],
)
def test_what_is_no_pose(tmp_path, text, reason):
    path = tmp_path / "pose.json"
    path.write_text(text)
    with pytest.raises(InvalidFile, match=reason):
        load_shape(path)


@pytest.mark.parametrize(
    ("change", "place"),
    [
        ({"backbone": 3}, "points"),
        ({"backbone": [[0, 0, 0], [0, 0, 1]]}, "points"),
        ({"backbone": [[0, 0, 0], [0, 0, float("nan")], [0, 0, 1]]}, r"points\[1\]\[2\]"),
        ({"backbone": [[0, 0, 0], [0, 0, "x"], [0, 0, 1]]}, "points"),
        ({"frames": 1}, "frames"),
        ({"frames": [[0, 0, 0, 1]]}, "frames"),
        ({"frames": [[0, 0, 0, 2]] * 10}, r"frames\[0\]"),
        ({"frames": [[0, 0, 1]] * 10}, r"frames\[0\]"),
    ],
)
def test_poses_that_hold_something_else_name_file_and_place(tmp_path, change, place):
    path = tmp_path / "pose.json"
    path.write_text(json.dumps(POSE.to_dict() | change))
    with pytest.raises(InvalidValue, match=f"pose.json: {place}"):
        load_shape(path)


def test_files_and_units_that_are_none(tmp_path):
    with pytest.raises(InvalidFile, match="cannot be read"):
        load_shape(tmp_path / "none.csv")
    with pytest.raises(InvalidFile, match="cannot be read"):
        load_shape(tmp_path / "none.json")
    with pytest.raises(InvalidValue, match="unit"):
        load_shape(tmp_path / "none.csv", "inch")
    with pytest.raises(InvalidFile, match="line 2"):
        path = tmp_path / "bad.csv"
        path.write_text("0, 0, 0\n0, 0, nan\n")
        load_shape(path)
