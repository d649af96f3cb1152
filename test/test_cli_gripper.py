# SPDX-License-Identifier: Apache-2.0
"""`ccr gripper`: words to calls of the facade, reports to words; bad words before any gripper."""

import math

import pytest

import ccr_ros.gripper
from ccr_ros.cli.gripper import text_of
from ccr_ros.cli.main import main
from ccr_ros.gripper import GripperFailed, GripperRefused
from ccr_ros.gripper_reports import GraspReport, GripperReport, MoveReport

STATE = GripperReport("holding", "held", True, {"finger_1": 0.2}, ("finger_1",), True)
MOVED = MoveReport(
    "holding", "moved", True, "", (0.0, 0.0, -0.001), (0.0, 0.0, math.radians(5)),
    (0.0, 0.0, 0.1), (0.0, 0.0, 0.0, 1.0), 0.31, 1.0,
)  # fmt: skip
SHORT = MoveReport(
    "holding", "it cannot be moved so: friction at disk 9", False, "friction at disk 9",
    (0.0,) * 3, (0.0,) * 3, (0.0,) * 3, (0.0, 0.0, 0.0, 1.0), math.nan, 0.0,
)  # fmt: skip
CUBE = GraspReport(
    "cube", True, (0.0, 0.0, 0.17), (0.0, 0.0, 0.0, 1.0), 0.01, {}, 0.5, True, 1.0, True, False, ""
)


class Recorder:
    """Stands in for a gripper: keeps what it is asked, and answers."""

    calls: list = []
    answer = STATE
    in_hand = CUBE

    def __init__(self, namespace):
        self.calls.append(("Gripper", (namespace,), {}))

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.calls.append(("close", (), {}))

    @property
    def state(self):
        return STATE

    def __getattr__(self, verb):
        def call(*args, **values):
            self.calls.append((verb, args, values))
            if isinstance(self.answer, Exception):
                raise self.answer
            return self.answer

        return call


@pytest.fixture
def ccr(monkeypatch, capsys):
    monkeypatch.setattr(ccr_ros.gripper, "Gripper", Recorder)
    Recorder.calls, Recorder.answer = [], STATE

    def run(*words):
        code = main(["gripper", *words])
        return code, *capsys.readouterr()

    return run


def motion(**values):
    base = {"margin": 0.0, "duration": 0.0, "speed": 0.0, "partial": False, "timeout": 300.0}
    return {**base, **values}


CALLS = {
    "grasp --object cube --force 0.4": ("grasp", ("cube",), {"force": 0.4, "timeout": 30.0}),
    "hold": ("hold", (), {}),
    "stop": ("stop", (), {}),
    "reset": ("reset", (), {}),
    "release --after 5 --fast": ("release", (), {"after": 5.0, "fast": True}),
    "rotate -5 --margin 0.2": ("rotate", (math.radians(-5),), motion(margin=0.2)),
    "rotate 90 --partial --speed 0.5": ("rotate", (math.pi / 2,), motion(partial=True, speed=5e-4)),
    "move --shift=-1,0,2 --duration 3": (
        "move", ([-0.001, 0.0, 0.002], [0.0, 0.0, 0.0]), motion(duration=3.0),
    ),
    "move --turn 0,0,180 --timeout 9": (
        "move", ([0.0, 0.0, 0.0], [0.0, 0.0, math.pi]), motion(timeout=9.0),
    ),
}  # fmt: skip


@pytest.mark.parametrize("words", CALLS)
def test_words_become_calls(ccr, words):
    code, out, err = ccr("--namespace", "/left", *words.split())
    assert (code, err) == (0, "") and out.startswith("holding: held\n  finger_1 0.200 N")
    assert Recorder.calls == [("Gripper", ("/left",), {}), CALLS[words], ("close", (), {})]


def test_state_tells_of_what_is_in_hand(ccr):
    code, out, _ = ccr("state")
    assert code == 0
    assert (
        out.splitlines()[2]
        == "  cube: held, at 0.00, 0.00, 170.00 mm, 0.01 kg, friction margin 0.50"
    )


def test_a_motion_is_told_in_millimetres_and_degrees(ccr):
    Recorder.answer = MOVED
    code, out, _ = ccr("rotate", "5")
    assert code == 0
    told = "  shift 0.00, 0.00, -1.00 mm, turn 0.00, 0.00, 5.00 deg, friction margin 0.31"
    assert out == f"holding: moved\n{told}\n"
    assert "margin" not in text_of(SHORT)


def test_what_is_not_reached_is_1_and_what_is_refused_2(ccr):
    Recorder.answer = GripperFailed(SHORT)
    code, out, err = ccr("rotate", "90")
    assert (code, err) == (1, "") and "friction at disk 9" in out
    Recorder.answer = GripperRefused("the gripper is ready")
    code, out, err = ccr("rotate", "90")
    assert (code, out, err) == (2, "", "ccr: error: the gripper is ready\n")


BAD = {
    "rotate nan": "DEG: 'nan'",
    "rotate 181": "DEG: '181'",
    "rotate 5 --margin 1": "--margin: '1'",
    "rotate 5 --duration -1": "--duration: '-1'",
    "rotate 5 --speed inf": "--speed: 'inf'",
    "rotate 5 --timeout 0": "--timeout: '0'",
    "move --shift 1,2": "--shift: '1,2'",
    "move --turn 1,x,2": "--turn: 'x'",
    "move --shift 1,2,nan": "--shift: 'nan'",
    "grasp --force -1": "--force: '-1'",
    "release --after never": "--after: 'never'",
}


@pytest.mark.parametrize("words", BAD)
def test_bad_words_are_refused_before_a_gripper_is_looked_for(ccr, words):
    code, out, err = ccr(*words.split())
    assert (code, out) == (2, "") and err.startswith(f"ccr: error: {BAD[words]} is not allowed")
    assert err.count("\n") == 1 and Recorder.calls == []


def test_no_verb_or_one_that_is_none(ccr):
    for words in ([], ["throw"]):
        with pytest.raises(SystemExit) as exit:
            ccr(*words)
        assert exit.value.code == 2
