# SPDX-License-Identifier: Apache-2.0
"""`ccr design gripper`: the files it writes work, and what it says is what the solver finds."""

from __future__ import annotations

import json

import numpy as np
import pytest
from model.fingers import make_finger, straight_cable

from ccr_ros.cli.main import main
from ccr_ros.model import FingerSolver, load_gripper
from ccr_ros.model.finger_text import write_finger

SPHERE = ["--object", "sphere:0.112", "--center-height", "0.110", "--base-radius", "0.042"]


def design(*words: str) -> int:
    return main(["design", "gripper", *words])


def test_the_files_are_a_gripper_that_reaches_the_sphere(tmp_path, capsys):
    out = tmp_path / "new" / "design"
    assert design(*SPHERE, "--fingers", "2", "--pull", "3%", "--out", str(out)) == 0
    report = capsys.readouterr().out
    assert "finger_1, finger_2: pull main 5.35" in report and "(3.00%)" in report
    assert "stable" in report and "pulling from rest leads there without a jump" in report
    assert {p.name for p in out.iterdir()} == {"gripper_sphere.yaml", "sphere_finger.yaml"}
    text = (out / "sphere_finger.yaml").read_text()
    assert text.startswith("# Pre-bent: pulled by main 5.35")
    assert "# Made by: ccr design gripper --object sphere:0.112 --center-height 0.110" in text
    gripper = load_gripper(out / "gripper_sphere.yaml")
    assert gripper.finger_names == ("finger_1", "finger_2")
    for mounted in gripper.fingers:
        solver = FingerSolver(mounted.finger)
        pose = solver.solve(0.03 * solver.rest_lengths)
        disks = mounted.base.points(pose.backbone)
        distances = np.linalg.norm(disks - [0, 0, 0.110], axis=1)
        assert np.allclose(distances[5:], 0.064, atol=1e-8)


@pytest.mark.long
def test_box_pictures_parts_and_json(tmp_path, capsys):
    pytest.importorskip("matplotlib")
    trimesh = pytest.importorskip("trimesh")
    pytest.importorskip("manifold3d")
    words = ["--object", "box:0.06x0.07x0.14", "--center-height", "0.13", "--base-radius", "0.045"]
    words += ["--fingers", "4", "--pull", "main=0.0055", "--name", "crate", "--json"]
    words += ["--plot", f"{tmp_path}/p.png", "--strip", f"{tmp_path}/s.png"]
    words += ["--replay", f"{tmp_path}/r.html", "--print", f"{tmp_path}/parts"]
    assert design(*words, "--out", str(tmp_path)) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["gripper"] == "crate" and found["reached"]
    assert found["files"] == [
        str(tmp_path / n) for n in ("crate.yaml", "crate_finger_1.yaml", "crate_finger_2.yaml")
    ]
    one, two, three, four = found["fingers"]
    assert one["pose"]["backbone"] == three["pose"]["backbone"] != two["pose"]["backbone"]
    assert two["name"] == "finger_2" and two["touching"] == four["touching"] != []
    assert one["pose"]["pulls"]["main"] == pytest.approx(0.0055, abs=1e-9)
    files = {m.finger.name: m.finger for m in load_gripper(tmp_path / "crate.yaml").fingers}
    a, b, c = (files[f"finger_{k}"].rest_curvature for k in (1, 2, 3))
    assert np.array_equal(a, c) and not np.array_equal(a, b)
    for name in ("crate_finger_1", "crate_finger_2"):
        assert trimesh.load(tmp_path / "parts" / f"{name}.stl").is_watertight
        assert (tmp_path / "parts" / f"{name}_holes.csv").is_file()
    assert (tmp_path / "p.png").stat().st_size > 20_000
    assert (tmp_path / "s.png").stat().st_size > 20_000
    assert "</html>" in (tmp_path / "r.html").read_text()


def test_what_is_not_stable_ends_with_1_and_says_so(tmp_path, capsys):
    words = ["--fingers", "2", "--pull", "3%", "--press", "1.2", "--out", str(tmp_path)]
    assert design(*SPHERE, *words) == 1
    report = capsys.readouterr().out
    assert "NOT STABLE" in report and "reached, but not stable from" in report


def test_no_rest_shape_ends_with_1_and_writes_nothing(tmp_path, capsys):
    assert design(*SPHERE, "--pull", "50%", "--out", str(tmp_path)) == 1
    assert "no rest shape leads to the contour" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--object", "cone:1", "--pull", "3%"], "unknown object 'cone:1'; valid: sphere"),
        (
            ["--pull", "3%", "--fingers", "x"],
            "--fingers: 'x' is not allowed; must be an integer 2..12",
        ),
        (["--pull", "3%", "--fingers", "1"], "--fingers: '1' is not allowed"),
        (["--pull", "3%", "--base-radius", "4cm"], "--base-radius: '4cm'"),
        (["--pull", "3%", "--base-radius", "nan"], "--base-radius: 'nan'"),
        (["--pull", "three"], "--pull main: 'three'"),
        (["--pull=-5%"], "pulls: {'main': -0.05} is not allowed"),
        (["--pull", "thumb=3%"], "unknown cable 'thumb'"),
        (["--pull", "3%", "--pull", "main=2%"], "given once per cable"),
        (["--pull", "3%", "--finger", "two_cables"], "CABLE=3%, CABLE one of straight, helical"),
        (["--pull", "3%", "--finger", "gripper_sphere"], "describes a gripper"),
        (["--pull", "3%", "--length", "0"], "--length: '0'"),
        (["--pull", "3%", "--center-height", "0.05"], "6 mm below the base plane"),
        (["--pull", "3%", "--name", "my gripper"], "name: 'my gripper'"),
        (["--pull", "3%", "--plot", "p.txt"], "plot file: 'p.txt'"),
        (["--pull", "3%", "--hole-diameter", "0"], "hole_diameter: 0.0"),
        (["--pull", "3%", "--finger", "{sideways}"], "a cable hole at 0 or 180 deg of disk"),
    ],
)
def test_bad_input(words, message, tmp_path, capsys):
    sideways = write_finger(make_finger(straight_cable(4)), tmp_path / "sideways.yaml")
    words = [w.replace("{sideways}", str(sideways)) for w in words]
    assert design(*SPHERE, *words, "--out", str(tmp_path / "out")) == 2
    error = capsys.readouterr().err
    assert error.startswith("ccr: error: ") and message in error and error.count("\n") == 1
    assert not (tmp_path / "out").exists()
