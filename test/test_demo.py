# SPDX-License-Identifier: Apache-2.0
"""The pieces of the demo that need no ROS graph; test_demo_run.py runs the whole."""

import io
import os
import socket
import subprocess
import sys

import numpy as np
import pytest

from ccr_ros.demo import output
from ccr_ros.demo.measurements import Measurements
from ccr_ros.demo.progress import Progress
from ccr_ros.demo.scene import (
    BALL,
    DIAMETER,
    GRIP_FORCE,
    GRIPPER_FILE,
    HEAVY,
    LIGHT,
    ON_STAND,
    checked_hold,
)
from ccr_ros.demo.summary import phase_lines
from ccr_ros.grasp.statics import GraspSolver, sphere_body
from ccr_ros.model import Contact, InvalidFile, InvalidValue, Pose, load_gripper
from ccr_ros.resources import find_config
from ccr_ros.stack.environment import (
    free_domain,
    graph_environment,
    import_environment,
    is_free,
)
from ccr_ros.viz.figures import MissingMatplotlib
from ccr_ros.viz.recording import FingerFrame, Frame, RecordedFinger, Recording

MS = 1_000_000  # ns


# The scene


@pytest.mark.parametrize("seconds", [1.9, 120.1, float("nan"), float("inf")])
def test_times_out_of_range_are_refused(seconds):
    with pytest.raises(InvalidValue, match=r"hold.*>= 2 and <= 120"):
        checked_hold(seconds)


@pytest.mark.parametrize("mass", [LIGHT, HEAVY])
def test_the_fingers_carry_the_ball_and_the_heavier_one(mass):
    """With the force that the demo asks for, by statics alone."""
    solver = GraspSolver(
        load_gripper(find_config(GRIPPER_FILE)).fingers, sphere_body(DIAMETER, mass, ON_STAND)
    )
    solution = solver.solve(pulls(solver, 3.2))
    solution = solver.let_go().require_converged()
    for percent in np.arange(3.2, 3.8, 0.02):  # as the coordinator winds on
        solution = solver.solve(pulls(solver, percent)).require_converged()
        if sum(contact.force for contact in solution.contacts) / 3 >= GRIP_FORCE:
            break
    assert percent < 3.6
    assert solution.stable and len(solution.contacts) == 6


def pulls(solver, percent):
    length = solver.hand.problems[0].rest_lengths[0] * solver.hand.length
    return {name: [percent / 100 * length] for name in solver.names}


def phase(name, start, force):
    """Some frames in which every finger presses with a force and the ball sinks."""
    point = Contact(1, "backbone", "", BALL.name, np.zeros(3), np.array([1.0, 0, 0]), force)
    finger = FingerFrame(
        pulls=[0.005],
        tensions=[4.0],
        backbone=[[0, 0, 0], [0, 0, 0.18]],
        orientations=[[0, 0, 0, 1]] * 2,
        contacts=(point,),
    )
    for k in range(20):
        height = Pose(np.array([0.0, 0.0, 0.110 - 1e-4 * k]))
        yield Frame(start + 0.05 * k, {"one": finger}, {BALL.name: height}, name)


def test_the_summary_tells_the_end_of_each_phase():
    frames = (*phase("closing", 0.0, 0.1), *phase("holding", 1.0, 0.3))
    finger = RecordedFinger("one", Pose(), 0.008, ("main",))
    first, second = phase_lines(Recording("g", (finger,), frames, (BALL,)))
    assert first.split()[:3] == ["0.0", "s", "closing"] and "grip 0.1 N" in first
    assert "grip 0.3 N" in second and "tension 4 N" in second and "ball at 108.10 mm" in second


# Measurements


def test_what_arrives_is_counted():
    m = Measurements(["a", "b"])
    m.add_state("a", 5 * MS, 6 * MS, solve_time=9.0)  # the rest pose, before any pulls
    assert m.unanswered == ["a", "b"]
    for k in range(3):  # newer ones come first
        m.add_pulls("a", (100 + k) * MS)
    for k in range(10):
        stamp = (110 + 20 * k) * MS
        m.add_pulls("a", stamp)
        m.add_pulls("b", stamp)
        assert not m.caught_up
        touching = {"ball"} if k in (2, 3, 6) else set()
        force = 0.1 * k if touching else 0.0
        m.add_state("a", stamp, stamp + 2 * MS, solve_time=1e-3, touching=touching, force=force)
        m.add_state("b", stamp, stamp + 4 * MS, solve_time=3e-3, stable=k != 5)
    assert m.caught_up and m.unanswered == []
    for k in range(2):  # heard, but never answered
        m.add_pulls("b", (400 + k) * MS)
    m.add_state("a", 290 * MS, 999 * MS, solve_time=1.0, stale=True)  # the same pose once more
    m.markers = 7
    report = m.report()
    assert (report.pulls, report.poses, report.superseded, report.lost) == (25, 20, 3, 2)
    assert report.rate == pytest.approx(50.0)
    assert report.latency == pytest.approx((3e-3, 4e-3))
    assert report.solve_time == pytest.approx((2e-3, 3e-3))
    assert (report.contacts, report.stale, report.unstable) == (2, 1, 1)
    assert report.force == pytest.approx(0.6)
    text = "\n".join(report.lines("N"))
    for words in (
        "25 measured; 20 answered by a pose, 3 superseded by newer ones, 2 not answered",
        "50.0 per second",
        "1 times not solved, 1 poses not stable",
        "median 3.00 ms, 99th percentile 4.00 ms",
        "2 made, up to 0.6 N",
        "7 messages",
    ):
        assert words in text


