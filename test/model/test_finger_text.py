# SPDX-License-Identifier: Apache-2.0
"""Finger files that are written: reading one gives the finger that was written."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from ccr_ros.model import Box, Cable, Cylinder, InvalidFile, Plane, Sphere, load_finger
from ccr_ros.model.finger_text import finger_text, finger_to_dict, write_finger
from ccr_ros.resources import config_dir
from model.fingers import make_finger

FINGER_FILES = sorted(p for p in config_dir().glob("*.yaml") if "cables:" in p.read_text())


def assert_same(a: object, b: object) -> None:
    assert type(a) is type(b)
    for field in fields(a):
        x, y = getattr(a, field.name), getattr(b, field.name)
        if field.name in ("cables", "obstacles"):
            assert len(x) == len(y)
            for p, q in zip(x, y, strict=True):
                assert_same(p, q)
        elif isinstance(x, np.ndarray):
            np.testing.assert_allclose(x, y, rtol=0, atol=1e-12)
        else:
            assert x == y


@pytest.mark.parametrize("path", FINGER_FILES, ids=lambda p: p.stem)
def test_every_finger_of_config_comes_back(path, tmp_path):
    finger = load_finger(path)
    assert_same(load_finger(write_finger(finger, tmp_path / "out.yaml")), finger)


def test_a_finger_with_everything_comes_back(tmp_path):
    finger = make_finger(
        Cable("free", np.array([0.1, -0.2, 7.3])),
        Cable.from_holes("holes", [1, 8, 3, 4, 5, 6, 7, 2, 1, 8], 8),
        name="Ünit finger, 2",
        holes_per_disk=8,
        youngs_modulus=2.8e9,
        rest_curvature=np.linspace(-3, 1 / 3, 27).reshape(9, 3),
        obstacles=(
            Sphere(np.array([0.05, 0, 0.1]), 0.01, name="ball"),
            Cylinder(np.array([0.05, 0, 0.1]), np.array([0, 1, 0]), 1e-5, name="rod, thin"),
            Plane(np.array([-0.05, 0, 0]), np.array([1, 0, 0]), name="wall"),
            Box(np.array([0.1, 0, 0.1]), np.array([0.02, 0.03, 0.04]), name="box"),
        ),
    )
    path = write_finger(finger, tmp_path / "out.yaml", "first line\n\nthird: line")
    assert_same(load_finger(path), finger)
    assert path.read_text().startswith("# first line\n#\n# third: line\nname: ")


def test_what_is_default_is_not_written():
    data = finger_to_dict(make_finger())
    assert not {"youngs_modulus", "rest_curvature", "obstacles"} & set(data)
    assert data["cables"] == [{"name": "helical", "holes": [7, 8, 9, 10, 11, 12, 1, 2, 3, 4]}]


def test_angles_beyond_a_turn_are_holes_too():
    turned = Cable("c", np.array([2 * np.pi, -np.pi / 6, 13 * np.pi / 6]))
    assert finger_to_dict(make_finger(turned))["cables"] == [{"name": "c", "holes": [1, 12, 2]}]


def test_text_is_for_people():
    lines = finger_text(replace(make_finger(), rest_curvature=np.ones((9, 3)))).splitlines()
    assert "length: 0.182" in lines and "- [1.0, 1.0, 1.0]" in lines


def test_a_place_that_cannot_be_written(tmp_path):
    for path in (tmp_path, tmp_path / "none" / "out.yaml", "a\0b"):
        with pytest.raises(InvalidFile, match="cannot be written"):
            write_finger(make_finger(), path)
