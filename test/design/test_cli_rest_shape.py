# SPDX-License-Identifier: Apache-2.0
"""`ccr design rest-shape`: what it writes, prints and draws, and how it ends."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from ccr_ros.cli.main import main
from ccr_ros.model import load_finger
from ccr_ros.model.finger_text import write_finger
from ccr_ros.resources import find_config
from design.shapes import SPHERE, on_curve
from design.test_rest_shape import sphere_finger


@pytest.fixture
def ccr(capsys):
    """Return a function that runs `ccr` and returns exit code, stdout and stderr."""

    def ccr(*words):
        code = main([str(word) for word in words])
        out, err = capsys.readouterr()
        return code, out, err

    return ccr


def test_the_file_it_writes_is_solved_into_the_wanted_shape(ccr, tmp_path):
    path = tmp_path / "out.yaml"
    words = ["sphere_finger", "--curve", SPHERE, "--pull", "main=3%", "-o", path]
    code, out, err = ccr("design", "rest-shape", *words)
    assert (code, err) == (0, "")
    assert "rest shape 1 of 1" in out and "3.00% of rest; tension 5.55 N" in out
    assert "reached from rest in 10 steps" in out and f"written to {path}" in out
    rows = [line.split() for line in out.splitlines() if line.split()[:1] == ["9"]]
    shape = on_curve(SPHERE, load_finger(find_config("sphere_finger")))
    assert [float(v) for v in rows[0][4:7]] == pytest.approx(shape.points[-1] * 1e3, abs=1e-3)

    head = path.read_text().splitlines()[:3]
    assert head[0].startswith("# Rest shape by `ccr design rest-shape`")
    assert SPHERE in head[0] and "main 5.3516 mm (3.0000%)" in head[1]
    assert "reached from rest" in head[2]
    code, out, _ = ccr("solve", path, "--pull", "main=3%", "--json")
    pose = json.loads(out)
    assert code == 0 and shape.squared_error(np.array(pose["backbone"])) <= 1e-16


def test_json_lists_every_pull(ccr):
    words = ["helical", "--curve", "helix:0.02,turns=1", "--pull", "main=2%,0.006", "--json"]
    code, out, err = ccr("design", "rest-shape", *words)
    result = json.loads(out)
    assert (code, err) == (0, "") and out.count("\n") == 1
    assert result["reached"] is True and result["refused"] == [] and result["best"] == 0
    first, second = result["shapes"]
    assert first["pulls"]["main"] / first["rest_lengths"]["main"] == pytest.approx(0.02)
    assert second["pulls"]["main"] == pytest.approx(0.006)
    for shape in (first, second):
        assert shape["stable"] and shape["forward"]["reached"] and not shape["forward"]["jumps"]
        assert shape["forward"]["squared_error"] <= 1e-16
        assert np.shape(shape["rest_curvature"]) == (9, 4, 3)
        assert shape["backbone"] == pytest.approx(np.array(result["wanted"]), abs=1e-9)
        assert shape["rest_gap"] is None and shape["contacts"] == []


def test_presses_on_the_files_obstacles(ccr, tmp_path):
    from design.test_rest_shape import BALL

    path = write_finger(sphere_finger(obstacles=(BALL,)), tmp_path / "ball.yaml")
    words = ["--curve", SPHERE, "--pull", "main=3%", "--press", "7=0.1"]
    words += ["--press", "9:cable.main=0.05", "--steps", "4"]
    code, out, _ = ccr("design", "rest-shape", path, *words)
    assert code == 0
    assert "disk 7, cable of main, presses on ball: 0.1 N" in out
    assert "disk 9, cable of main, presses on ball: 0.05 N" in out


def test_a_pose_as_the_shape(ccr, tmp_path):
    code, out, _ = ccr("solve", "helical", "--pull", "main=4%", "--json")
    pose = tmp_path / "pose.json"
    pose.write_text(out)
    words = ["straight", "--shape", pose, "--pull", "main=3%", "--json"]
    code, out, _ = ccr("design", "rest-shape", *words)
    assert code == 0 and json.loads(out)["shapes"][0]["forward"]["reached"]


def test_what_is_not_reached_gives_exit_code_1(ccr):
    words = ["sphere_finger", "--curve", SPHERE, "--pull", "main=60%"]
    code, out, err = ccr("design", "rest-shape", *words)
    assert (code, err) == (1, "")
    assert "no rest shape: no tensions give these pulls" in out and "% at most" in out
    code, out, _ = ccr("design", "rest-shape", *words, "--json")
    result = json.loads(out)
    assert code == 1 and result["shapes"] == [] and result["best"] is None
    assert "at most" in result["refused"][0]


def test_constant_curvature_is_a_best_fit_whose_error_is_told(ccr, tmp_path):
    path = tmp_path / "out.yaml"
    words = ["sphere_finger", "--curve", SPHERE, "--pull", "main=3%", "--rest", "constant"]
    code, out, _ = ccr("design", "rest-shape", *words, "-o", path)
    assert code == 1 and "NOT REACHED from rest" in out and "RMS 0.0124 mm" in out
    assert "best fit: from 2.1 mm2 to 0.0014 mm2" in out
    assert np.shape(load_finger(path).rest_curvature) == (9, 3)
    code, out, _ = ccr("design", "rest-shape", *words, "--tolerance", "0.01", "--json")
    result = json.loads(out)
    assert code == 0 and result["reached"] is True
    (shape,) = result["shapes"]
    assert shape["forward"]["tolerance"] == pytest.approx(1e-8)
    assert shape["fit"]["optimal"] and shape["fit"]["first_error"] > 1e-6


def test_a_bound_that_equilibrium_breaks_and_a_fit_keeps(ccr):
    words = ["sphere_finger", "--curve", SPHERE, "--pull", "main=3%", "--max-curvature", "12"]
    code, out, _ = ccr("design", "rest-shape", *words)
    assert code == 1 and "13.09 1/m at rest, more than the 12 1/m allowed" in out
    code, out, _ = ccr("design", "rest-shape", *words, "--fit", "--steps", "3")
    assert code == 0 and "rest bends by 12 1/m at most" in out
    assert "bend as far as allowed" in out


def test_a_shape_in_an_obstacle_is_refused_with_the_way_out(ccr, tmp_path):
    from design.test_rest_shape import BALL

    finger = sphere_finger(obstacles=(replace(BALL, radius=0.058),))
    path = write_finger(finger, tmp_path / "ball.yaml")
    words = [path, "--curve", SPHERE, "--pull", "main=3%"]
    code, _, err = ccr("design", "rest-shape", *words)
    assert code == 2 and "clear of obstacle 'ball'" in err and "--fit, finds the nearest" in err
    code, out, _ = ccr("design", "rest-shape", *words, "--fit", "--steps", "3")
    assert code == 1 and "NOT REACHED" in out and "a least error" in out


def test_plot_draws_a_picture(ccr, tmp_path):
    pytest.importorskip("matplotlib")
    path = tmp_path / "found.png"
    words = ["sphere_finger", "--curve", "arc:60", "--pull", "main=3%", "--plot", path]
    code, out, _ = ccr("design", "rest-shape", *words)
    assert code == 0 and f"drawn in {path}" in out
    assert path.read_bytes().startswith(b"\x89PNG") and path.stat().st_size > 20_000


CURVE = ["--curve", "arc:60"]


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["straight", *CURVE], "--pull: None is not allowed; must be given"),
        (["straight", "--pull", "main=3%"], "--shape, --curve: 'neither'"),
        (["straight", *CURVE, "--shape", "a.csv", "--pull", "main=3%"], "'both'"),
        (["straight", *CURVE, "--pull", "main"], "--pull: 'main' is not allowed"),
        (["straight", *CURVE, "--pull", "main="], "--pull main: ''"),
        (["straight", *CURVE, "--pull", "main=3%,"], "--pull main: ''"),
        (["straight", *CURVE, "--pull", "main=nan"], "--pull main: 'nan'"),
        (["straight", *CURVE, "--pull", "main=100%"], "pulls.main: 1.0"),
        (["straight", *CURVE, "--pull", "no=3%"], "unknown cable 'no'; valid: main"),
        (["straight", *CURVE, "--pull", "main=3%", "--pull", "main=4%"], "given once per cable"),
        (["straight", *CURVE, "--pull", "main=" + "3%," * 100 + "3%"], "at most 100 combinations"),
        (["straight", *CURVE, "--pull", "main=3%", "--press", "7"], "--press: '7'"),
        (["straight", *CURVE, "--pull", "main=3%", "--press", "7:=1"], "--press: '7:=1'"),
        (["straight", *CURVE, "--pull", "main=3%", "--press", "x=1"], "--press: 'x'"),
        (["straight", *CURVE, "--pull", "main=3%", "--press", "7=-1"], "--press: '-1'"),
        (["straight", *CURVE, "--pull", "main=3%", "--press", "7:rim=1"], "unknown point 'rim'"),
        (["straight", *CURVE, "--pull", "main=3%", "--press", "7=1"], "with an obstacle"),
        (["straight", *CURVE, "--pull", "main=3%", "--steps", "0"], "--steps: '0'"),
        (["straight", *CURVE, "--pull", "main=3%", "--max-curvature", "-1"], "--max-curvature"),
        (["straight", *CURVE, "--pull", "main=3%", "--max-curvature", "999"], "max_curvature"),
        (["straight", *CURVE, "--pull", "main=3%", "--tolerance", "-1"], "--tolerance: '-1'"),
        (["straight", *CURVE, "--pull", "main=3%", "--fit", "--press", "7=1"], "left out of a"),
        (["straight", *CURVE, "--pull", "main=3%", "--plot", "a.xyz"], "'a.xyz'"),
        (["straight", *CURVE, "--pull", "main=3%", "-o", "no/such/a.yaml"], "cannot be written"),
        (["straight", "--curve", "arc:no", "--pull", "main=3%"], "'no' is not allowed"),
        (["straight", "--curve", "knot", "--pull", "main=3%"], "unknown curve 'knot'"),
        (["strait", *CURVE, "--pull", "main=3%"], "unknown config file 'strait'"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(ccr, words, complaint):
    code, out, err = ccr("design", "rest-shape", *words)
    assert code == 2 and out == ""
    assert err.startswith("ccr: error: ") and complaint in err and err.count("\n") == 1