def test_pulls_heard_after_their_pose_are_answered():
    m = Measurements(["a"])
    m.add_pulls("a", 1 * MS)
    for k in (3, 5):
        m.add_state("a", k * MS, k * MS + 9, solve_time=1e-3)
        m.add_pulls("a", k * MS)
    report = m.report()
    assert (report.pulls, report.poses, report.superseded, report.lost) == (3, 2, 1, 0)


def test_a_single_pose_has_no_rate():
    m = Measurements(["a"])
    m.add_pulls("a", 0)
    m.add_state("a", MS, 3 * MS, solve_time=1e-3)
    report = m.report()
    assert report.rate == 0.0 and report.lost == 0
    assert "every pose converged and stable" in "\n".join(report.lines("N"))


# Progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_on_a_terminal_one_line_changes(monkeypatch):
    monkeypatch.setenv("COLUMNS", "30")
    stream = Terminal()
    progress = Progress(stream)
    for k in range(5):
        progress.update("close", f"{k} " + "x" * 100)
    progress.say("done")
    shown = stream.getvalue()
    assert shown.count("\n") == 1 and shown.endswith("\r\x1b[Kdone\n")
    assert all(len(part) < 30 for part in shown.split("\r\x1b[K"))


def test_elsewhere_lines_are_few():
    stream = io.StringIO()
    progress = Progress(stream, sparse=60.0)
    for phase in ("open", "close", "hold"):
        for _ in range(10):
            progress.update(phase, "text")
    progress.say("done")
    assert stream.getvalue().splitlines() == [
        "open    text",
        "close   text",
        "hold    text",
        "done",
    ]


# Environment


def test_the_graph_is_the_demos_own_unless_the_user_says():
    own = graph_environment({})
    assert 1 <= int(own["ROS_DOMAIN_ID"]) <= 100
    assert own["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "LOCALHOST"
    assert graph_environment({"ROS_DOMAIN_ID": "7", "ROS_LOCALHOST_ONLY": "1"}) == {}
    assert graph_environment(
        {"ROS_DOMAIN_ID": " ", "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}
    ).keys() == {"ROS_DOMAIN_ID"}


def test_a_domain_in_use_is_not_taken(monkeypatch):
    domain = free_domain()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("", 7400 + 250 * domain + 10))
        monkeypatch.setattr(
            "random.sample", lambda *_: [domain, *(d for d in range(1, 101) if d != domain)]
        )
        assert free_domain() != domain


def test_a_domain_that_somebody_chose_is_not_taken_until_they_end(monkeypatch):
    monkeypatch.setattr("random.sample", lambda domains, _: list(domains))
    choose = "from ccr_ros.stack.environment import *; print(free_domain(), flush=True); input()"
    env = {**os.environ, **import_environment(os.environ)}
    command = [sys.executable, "-c", choose]
    with subprocess.Popen(
        command, env=env, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as other:
        domain = int(other.stdout.readline())
        assert not is_free(domain)
        assert free_domain() != domain
        other.communicate("\n")
    assert is_free(domain)


def test_children_import_this_package():
    path = import_environment({"PYTHONPATH": "/elsewhere"})["PYTHONPATH"].split(os.pathsep)
    assert os.path.isfile(os.path.join(path[0], "ccr_ros", "demo", "scene.py"))
    assert path[1:] == ["/elsewhere"]
    assert os.pathsep not in import_environment({})["PYTHONPATH"]


# Output


def test_the_folder_is_made_and_old_files_go(tmp_path):
    folder = tmp_path / "a" / "b"
    output.prepare_folder(folder)
    (folder / output.STRIP).write_text("old")
    (folder / "mine.txt").write_text("stays")
    output.prepare_folder(folder)
    assert [path.name for path in folder.iterdir()] == ["mine.txt"]


@pytest.mark.parametrize("below", ["", "inner"])
def test_a_file_in_the_way_is_reported(tmp_path, below):
    (tmp_path / "file").write_text("")
    with pytest.raises(InvalidFile, match="cannot be"):
        output.prepare_folder(tmp_path / "file" / below)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write all")
def test_a_folder_without_permission_is_reported(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(InvalidFile, match="Permission denied"):
        output.prepare_folder(tmp_path)


def test_without_matplotlib_the_strip_is_left_out(tmp_path, monkeypatch):
    def missing(*_, **__):
        raise MissingMatplotlib

    for writer in ("save_recording", "write_replay"):
        monkeypatch.setattr(output, writer, lambda recording, path: path)
    monkeypatch.setattr(output, "write_strip", missing)
    said = []
    paths = output.write_files(tmp_path, None, said.append)
    assert [path.name for path in paths] == [output.RECORDING, output.REPLAY]
    assert len(said) == 1 and "strip.png" in said[0] and "matplotlib" in said[0]
