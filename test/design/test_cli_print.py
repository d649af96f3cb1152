# SPDX-License-Identifier: Apache-2.0
"""`ccr design print`: what it writes and says, and how it ends."""

from __future__ import annotations

import numpy as np
import pytest
from model.fingers import make_finger, straight_cable

from ccr_ros.cli.main import main
from ccr_ros.model.finger_text import write_finger

pytest.importorskip("manifold3d", reason="manifold3d, of the extra 'print', is not installed")
trimesh = pytest.importorskip("trimesh", reason="trimesh, of the extra 'print', is not installed")


def test_it_writes_tables_and_a_solid(tmp_path, capsys):
    finger = make_finger(straight_cable(4, 4), segments=3, length=0.06, name="my finger, v2")
    file = write_finger(finger, tmp_path / "f.yaml")
    out = tmp_path / "new" / "parts"
    words = ["--disk-thickness", "0.003", "--base-plate", "0.04", "--routed-holes"]
    assert main(["design", "print", str(file), "--out", str(out), *words]) == 0
    names = {"backbone.csv", "disks.csv", "holes.csv"}
    assert {p.name for p in out.iterdir()} == {f"my_finger_v2_{n}" for n in names} | {
        "my_finger_v2.stl"
    }
    mesh = trimesh.load(out / "my_finger_v2.stl")
    assert mesh.is_watertight
    assert np.allclose(mesh.bounds, [[-20, -20, -5.5], [20, 20, 61.5]], atol=1e-5)
    assert mesh.euler_number == 2 - 2 * 4
    printed = capsys.readouterr().out
    assert "4 disks of 18.5 mm, 4 holes" in printed and "within 40 x 40 x 67 mm" in printed
    assert str(out / "my_finger_v2.stl") in printed


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["no_such"], "unknown config file 'no_such'"),
        (["straight", "--hole-diameter", "1mm"], "--hole-diameter: '1mm' is not allowed"),
        (["straight", "--hole-diameter", "0.05"], "hole_diameter: 0.05 is not allowed"),
        (["straight", "--base-plate", "nan"], "--base-plate: 'nan'"),
        (["straight", "--out", "{file}/x"], "cannot be made a folder"),
    ],
)
def test_bad_input(words, message, tmp_path, capsys):
    file = tmp_path / "file"
    file.touch()
    words = [w.replace("{file}", str(file)) for w in words]
    if "--out" not in words:
        words += ["--out", str(tmp_path)]
    assert main(["design", "print", *words]) == 2
    error = capsys.readouterr().err
    assert error.startswith("ccr: error: ") and message in error and error.count("\n") == 1
