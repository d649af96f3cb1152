# SPDX-License-Identifier: Apache-2.0
"""`ccr design pulls`, as typed by a person and as read by a program."""

import csv
import json

import numpy as np
import pytest

from ccr_ros.cli.main import main
from ccr_ros.model import FingerSolver, load_finger
from ccr_ros.resources import find_config

PULLS = [0.004, 0.005]


@pytest.fixture
def ccr(capsys):
    """Return a function that runs `ccr design pulls` and returns exit code, stdout and stderr."""

    def ccr(*words):
        code = main(["design", "pulls", *map(str, words)])
        out, err = capsys.readouterr()
        return code, out, err

    return ccr


@pytest.fixture(scope="module")
def wanted():
    return FingerSolver(load_finger(find_config("two_cables"))).solve(PULLS)


def text(numbers, factor=1.0):
    return ",".join(f"{v * factor:.12g}" for v in numbers)


def test_tip_pose_as_json(ccr, wanted):
    tip = text([*wanted.tip.position, *wanted.tip.orientation])
    code, out, err = ccr("two_cables", f"--tip={tip}", "--json", "--tolerance", "1e-4")
    assert (code, err) == (0, "")
    found = json.loads(out)
    assert found["reached"] and found["direct"] and found["message"] == ""
    assert list(found["pulls"].values()) == pytest.approx(PULLS, abs=1e-6)
    assert set(found["error"]) == {"position", "rotation"} and found["error"]["position"] < 2e-7
    assert found["certificate"]["converged"]


def test_table_for_people_in_mm(ccr, wanted):
    tip = f"--tip={text(wanted.backbone[-1], 1e3)}"
    code, out, _ = ccr("two_cables", tip, "--unit", "mm", "--tolerance", "1e-4")
    assert code == 0
    assert "straight" in out and "4.000 mm" in out and "5.000 mm" in out
    assert "\n  reached, error " in out


def test_a_tip_that_is_typed_in_counts_as_reached(ccr, wanted):
    tip = ",".join(f"{v:.5f}" for v in wanted.backbone[-1])
    assert ccr("two_cables", f"--tip={tip}")[0] == 0
    code, out, _ = ccr("two_cables", f"--tip={tip}", "--tolerance", "1e-4")
    assert code == 1 and "NOT REACHED" in out


def test_points_file(ccr, wanted, tmp_path):
    path = tmp_path / "points.csv"
    rows = [f"{disk},{text(wanted.backbone[disk], 1e3)}" for disk in (3, 6, 9)]
    path.write_text("disk,x,y,z\n" + "\n".join(rows) + "\n")
    code, out, _ = ccr(
        "two_cables", "--points", path, "--unit", "mm", "--json", "--tolerance", "1e-4"
    )
    assert code == 0
    assert list(json.loads(out)["pulls"].values()) == pytest.approx(PULLS, abs=1e-6)


def test_press_with_and_without_limits(ccr):
    code, out, _ = ccr("contact_cylinder", "--press", "7=0.3", "--max-pull", "main=4%")
    assert code == 0 and "disk 7 on rod: 0.3 N" in out
    code, out, _ = ccr(
        "contact_cylinder", "--press", "7=0.3", "--max-tension", "main=2", "--obstacle", "rod"
    )
    assert code == 1
    assert "NOT REACHED, error -0.3 N, 0.823 mm from the obstacle" in out
    assert "held by: tension of main" in out


