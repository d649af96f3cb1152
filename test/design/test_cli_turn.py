# SPDX-License-Identifier: Apache-2.0
"""`ccr design turn`, as typed by a person and as read by a program."""

import json

import numpy as np
import pytest

from ccr_ros.cli.design.turn import parse_forces
from ccr_ros.cli.main import main
from ccr_ros.design.turn_units import holes_of, units_of
from ccr_ros.model import InvalidValue, UnknownName, load_gripper

CUBE = ("gripper_cube", "--object", "box:0.04x0.04x0.04", "--center-height", "0.17")
GRIP = (*CUBE, "--mass", "0.01", "--friction", "0.8", "--force", "0.06", "--force", "finger_1=0.12")
SHORT = ("--step", "0.0002", "--drift", "0.0005")  # some degrees, so that tests are fast


@pytest.fixture
def ccr(capsys):
    """Return a function that runs `ccr design turn` and returns exit code, stdout and stderr."""

    def ccr(*words):
        code = main(["design", "turn", *words])
        out, err = capsys.readouterr()
        return code, out, err

    return ccr


def test_programs_read_hold_turns_and_what_ends_them(ccr):
    code, out, err = ccr(*GRIP, *SHORT, "--angle", "60", "--json")
    assert (code, err, out.count("\n")) == (1, "", 1)
    found = json.loads(out)
    assert found["held"] and not found["reached"] and found["wanted_deg"] == pytest.approx(60)
    assert found["hold"]["margin"] > 0.4 and len(found["hold"]["contacts"]) == 3
    assert found["forces"] == {"finger_1": 0.12, "finger_2": 0.06, "finger_3": 0.06}
    left, right = found["ways"]
    assert left["turn_deg"] > 1 and right["turn_deg"] < -1
    assert "drift" in left["limiting"]
    assert left["turns_deg"][0] == 0 and left["turns_deg"][-1] == left["turn_deg"]
    assert len(left["pulls"]) == len(left["margins"]) == len(left["turns_deg"])
    assert min(left["margins"]) == left["margin"]


@pytest.mark.long
def test_people_read_them_and_see_a_plot(ccr, tmp_path):
    pytest.importorskip("matplotlib", reason="matplotlib, the extra 'plot', is not installed")
    picture = tmp_path / "turn.png"
    code, out, err = ccr(*GRIP, *SHORT, "--angle", "1", "--plot", str(picture))
    assert (code, err) == (0, "")
    for words in (
        "gripper_cube: 3 fingers; box, 10 g, friction 0.8",
        "closed with finger_1 0.12 N, finger_2 0.06 N, finger_3 0.06 N",
        "held with margin 0.",
        "turns by 1 deg both ways",
        str(picture),
    ):
        assert words in out
    assert "\n  left " in out and "\n  right " in out and "-0.0 " not in out
    assert picture.stat().st_size > 10_000


@pytest.mark.long
def test_a_search_leaves_files_that_do_what_it_says(ccr, tmp_path):
    folder = tmp_path / "made"
    words = (*GRIP, *SHORT, "--angle", "1", "--try", "1", "--seed", "5", "--name", "turner")
    code, out, err = ccr(*words, "--output", str(folder))
    assert code == 0 and err.startswith("try 0/1: score ")
    gripper = load_gripper(folder / "turner.yaml")
    assert gripper.name == "turner" and len(units_of(gripper)) == 2
    assert str(folder / "turner.yaml") in out
    assert "--try 1 --seed 5" in (folder / "turner.yaml").read_text(encoding="utf-8")
    assert [len(holes_of(m.finger)) for m in gripper.fingers] == [2, 1, 1]
    angle = float(np.floor(min(abs(float(line.split()[1])) for line in turns(out))))
    forces = [word for f in forces_of(out) for word in ("--force", f)]
    again = (str(folder / "turner.yaml"), *CUBE[1:], "--mass", "0.01", "--friction", "0.8")
    assert ccr(*again, *forces, *SHORT, "--angle", str(angle))[0] == 0


def turns(out):
    return [line for line in out.splitlines() if line.startswith(("  left ", "  right "))]


def forces_of(out):
    (line,) = [line for line in out.splitlines() if "closed with" in line]
    words = line.replace(",", "").split()[2:]
    return [f"{words[i]}={words[i + 1]}" for i in range(0, len(words), 3)]


def test_what_is_not_held_is_told_and_draws_nothing(ccr, tmp_path):
    picture = tmp_path / "turn.png"
    code, out, _ = ccr(*GRIP, *SHORT, "--center-height", "0.9", "--plot", str(picture))
    assert code == 1 and "NOT HELD: finger" in out and not picture.exists()


def test_forces_are_of_all_or_of_one():
    names = ("a", "b")
    assert parse_forces(["0.1", "b=0.2"], names) == {"a": 0.1, "b": 0.2}
    assert parse_forces(["b=0.2", "a=0.3"], names) == {"a": 0.3, "b": 0.2}
    with pytest.raises(InvalidValue, match="given for a, too"):
        parse_forces(["b=0.2"], names)
    with pytest.raises(UnknownName, match="thumb"):
        parse_forces(["thumb=0.2"], names)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--force", "-1"), "--force"),
        (("--force", "nan"), "--force"),
        (("--force", "finger_9=1"), "finger_9"),
        (("--angle", "0"), "--angle"),
        (("--margin", "1"), "--margin"),
        (("--drift", "0"), "--drift"),
        (("--step", "1"), "--step"),
        (("--try", "0"), "--try"),
        (("--try", "two"), "--try"),
        (("--try", "1", "--output", "/dev/null/made"), "/dev/null/made"),
        (("--try", "1", "--name", "../turner"), "--name"),
        (("--try", "1", "--name", "x" * 60), "--name"),
        (("--plot", ""), "plot file"),
        (("--try", "1", "--seed", "-1"), "--seed"),
        (("--try", "1", "--cap", "x"), "--cap"),
        (("--output", "somewhere"), "--output"),
        (("--plot", "turn.txt"), "turn.txt"),
        (("--object", "egg:1"), "egg"),
        (("--mass", "inf"), "--mass"),
    ],
)
def test_bad_words_are_refused_before_work(ccr, words, says):
    code, out, err = ccr(*GRIP, *words)
    assert code == 2 and out == "" and err.count("\n") == 1
    assert err.startswith("ccr: error: ") and says in err
