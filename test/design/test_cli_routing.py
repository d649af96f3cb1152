# SPDX-License-Identifier: Apache-2.0
"""`ccr design routing`: shapes in, a finger file that `ccr solve` takes out; bad input."""

from __future__ import annotations

import json

import numpy as np
import pytest

from ccr_ros.cli.main import main
from ccr_ros.model import FingerSolver, load_finger
from ccr_ros.resources import find_config

HELICAL = [7, 8, 9, 10, 11, 12, 1, 2, 3, 4]


@pytest.fixture
def ccr(capsys):
    """Return a function that runs `ccr` and returns exit code, stdout and stderr."""

    def ccr(*words):
        code = main([*map(str, words)])
        out, err = capsys.readouterr()
        return code, out, err

    return ccr


@pytest.fixture
def pose(ccr, tmp_path):
    """The file of a pose that `ccr solve --json` printed: Helical, pulled by 4 %."""
    code, out, _ = ccr("solve", "helical", "--pull", "main=4%", "--json")
    assert code == 0
    path = tmp_path / "pose.json"
    path.write_text(out)
    return path


def test_from_a_printed_pose_to_a_finger_file_that_solve_takes(ccr, pose, tmp_path):
    out_file = tmp_path / "found.yaml"
    code, out, err = ccr(
        "design", "routing", "straight", "--shape", pose, "--pull", "4%", "-o", out_file
    )
    assert (code, err) == (0, "")
    assert " 7  8  9 10 11 12  1  2  3  4" in out and "reached" in out and "written to" in out
    found = load_finger(out_file)
    assert found.cables[0].angles == pytest.approx(
        load_finger(find_config("helical")).cables[0].angles
    )
    code, out, _ = ccr("solve", out_file, "--pull", "main=4%", "--json")
    assert code == 0
    wanted, got = json.loads(pose.read_text()), json.loads(out)
    assert np.array(got["backbone"]) == pytest.approx(np.array(wanted["backbone"]), abs=1e-12)


@pytest.mark.parametrize("unit", ["m", "mm"])
def test_from_a_csv_of_centres_as_json(ccr, pose, tmp_path, unit):
    points = np.array(json.loads(pose.read_text())["backbone"]) * (1e3 if unit == "mm" else 1)
    csv = tmp_path / "centres.csv"
    csv.write_text("x,y,z\n" + "\n".join(",".join(map(repr, p)) for p in points.tolist()))
    code, out, err = ccr(
        "design", "routing", "straight", "--shape", csv, "--unit", unit, "--pull", "4%", "--json"
    )
    assert (code, err) == (0, "")
    result = json.loads(out)
    assert result["reached"] is True and result["alike"] == 1
    assert len(result["candidates"]) == 5
    best = result["candidates"][0]
    assert best["holes"] == {"main": HELICAL} and best["turn"] is None
    assert best["max_error"] < 1e-9 and best["stable"] is True and best["branch_jump"] is False
    errors = [c["rms_error"] for c in result["candidates"]]
    assert errors == sorted(errors)


def test_a_curve_that_no_routing_reaches_is_fitted_with_exit_code_1(ccr, tmp_path):
    out_file, picture = tmp_path / "near.yaml", tmp_path / "near.png"
    code, out, err = ccr(
        "design", "routing", "straight", "--curve", "arc:60", "--pull", "4.6%", "-o", out_file,
        "--plot", picture, "--candidates", "2",
    )  # fmt: skip
    assert (code, err) == (1, "")
    assert "NOT REACHED" in out and "within 0.1 mm" in out and f"drawn in {picture}" in out
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert FingerSolver(load_finger(out_file)).finger.cable_names == ("main",)
    assert "off the wanted shape by 0.7" in out_file.read_text()
    code, _, _ = ccr(
        "design", "routing", "straight", "--curve", "arc:60", "--pull", "4.6%", "--tolerance", "1"
    )
    assert code == 0