def test_path_is_tracked_and_written(ccr, tmp_path):
    solver = FingerSolver(load_finger(find_config("two_cables")))
    tips = [solver.solve([0.003 + 1e-4 * k, 0.003]).backbone[-1] for k in range(8)]
    path, out_path = tmp_path / "path.csv", tmp_path / "pulls.csv"
    path.write_text("\n".join(text(tip) for tip in tips))
    code, out, _ = ccr("two_cables", "--path", path, "-o", out_path, "--tolerance", "1e-4")
    assert code == 0 and "8 points, 8 reached" in out and f"written to {out_path}" in out
    with open(out_path, encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 8
    for row, tip in zip(rows, tips, strict=True):
        pulls = [float(row["pull_straight"]), float(row["pull_helical"])]
        assert solver.solve(pulls).backbone[-1] == pytest.approx(tip, abs=5e-7)
        assert row["reached"] == "1" and float(row["position_error"]) < 2e-7
    code, out, _ = ccr("two_cables", "--path", path, "--json")
    assert code == 0 and len(json.loads(out)) == 8


def test_path_that_leaves_what_can_be_reached(ccr, wanted, tmp_path):
    path = tmp_path / "path.csv"
    away = wanted.backbone[-1] + np.array([0.0, 0.0, 0.01])
    path.write_text(f"{text(wanted.backbone[-1])}\n{text(away)}\n")
    code, out, _ = ccr("two_cables", "--path", path)
    assert code == 1 and "NOT REACHED: points 2; point 2: out of reach" in out


def test_slack_is_as_told(ccr, wanted):
    def low(*words):
        _, out, _ = ccr("two_cables", "--tip=0,0.03,0.175", "--max-tension", "helical=1e-9", *words)
        line = next(line for line in out.splitlines() if line.startswith("  helical"))
        return float(line.split()[1])

    assert low("--slack", "0") - low("--slack", "0.005") == pytest.approx(5.0, abs=2e-3)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "target: 'none' is not allowed; must be exactly one of"),
        (["--tip=0,0,0.1", "--press", "7=1"], "target: '--tip, --press'"),
        (["--tip=0,0"], "--tip: [0.0, 0.0]"),
        (["--tip=0,0,x"], "--tip: 'x'"),
        (["--tip=0,0,nan"], "--tip: 'nan'"),
        (["--tip=0,0,0.1,0,0,0,3"], "tip.orientation"),
        (["--tip=0,0,0.1", "-o", "x.csv"], "--output"),
        (["--tip=0,0,0.1", "--plot", "x.txt"], "plot file"),
        (["--tip=0,0,0.1", "--turn-weight", "-1"], "rotation_weight"),
        (["--tip=0,0,0.1", "--slack", "-1"], "slack"),
        (["--tip=0,0,0.1", "--max-tension", "main"], "--max-tension: 'main'"),
        (["--tip=0,0,0.1", "--max-tension", "main=0"], "limits.tension.main"),
        (["--tip=0,0,0.1", "--max-tension", "no=1"], "unknown cable 'no'"),
        (["--tip=0,0,0.1", "--min-pull", "main=1%"], "limits.low.main"),
        (["--tip=0,0,0.1", "--max-pull", "main=x"], "--max-pull main: 'x'"),
        (["--tip=0,0,0.1", "--max-pull", "main=1%", "--max-pull", "main=2%"], "once per cable"),
        (["--tip=0,0,0.1", "--tolerance", "nan"], "--tolerance: 'nan'"),
        (["--tip=0,0,0.1", "--tolerance", "0"], "--tolerance: '0'"),
        (["--press", "7"], "--press: '7'"),
        (["--press", "x=1"], "--press: 'x=1'"),
        (["--press", "99=1"], "press.disk"),
        (["--press", "7=-1"], "press.force"),
        (["--press", "7=1", "--obstacle", "ball"], "unknown obstacle 'ball'; valid: rod"),
        (["--points", "missing.csv"], "missing.csv"),
        (["--path", "missing.csv"], "missing.csv"),
    ],
)
def test_bad_input_is_one_line(ccr, words, message):
    code, out, err = ccr("contact_cylinder", *words)
    assert (code, out) == (2, "")
    assert err.startswith("ccr: error: ") and message in err and err.count("\n") == 1


@pytest.mark.parametrize(
    ("option", "content", "message"),
    [
        ("--points", "1,0,0\n", "line 1: 3 values"),
        ("--points", "1.5,0,0,0.1\n", "line 1: disk 1.5"),
        ("--points", "0,0,0,0.1\n", "line 1: disk 0"),
        ("--points", "2,0,0,0.1\n2,0,0,0.1\n", "line 2: disk 2"),
        ("--path", "0,0\n", "3 or 7 values a line"),
        ("--path", "0,0,0.1,0,0,0,2\n", "tip.orientation"),
        ("--path", "", "holds no numbers"),
    ],
)
def test_bad_files_are_told_with_their_line(ccr, tmp_path, option, content, message):
    path = tmp_path / "bad.csv"
    path.write_text(content)
    code, out, err = ccr("contact_cylinder", option, path)
    assert (code, out) == (2, "")
    assert err.startswith(f"ccr: error: {path}: ") and message in err and err.count("\n") == 1


def test_finger_without_an_obstacle(ccr):
    code, _, err = ccr("straight", "--press", "7=1")
    assert code == 2 and err == (
        "ccr: error: --press: '7=1' is not allowed; must be of a finger whose file has obstacles\n"
    )
