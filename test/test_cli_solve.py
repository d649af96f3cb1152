# SPDX-License-Identifier: Apache-2.0
"""`ccr solve`, as typed by a person and as read by a program."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ccr_ros.cli.main import main
from ccr_ros.cli.solve import parse_pulls
from ccr_ros.model import FingerSolver, InvalidValue, UnknownName, load_finger
from ccr_ros.resources import find_config

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture
def ccr(capsys):
    """Return a function that runs `ccr solve` and returns exit code, stdout and stderr."""

    def ccr(*words):
        code = main(["solve", *map(str, words)])
        out, err = capsys.readouterr()
        return code, out, err

    return ccr


@pytest.fixture
def solved(ccr):
    """Return a function that runs `ccr solve --json` to success and returns the object."""

    def solved(*words):
        code, out, err = ccr(*words, "--json")
        assert (code, err) == (0, "")
        return strict_json(out)

    return solved


def strict_json(text):
    def refuse(word):
        raise AssertionError(f"{word} is not JSON")

    return json.loads(text, parse_constant=refuse)


def rest_lengths(name):
    return FingerSolver(load_finger(find_config(name))).rest_lengths


def test_json_holds_what_is_promised(solved):
    result = solved("contact_cylinder", "--pull", "main=2%")
    backbone, frames = np.array(result["backbone"]), np.array(result["frames"])
    cable = np.array(result["cables"]["main"])
    assert backbone.shape == cable.shape == (10, 3) and frames.shape == (10, 4)
    # metres, base to tip; (x, y, z, w) with the base disk's frame first
    assert backbone[0].tolist() == [0, 0, 0] and frames[0].tolist() == [0, 0, 0, 1]
    np.testing.assert_allclose(np.linalg.norm(frames, axis=1), 1, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(cable - backbone, axis=1), 0.008, atol=1e-12)
    spans = np.linalg.norm(np.diff(backbone, axis=0), axis=1)
    assert (spans <= 0.182 / 9 + 1e-12).all() and (spans > 0.98 * 0.182 / 9).all()
    # the third axis of a frame leads along the backbone
    x, y, z, w = frames[-1]
    tangent = [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]
    last = (backbone[-1] - backbone[-2]) / spans[-1]
    assert last @ tangent > 0.99

    assert result["forces_are"] == "newton"
    assert list(result["tensions"]) == ["main"] and 5 < result["tensions"]["main"] < 8
    assert 0.001 < result["energy"] < 0.1
    (contact,) = result["contacts"]
    assert set(contact) == {
        "disk", "point", "cable", "obstacle", "position", "normal", "force",
    }  # fmt: skip
    assert (contact["disk"], contact["point"], contact["cable"]) == (7, "cable", "main")
    assert contact["obstacle"] == "rod" and contact["force"] > 0
    np.testing.assert_allclose(contact["position"], cable[7], atol=1e-12)
    assert np.linalg.norm(contact["normal"]) == pytest.approx(1)

    certificate = result["certificate"]
    assert certificate["converged"] is True and certificate["stable"] is True
    for key in ("kkt", "cable_error", "penetration", "solve_ms"):
        assert isinstance(certificate[key], float) and certificate[key] >= 0
    assert certificate["kkt"] < 1e-8 and certificate["cable_error"] < 1e-9
    assert isinstance(certificate["iterations"], int) and certificate["iterations"] > 0
    assert 0 < certificate["solve_ms"] < 60_000


def test_json_is_one_line_and_one_object(ccr):
    code, out, err = ccr("straight", "--json")
    assert (code, err) == (0, "")
    assert out.count("\n") == 1 and isinstance(strict_json(out), dict)


def test_percent_is_of_the_rest_length_and_metres_are_metres(solved):
    length = float(rest_lengths("helical")[0])
    percent = solved("helical", "--pull", "main=4%")
    metres = solved("helical", "--pull", f"main={0.04 * length!r}")
    assert length > 0.182  # a helix is longer than the backbone
    assert percent["pulls"]["main"] == metres["pulls"]["main"] == 0.04 * length
    assert percent["backbone"] == metres["backbone"]
    cable = np.array(percent["cables"]["main"])
    pulled_length = np.linalg.norm(np.diff(cable, axis=0), axis=1).sum()
    assert pulled_length == pytest.approx(0.96 * length, abs=1e-9)


def test_several_cables_by_name(solved):
    result = solved("two_cables", "--pull", "helical=0.003", "--pull", "straight=1%")
    assert result["pulls"] == {"straight": pytest.approx(0.00182), "helical": 0.003}
    assert list(result["cables"]) == list(result["tensions"]) == ["straight", "helical"]
    alone = solved("two_cables", "--pull", "helical=0.003")
    assert alone["pulls"]["straight"] == 0


def test_a_negative_pull_pays_out_and_leaves_the_cable_slack(solved):
    for text in ("main=-1%", "main=-0.002"):
        result = solved("straight", "--pull", text)
        assert result["pulls"]["main"] < 0 and result["tensions"]["main"] == 0
        np.testing.assert_allclose(np.array(result["backbone"])[:, :2], 0, atol=1e-12)


def test_without_pulls_the_rest_shape_is_shown(solved):
    result = solved("prebent_1_left")
    assert result["energy"] == 0 and result["contacts"] == []


def test_forces_per_ei_without_a_modulus(solved, ccr, tmp_path):
    text = find_config("straight").read_text()
    path = tmp_path / "soft.yaml"
    path.write_text("".join(x for x in text.splitlines(True) if "youngs_modulus" not in x))
    per_ei = solved(path, "--pull", "main=5%")
    newton = solved("straight", "--pull", "main=5%")
    assert per_ei["forces_are"] == "per_EI"
    stiffness = load_finger(find_config("straight")).bending_stiffness
    for key in ("main",):
        expected = per_ei["tensions"][key] * stiffness
        assert newton["tensions"][key] == pytest.approx(expected, rel=1e-9)
    assert newton["energy"] == pytest.approx(per_ei["energy"] * stiffness, rel=1e-9)
    assert "per EI" in ccr(path, "--pull", "main=5%")[1]


def test_steps_end_at_the_same_pose_and_are_listed(solved):
    once = solved("helical", "--pull", "main=4%")
    steps = solved("helical", "--pull", "main=4%", "--steps", "4")
    np.testing.assert_allclose(steps["backbone"], once["backbone"], atol=1e-8)
    assert "steps" not in once and len(steps["steps"]) == 4
    pulls = [s["pulls"]["main"] for s in steps["steps"]]
    np.testing.assert_allclose(pulls, steps["pulls"]["main"] * np.array([1, 2, 3, 4]) / 4)
    assert steps["steps"][-1]["tip"] == steps["backbone"][-1]
    tensions = [s["tensions"]["main"] for s in steps["steps"]]
    assert tensions == sorted(tensions) and tensions[0] > 0


def test_arcs_refine_the_model_a_little(solved):
    one = np.array(solved("helical", "--pull", "main=4%")["backbone"])
    two = np.array(solved("helical", "--pull", "main=4%", "--arcs", "2")["backbone"])
    change = np.linalg.norm(two - one, axis=1).max()
    assert 0 < change < 0.001 * 0.182


def test_the_table_is_in_a_persons_units(ccr):
    code, out, err = ccr("contact_cylinder", "--pull", "main=2%")
    assert (code, err) == (0, "")
    assert "contact_cylinder: 182 mm, 9 segments" in out
    assert "3.640 mm" in out and "2.00%" in out and "6.159" in out
    assert "cable of main on rod: 0.3559 N" in out
    assert "converged, stable" in out
    rows = [line.split() for line in out.splitlines() if line.split()[:1] == ["9"]]
    assert [float(x) for x in rows[0][1:4]] == pytest.approx([-6.608, 0, 179.119], abs=0.01)


def test_the_table_of_steps(ccr):
    code, out, _ = ccr("contact_cylinder", "--pull", "main=2%", "--steps", "2")
    lines = out.splitlines()
    head = next(i for i, line in enumerate(lines) if line.split()[:1] == ["step"])
    assert code == 0
    assert lines[head + 1].split()[0] == "1" and "disk" not in lines[head + 1]
    assert lines[head + 2].split()[0] == "2" and "disk 7 cable" in lines[head + 2]


def test_slack_and_short_cables_are_pointed_out(ccr, tmp_path):
    path = tmp_path / "short.yaml"
    text = find_config("straight").read_text()
    path.write_text(text + "  - {name: short, holes: [10, 10, 10, 10, 10]}\n")
    code, out, _ = ccr(path, "--pull", "short=2%", "--pull", "main=-5%")
    assert code == 0
    main_row, short_row = (
        next(line for line in out.splitlines() if line.startswith(f"  {name} "))
        for name in ("main", "short")
    )
    assert main_row.endswith("slack")
    assert short_row.endswith("(ends at disk 4)") and "slack" not in short_row


@pytest.mark.parametrize("steps", [1, 3])
def test_a_pull_without_equilibrium_gives_exit_code_1(ccr, steps):
    words = ("general_1", "--pull", "main=99%", "--steps", steps)
    code, out, _ = ccr(*words, "--json")
    certificate = strict_json(out)["certificate"]
    assert code == 1
    assert certificate["converged"] is False and "Pull less" in certificate["message"]
    code, out, _ = ccr(*words)
    assert code == 1 and "NOT CONVERGED" in out and certificate["message"] in out


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["straight", "--pull", "main"], "--pull: 'main' is not allowed; must be CABLE=VALUE"),
        (["straight", "--pull", ""], "--pull: '' is not allowed"),
        (["straight", "--pull", "main="], "--pull main: '' is not allowed; must be a finite"),
        (["straight", "--pull", "main=%"], "--pull main: '%' is not allowed"),
        (["straight", "--pull", "main=4%%"], "--pull main: '4%%' is not allowed"),
        (["straight", "--pull", "main=4mm"], "--pull main: '4mm' is not allowed"),
        (["straight", "--pull", "main=nan"], "--pull main: 'nan' is not allowed"),
        (["straight", "--pull", "main=inf%"], "--pull main: 'inf%' is not allowed"),
        (["straight", "--pull", "main=1e999"], "--pull main: '1e999' is not allowed"),
        (["straight", "--pull", "main=1", "--pull", "main=2"], "must be given once per cable"),
        (["straight", "--pull", "other=4%"], "unknown cable 'other'; valid: main"),
        (["straight", "--pull", "=4%"], "unknown cable ''; valid: main"),
        (["straight", "--pull", "main=7"], "pulls.main: 7.0 is not allowed"),
        (["straight", "--pull", "main=100%"], "pulls.main: 0.182"),
        (["straight", "--pull", "main=-900%"], "pulls.main: -1.638"),
        (["straight", "--steps", "0"], "--steps: '0' is not allowed; must be an integer 1.."),
        (["straight", "--steps", "two"], "--steps: 'two' is not allowed"),
        (["straight", "--steps", "1.5"], "--steps: '1.5' is not allowed"),
        (["straight", "--arcs", "0"], "--arcs: '0' is not allowed; must be an integer 1..64"),
        (["straight", "--arcs", "65"], "--arcs: '65' is not allowed"),
        (["strait"], "unknown config file 'strait'; valid: contact_cylinder, "),
        (["no/such.yaml"], "no/such.yaml: no such file"),
        (["."], ".: is a folder"),
        (["gripper_sphere"], "describes a gripper"),
        (["straight", "--plot", "pose.xyz"], "'pose.xyz' is not allowed; must be"),
        (["straight", "--plot", "no/such/pose.png"], "no directory 'no/such'"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(ccr, words, complaint):
    for extra in ([], ["--json"]):
        code, out, err = ccr(*words, *extra)
        assert (code, out) == (2, "")
        assert err.startswith("ccr: error: ") and complaint in err
        assert err.count("\n") == 1 and err.endswith("\n")


def test_bad_files_name_file_place_value_and_range(ccr, tmp_path):
    path = tmp_path / "bad.yaml"
    path.write_text(find_config("helical").read_text().replace("12, 1, 2", "13, 1, 2"))
    code, out, err = ccr(path)
    assert (code, out) == (2, "")
    expected = f"{path}: cables[0].holes[5]: 13 is not allowed; must be an integer 1..12"
    assert err == f"ccr: error: {expected}\n"


@pytest.mark.parametrize("words", [[], ["straight", "--nope"], ["straight", "--pull"]])
def test_unknown_options_show_the_usage(capsys, words):
    with pytest.raises(SystemExit) as caught:
        main(["solve", *words])
    assert caught.value.code == 2
    assert "usage: ccr solve" in capsys.readouterr().err


def test_plot_draws_a_picture(ccr, tmp_path):
    pytest.importorskip("matplotlib")
    path = tmp_path / "pose.png"
    code, out, _ = ccr("contact_cylinder", "--pull", "main=2%", "--plot", path)
    assert code == 0 and f"drawn in {path}" in out
    data = path.read_bytes()
    assert data.startswith(b"\x89PNG\r\n\x1a\n") and len(data) > 20_000


def test_plot_with_json_prints_the_object_only(ccr, tmp_path):
    pytest.importorskip("matplotlib")
    path = tmp_path / "pose.svg"
    code, out, _ = ccr("straight", "--pull", "main=2%", "--json", "--plot", path)
    assert code == 0 and path.stat().st_size > 1000
    assert strict_json(out)["certificate"]["converged"] is True


def test_parse_pulls():
    lengths = np.array([0.2, 0.1])
    words = ["b=-50%", "a=1e-3"]
    assert parse_pulls(words, ("a", "b"), lengths) == {"a": 1e-3, "b": -0.05}
    assert parse_pulls([], ("a", "b"), lengths) == {}
    with pytest.raises(UnknownName):
        parse_pulls(["c=1%"], ("a", "b"), lengths)
    with pytest.raises(InvalidValue) as caught:
        parse_pulls(["a=b=1"], ("a", "b"), lengths)
    assert (caught.value.place, caught.value.value) == ("--pull a", "b=1")


def test_in_a_process_of_its_own():
    command = [sys.executable, "-m", "ccr_ros.cli", "solve"]
    done = subprocess.run(
        [*command, "general_1", "--pull", "main=3.7%", "--json"],
        capture_output=True, text=True, cwd=ROOT,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    assert strict_json(done.stdout)["finger"] == "general_1"