def test_free_angles_and_no_frames(ccr, pose):
    words = ("design", "routing", "straight", "--shape", pose, "--pull", "4%", "--json")
    code, out, _ = ccr(*words, "--free", "--no-frames")
    assert code == 0
    best = json.loads(out)["candidates"][0]
    assert best["max_error"] < 1e-9 and best["turn"] is None and len(best["angles"]["main"]) == 10
    code, out, _ = ccr(*words[:-1], "--free")
    assert code == 0 and "hole angles [deg]" in out and "180.0 210.0" in out


def test_two_cables(ccr, tmp_path):
    pose = tmp_path / "pose.json"
    _, out, _ = ccr(
        "solve", "two_cables", "--pull", "straight=2%", "--pull", "helical=2%", "--json"
    )
    pose.write_text(out)
    code, out, _ = ccr(
        "design", "routing", "straight", "--shape", pose, "--cables", "2", "--pull", "2%",
        "--pull", "2%", "--largest-change", "1", "--json",
    )  # fmt: skip
    best = json.loads(out)["candidates"][0]
    assert code == 0
    assert sorted(best["holes"]) == ["first", "second"]
    assert sorted(best["holes"].values()) == [[4] * 10, HELICAL]


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--pull", "4%"), "--shape, --curve: 'neither'"),
        (("--pull", "4%", "--curve", "arc:60", "--shape", "POSE"), "--shape, --curve: 'both'"),
        (("--shape", "POSE"), "--pull"),
        (("--shape", "POSE", "--pull", "much"), "--pull: 'much'"),
        (("--shape", "POSE", "--pull", "nan%"), "--pull: 'nan%'"),
        (("--shape", "POSE", "--pull=-4%"), "pulls[0]: -0.04"),
        (("--shape", "POSE", "--pull", "100%"), "pulls[0]: 1.0"),
        (("--shape", "POSE", "--pull", "4%", "--cables", "2"), "once for each of 2 cables"),
        (("--shape", "POSE", "--pull", "4%", "--cables", "3"), "--cables: '3'"),
        (("--shape", "POSE", *["--pull", "1%"] * 3), "1 to 2 pulls"),
        (("--shape", "POSE", "--pull", "4%", "--candidates", "0"), "--candidates: '0'"),
        (("--shape", "POSE", "--pull", "4%", "--tolerance", "nan"), "--tolerance: 'nan'"),
        (("--shape", "POSE", "--pull", "4%", "--largest-change", "13"), "--largest-change"),
        (("--shape", "POSE", "--pull", "4%", "--largest-change", "1", "--free"), "largest_change"),
        (("--shape", "none.csv", "--pull", "4%"), "none.csv: cannot be read"),
        (("--shape", "POSE", "--pull", "4%", "--plot", "x.txt"), "x.txt"),
        (("--shape", "POSE", "--pull", "4%", "-o", "none/out.yaml"), "cannot be written"),
        (("--curve", "arc:60", "--pull", "50%"), "small enough"),
    ],
)
def test_bad_input_is_one_clear_line(ccr, pose, words, complaint):
    words = [pose if word == "POSE" else word for word in words]
    code, out, err = ccr("design", "routing", "straight", *words)
    assert code == 2 and out == ""
    assert err.startswith("ccr: error: ") and err.count("\n") == 1 and complaint in err


def test_other_fingers_than_the_shape_is_for(ccr, pose, tmp_path):
    code, _, err = ccr("design", "routing", "contact_cylinder", "--shape", pose, "--pull", "2%")
    assert code == 2 and "obstacles" in err
    short = tmp_path / "short.csv"
    short.write_text("\n".join(f"0, 0, {0.02 * i}" for i in range(8)))
    code, _, err = ccr("design", "routing", "straight", "--shape", short, "--pull", "2%")
    assert code == 2 and "10 points, one per disk" in err and "got 8" in err
