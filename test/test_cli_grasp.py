# SPDX-License-Identifier: Apache-2.0
"""`ccr grasp`, as typed by a person and as read by a program."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from ccr_ros.cli import grasp
from ccr_ros.cli.grasp import parse_grip
from ccr_ros.cli.grasp_arguments import body_from_text
from ccr_ros.cli.main import main
from ccr_ros.grasp.clearance import disk_clearance
from ccr_ros.grasp.statics import GraspSolver, sphere_body
from ccr_ros.model import Pose, load_gripper
from ccr_ros.resources import find_config

BALL = ("gripper_sphere", "--object", "sphere:0.112", "--center-height", "0.110")
DOWN = (*BALL, "--mass", "0.02", "--friction", "0.5", "--points", "down", "--pull", "3.2%")


@pytest.fixture
def ccr(capsys):
    """Return a function that runs `ccr grasp` and returns exit code, stdout and stderr."""

    def ccr(*words):
        code = main(["grasp", *words])
        out, err = capsys.readouterr()
        return code, out, err

    return ccr


def strict_json(text):
    def refuse(word):
        raise AssertionError(f"{word} is not JSON")

    assert text.count("\n") == 1
    return json.loads(text, parse_constant=refuse)


def test_a_ball_is_held_and_its_grasp_is_told(ccr):
    code, out, err = ccr(*DOWN, "--json")
    assert (code, err) == (0, "")
    found = strict_json(out)
    assert found["held"] and found["stable"] and not found["supported"]
    assert found["object"]["mass"] == 0.02 and found["object"]["friction"] == 0.5
    assert len(found["contacts"]) == 3
    on_fingers = sum(
        c["force"] * np.array(c["normal"]) + np.array(c["friction_force"])
        for c in found["contacts"]
    )
    np.testing.assert_allclose(on_fingers, [0, 0, 0.02 * 9.80665], atol=1e-7)
    quality = found["quality"]
    assert quality["margin"] == pytest.approx(min(c["margin"] for c in found["contacts"]))
    assert not quality["force_closure"] and quality["weakest_in_words"] == "a force along -z"
    assert quality["payload"] > 0.02 * 9.80665
    assert found["stiffness"] > 0 and "loads" not in found


@pytest.mark.long
def test_people_read_contacts_measures_and_loads(ccr):
    code, out, err = ccr(*DOWN, "--until-slip")
    assert (code, err) == (0, "")
    for words in (
        "gripper_sphere: 3 fingers; ball, 20 g, friction 0.5",
        "object at 0.000 0.000 109.",
        "finger_3       9  cable",
        "no force closure: nothing balances a force along -z",
        "softest against",
        "more weight, now 0.1961 N: lost between",
        "held (smallest eigenvalue",
    ):
        assert words in out
    assert "-0.000" not in out and "NOT HELD" not in out


@pytest.mark.long
def test_the_steps_in_which_fingers_close_are_small_enough(ccr):
    """What touches within a step slides freely in it: in large steps the ball is elsewhere."""
    words = (*DOWN[:-4], "--points", "sideways", "--pull", "3.2%")
    code, out, _ = ccr(*words, "--json")
    found = strict_json(out)
    fingers = load_gripper(find_config("gripper_sphere")).fingers
    ball = sphere_body(0.112, 0.02, Pose(np.array([0, 0, 0.110])), 0.5)
    solver = GraspSolver(fingers, ball, gravity=np.array([-9.80665, 0, 0]), friction_step=4e-4)
    solver.solve({name: list(pulls.values()) for name, pulls in found["pulls"].items()})
    fine = solver.let_go().require_converged().body.pose.position
    assert code == 0
    np.testing.assert_allclose(found["object"]["position"], fine, atol=5e-6)
    code, out, _ = ccr(*words)
    assert "friction margin 0.000" in out


def test_what_falls_is_not_held(ccr):
    words = (*BALL, "--mass", "0.2", "--pull", "3.2%", "--points", "down")
    code, out, _ = ccr(*words, "--json")
    found = strict_json(out)
    assert code == 1 and not found["held"] and found["supported"] and "quality" not in found
    assert "cannot hold" in found["message"]
    code, out, _ = ccr(*BALL, "--pull", "0")
    assert code == 1 and "NOT HELD" in out and "nothing touches the object" in out


def test_fingers_that_pass_through_each_other_hold_nothing(ccr):
    words = (*BALL, "--mass", "0.02", "--pull", "0.1")
    code, out, _ = ccr(*words)
    assert code == 1 and "NOT HELD" in out
    # which two of three alike is for rounding to say
    assert re.search(r"disk 3 of finger_\d and disk 3 of finger_\d meet", out)
    code, out, _ = ccr(*words, "--json")
    found = strict_json(out)
    assert found["converged"] and found["stable"] and not found["held"]
    assert (found["clearance"]["gap"], found["clearance"]["disks"]) == (0, [3, 3])
    assert len(set(found["clearance"]["fingers"])) == 2


def test_pulls_are_of_all_fingers_of_a_cable_or_of_one():
    fingers = load_gripper(find_config("gripper_sphere")).fingers
    solver = GraspSolver(fingers, sphere_body(0.112, pose=Pose(np.array([0, 0, 0.110]))))
    rest = float(solver.hand.problems[0].rest_lengths[0]) * 0.182
    assert parse_grip(["2%"], solver)["finger_2"] == pytest.approx([0.02 * rest])
    assert parse_grip(["main=0.004"], solver)["finger_3"] == pytest.approx([0.004])
    mixed = parse_grip(["2%", "finger_2.main=3%"], solver)
    assert mixed["finger_1"] == pytest.approx([0.02 * rest])
    assert mixed["finger_2"] == pytest.approx([0.03 * rest])


def test_objects_are_what_their_text_says(tmp_path):
    pose = Pose(np.array([0, 0, 0.1]))

    def half(text):
        """Half its extent along x, y and z, found from the distance of points far away."""
        shape = body_from_text(text, pose, 0.1, 0.3).shape
        return [1.0 - float(shape.signed_distance(row[None])[0]) for row in np.eye(3)]

    assert half("sphere:0.1") == pytest.approx([0.05] * 3)
    assert half("cylinder:0.06x0.1") == pytest.approx([0.03, 0.03, 0.05])
    assert half("box:0.04x0.06x0.1") == pytest.approx([0.02, 0.03, 0.05])
    stl = tmp_path / "part.stl"
    _write_box(stl, (40, 60, 100))
    assert half(f"mesh:{stl}") == pytest.approx([0.02, 0.03, 0.05], abs=1e-6)


def _write_box(path, size):
    trimesh = pytest.importorskip("trimesh")
    path.write_bytes(trimesh.creation.box(size).export(file_type="stl"))


@pytest.mark.parametrize(
    ("words", "named"),
    [
        ((*BALL,), None),
        ((*BALL, "--pull", "much"), "--pull"),
        ((*BALL, "--pull", "finger_9.main=3%"), "unknown finger 'finger_9'"),
        ((*BALL, "--pull", "thumb=3%"), "unknown cable 'thumb'"),
        ((*BALL, "--pull", "finger_1.thumb=3%"), "unknown cable 'thumb'"),
        ((*BALL, "--pull", "3%", "--mass", "-1"), "--mass"),
        ((*BALL, "--pull", "3%", "--friction", "nan"), "--friction"),
        ((*BALL, "--pull", "150%"), "pulls.finger_1.main"),
        ((*BALL[:4], "inf", "--pull", "3%"), "--center-height"),
        (("gripper_sphere", "--object", "pear", *BALL[3:], "--pull", "3%"), "pear"),
        (("gripper_sphere", "--object", "pear", *BALL[3:], "--pull", "3%"), "mesh:FILE.stl"),
        (("gripper_sphere", "--object", "mesh:", *BALL[3:], "--pull", "3%"), "--object"),
        (("gripper_sphere", "--object", "mesh:no.stl", *BALL[3:], "--pull", "3%"), "no.stl"),
        (("helical", *BALL[1:], "--pull", "3%"), "gripper file is wanted"),
        (("no_such", *BALL[1:], "--pull", "3%"), "no_such"),
    ],
)
def test_bad_input_is_one_clear_line(ccr, words, named, capsys):
    if named is None:  # argparse's own
        with pytest.raises(SystemExit) as end:
            main(["grasp", *words])
        assert end.value.code == 2 and "--pull" in capsys.readouterr().err
        return
    code, out, err = ccr(*words)
    assert code == 2 and out == ""
    assert err.startswith("ccr: error: ") and err.count("\n") == 1 and named in err


CLOSED = ("gripper_sphere", "--object", "sphere:0.01", "--center-height", "0.5", "--pull", "4.7%")


def test_disks_that_press_on_each_other_are_told(ccr):
    code, out, err = ccr(*CLOSED, "--disks", "0.0015", "--json")
    assert (code, err) == (1, "")  # nothing is held
    contacts = strict_json(out)["disk_contacts"]
    assert [c["disks"] for c in contacts] == [[9, 9]] * 3
    assert contacts[0]["fingers"] == ["finger_1", "finger_2"] and contacts[0]["force"] > 0.01
    assert np.linalg.norm(contacts[0]["normal"]) == pytest.approx(1.0)
    code, out, _ = ccr(*CLOSED, "--disks", "0.0015")
    assert "  disk 9 of finger_1 and disk 9 of finger_2 press on each other at " in out
    wider = (*CLOSED, "--pull", "4.3%")
    assert strict_json(ccr(*wider, "--disks", "--json")[1])["disk_contacts"] == []
    assert strict_json(ccr(*CLOSED, "--json")[1])["disk_contacts"] == []


@pytest.mark.parametrize(
    ("rim", "words"),
    [
        ("wide", "--disks"),
        ("nan", "--disks"),
        ("-1", "--disks"),
        ("0.04", "cut each other at rest"),
    ],
)
def test_rims_that_cannot_be(ccr, rim, words):
    code, out, err = ccr(*CLOSED, f"--disks={rim}")
    assert code == 2 and not out and err.startswith("ccr: error: ") and words in err


def test_disks_that_press_are_not_taken_for_fingers_that_pass_through(ccr, monkeypatch):
    """Rims that press flat on each other are no distance apart, and are told as contacts."""

    def meeting(*arguments):
        return replace(disk_clearance(*arguments), gap=0.0)

    monkeypatch.setattr(grasp, "disk_clearance", meeting)
    code, out, _ = ccr(*DOWN)
    assert code == 1 and "NOT HELD" in out and "knows nothing" in out
    code, out, _ = ccr(*DOWN, "--disks")
    assert code == 0 and "NOT HELD" not in out and "knows nothing" not in out
