# SPDX-License-Identifier: Apache-2.0
"""`ccr design fit` and its files: the paper's loads, and data of one's own."""

import json

import numpy as np
import pytest

from ccr_ros.cli.main import main
from ccr_ros.design.calibration_files import GRAM, read_measurements
from ccr_ros.model import FingerSolver, InvalidFile, load_finger
from ccr_ros.resources import config_dir, find_config

TWO = load_finger(find_config("two_cables"))


@pytest.fixture
def ccr(capsys):
    """Return a function that runs `ccr design fit` and returns exit code, stdout and stderr."""

    def ccr(*words):
        code = main(["design", "fit", *map(str, words)])
        out, err = capsys.readouterr()
        return code, out, err

    return ccr


def fitted(ccr, *words):
    code, out, err = ccr("table_1_loads", *words, "--json")
    assert (code, err) == (0, "")
    found = json.loads(out)
    return found["estimates"]["EI"], [row["EI"] for row in found["stiffness_by_load"]]


def test_straight_rows_of_table_1(ccr):
    """The spread of the four loads is as large as it is: an interval from 4.8e-3 to 6.7e-3."""
    estimate, alone = fitted(ccr, "--only", "straight", "--only", "helical", "--only", "general_*")
    assert (min(alone), max(alone)) == (
        pytest.approx(5.2e-3, abs=5e-5),
        pytest.approx(6.6e-3, abs=5e-5),
    )
    assert estimate["value"] == pytest.approx(5.65e-3, rel=0.01)
    assert estimate["low"] < min(alone) and estimate["high"] > max(alone)


def test_pre_bent_rows_of_table_1(ccr):
    estimate, alone = fitted(ccr, "--only", "prebent_*", "--only", "contact_cylinder")
    assert (min(alone), max(alone)) == (
        pytest.approx(1.19e-2, abs=1e-4),
        pytest.approx(1.33e-2, abs=1e-4),
    )
    assert 1.2e-2 < estimate["value"] < 1.3e-2


def test_table_for_people(ccr):
    code, out, _ = ccr("table_1_loads", "--only", "straight")
    assert code == 0
    assert "1 rows: 1 loads" in out and "GPa" in out and "NOT FOUND" not in out
    code, out, _ = ccr("table_1_loads", "--only", "straight", "--fit", "EI,stretch")
    assert code == 1 and "NOT FOUND" in out


def test_own_data_and_the_finger_that_is_written(ccr, tmp_path):
    """Tip positions in mm and loads in grams of a finger that is stiffer than its file says."""
    stiffness = 2 * TWO.bending_stiffness
    solver = FingerSolver(TWO)
    lines = ["pull_straight_percent,pull_helical,tip_x,tip_y,tip_z,load_straight_gram,load_helical"]
    for percent, pull in ((1.0, 0.002), (3.0, 0.001), (2.0, 0.006)):
        solution = solver.solve([percent / 100 * solver.rest_lengths[0], pull])
        tip = ",".join(f"{1e3 * v:.9g}" for v in solution.backbone[-1])
        straight, helical = 2 * solution.tensions
        lines.append(f"{percent},{pull},{tip},{straight / GRAM:.9g},{helical:.9g}")
    lines += ["# a row with gaps", "1.0,,,,,,"]
    data, out_path = tmp_path / "bench.csv", tmp_path / "fitted.yaml"
    data.write_text("\n".join(lines[:-1]))
    code, out, err = ccr(data, "--finger", "two_cables", "--unit", "mm", "-o", out_path)
    assert (code, err) == (0, "") and f"written to {out_path}" in out
    written = load_finger(out_path)
    assert written.bending_stiffness == pytest.approx(stiffness, rel=1e-5)
    assert written.poisson_ratio == TWO.poisson_ratio

    data.write_text("\n".join(lines))  # now with a row that measures nothing
    code, _, err = ccr(data, "--finger", "two_cables")
    assert code == 2 and "line 6" in err and "a position or a load" in err


def test_rows_as_read():
    rows = read_measurements(config_dir() / "table_1_loads.csv", load, None)
    assert len(rows) == 9
    first = rows[0]
    assert first.finger.name == "straight" and first.label == "line 5"
    assert first.loads == {"main": pytest.approx(0.4 * 9.80665)}
    assert first.pulls == {"main": pytest.approx(0.05 * 0.182)}


def load(name):
    return load_finger(find_config(name))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "a header and at least one row"),
        ("pull_main,load_main\n", "a header and at least one row"),
        ("pull_main,load_main\n1,2,3\n", "line 2: 3 values"),
        ("pull_main,pull_main\n1,2\n", "column 'pull_main' is there more than once"),
        ("pull_main,load_main\nx,2\n", "line 2: pull_main: 'x'"),
        ("pull_main,load_main\n0.001,nan\n", "line 2: load_main: 'nan'"),
        ("pull_main,load_main\n0.001,-1\n", "line 2.loads.main"),
        ("pull_other,load_main\n0.001,1\n", "line 2: column: 'pull_other'"),
        ("pull_main_furlong,load_main\n0.001,1\n", "'pull_main_furlong'"),
        ("pull_main,weight\n0.001,1\n", "'weight'"),
        ("pull_main,pull_main_percent,load_main\n0.001,1,1\n", "the only column"),
        ("pull_main,tip_x,tip_z\n0.001,0,0.1\n", "position of disk 9: None"),
        ("tip_x,tip_y,tip_z,disk9_x\n0,0,0.1,0\n", "tip and last disk are the same"),
        ("disk12_x,disk12_y,disk12_z\n0,0,0.1\n", "disk"),
        ("finger,load_main\nno_such,1\n", "unknown config file 'no_such'"),
        ('pull_main,load_main\n"0.001,1\n', "not valid CSV"),
    ],
)
def test_bad_files_are_told_with_their_line(ccr, tmp_path, content, message):
    path = tmp_path / "bad.csv"
    path.write_text(content)
    code, out, err = ccr(path, "--finger", "straight")
    assert (code, out) == (2, "")
    assert err.startswith(f"ccr: error: {path}: ") and message in err and err.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["missing.csv"], "missing.csv"),
        (["table_1_loads", "--only", "nobody"], "--only"),
        (["table_1_loads", "--fit", "E"], "fit: 'E'"),
        (["table_1_loads", "-o", "x.yaml"], "one finger only"),
        (["table_1_loads", "--load-scatter", "x"], "--load-scatter"),
        (["table_1_loads", "--stiffness", "0"], "stiffness"),
        (["table_1_loads", "--finger", "nobody"], "nobody"),
    ],
)
def test_bad_requests_are_one_line(ccr, words, message):
    code, out, err = ccr(*words)
    assert (code, out) == (2, "")
    assert err.startswith("ccr: error: ") and message in err and err.count("\n") == 1


def test_row_without_a_finger(tmp_path):
    path = tmp_path / "rows.csv"
    path.write_text("pull_main,load_main\n0.001,1\n")
    with pytest.raises(InvalidFile, match="line 2: finger"):
        read_measurements(path, load, None)
    assert np.isclose(read_measurements(path, load, load("straight"))[0].pulls["main"], 0.001)
