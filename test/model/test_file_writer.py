# SPDX-License-Identifier: Apache-2.0
"""Finger files that are written are read back as the same finger."""

from __future__ import annotations

import numpy as np
import pytest

from ccr_ros.model import (
    Box,
    Cable,
    Cylinder,
    Finger,
    InvalidFile,
    InvalidValue,
    Plane,
    Sphere,
    load_finger,
    solve,
)
from ccr_ros.model.file_writer import finger_to_dict, write_finger
from ccr_ros.model.files import finger_from_dict
from ccr_ros.resources import config_names, find_config

from .fingers import helical_cable, make_finger

FINGERS = [name for name in config_names() if not name.startswith("gripper")]


def plain(finger: Finger) -> dict:
    """All that a finger says, in plain values."""
    values = {k: getattr(finger, k) for k in finger.__dataclass_fields__}
    values["rest_curvature"] = finger.rest_curvature.tolist()
    values["cables"] = [(c.name, c.angles.tolist()) for c in finger.cables]
    values["obstacles"] = [
        {k: np.asarray(v).tolist() for k, v in vars(o).items()} for o in finger.obstacles
    ]
    return values


@pytest.mark.parametrize("name", FINGERS)
def test_every_finger_of_the_package_is_the_same_after_writing(name, tmp_path):
    finger = load_finger(find_config(name))
    write_finger(tmp_path / "finger.yaml", finger, f"A copy of {name}.\n\nSecond paragraph.")
    text = (tmp_path / "finger.yaml").read_text()
    assert text.startswith(f"# A copy of {name}.\n#\n# Second paragraph.\nname: ")
    assert plain(load_finger(tmp_path / "finger.yaml")) == plain(finger)


def test_everything_a_finger_can_have(tmp_path):
    rng = np.random.default_rng(1)
    finger = make_finger(
        helical_cable(),
        Cable("free", rng.normal(size=10)),
        Cable("beyond_the_clock", np.full(5, 2 * np.pi)),
        name="Größe 1: #3",
        rest_curvature=rng.normal(size=(9, 4, 3)),
        youngs_modulus=2.8e9,
        holes_per_disk=12,
        obstacles=(
            Sphere([0, 0, 0.3], 0.05, name="ball"),
            Cylinder([0.1, 0, 0.3], [0, 0.6, 0.8], 0.02, name="rod"),
            Box([0, 0.2, 0.1], [0.1, 0.1, 0.2], [0, 0, 0.6, 0.8], name="box"),
            Plane([0, 0, -0.1], [0, 0, 1], name="floor"),
        ),
    )
    write_finger(tmp_path / "finger.yaml", finger)
    again = load_finger(tmp_path / "finger.yaml")
    assert plain(again) == plain(finger)
    data = finger_to_dict(finger)
    assert data["cables"][0] == {"name": "helical", "holes": [7, 8, 9, 10, 11, 12, 1, 2, 3, 4]}
    assert data["cables"][2]["last_disk"] == 4 and "angles" in data["cables"][2]
    pulls = [0.004, 0.002, 0.0]
    assert np.array_equal(solve(again, pulls).backbone, solve(finger, pulls).backbone)


def test_what_is_not_given_is_not_written():
    data = finger_to_dict(make_finger())
    assert not {"rest_curvature", "youngs_modulus", "obstacles"} & set(data)
    assert plain(finger_from_dict(data)) == plain(make_finger())


def test_refused(tmp_path):
    class Odd(Sphere):
        pass

    with pytest.raises(InvalidValue) as caught:
        finger_to_dict(make_finger(obstacles=(Odd([0, 0, 0.3], 0.05),)))
    assert caught.value.place == "obstacles[0]" and "sphere, cylinder, box" in caught.value.allowed
    for path in (tmp_path / "no" / "such.yaml", tmp_path, "a\0b"):
        with pytest.raises(InvalidFile, match="cannot be written"):
            write_finger(path, make_finger())
