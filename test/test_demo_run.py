# SPDX-License-Identifier: Apache-2.0
"""`ccr demo` as people run it: through real processes, on a ROS graph of its own."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from ccr_ros.demo.script import BALL
from ccr_ros.runtime import real_ros
from ccr_ros.viz.recording_json import load_recording

ROOT = Path(__file__).resolve().parents[1]
PNG = b"\x89PNG\r\n\x1a\n"
TIMEOUT = 90


class Demo:
    """A running `ccr demo`, its output in files, so that it can be looked at meanwhile."""

    def __init__(self, folder, *args, **environ):
        self.folder = folder
        self._out, self._err = folder / "out.txt", folder / "err.txt"
        env = {key: value for key, value in os.environ.items() if key != "ROS_DOMAIN_ID"}
        env["PYTHONPATH"] = os.pathsep.join(filter(None, [str(ROOT), env.get("PYTHONPATH")]))
        with self._out.open("wb") as out, self._err.open("wb") as err:
            self.process = subprocess.Popen(
                [sys.executable, "-P", "-m", "ccr_ros.cli", "demo", *args],
                cwd=folder,
                env={**env, **environ},
                stdout=out,
                stderr=err,
                stdin=subprocess.DEVNULL,
            )

    @property
    def out(self):
        return self._out.read_text()

    @property
    def err(self):
        return self._err.read_text()

    def until(self, pattern):
        deadline = time.monotonic() + TIMEOUT
        while not (found := re.search(pattern, self.out, re.MULTILINE)):
            assert self.process.poll() is None, self.out + self.err
            assert time.monotonic() < deadline, self.out + self.err
            time.sleep(0.05)
        return found

    def pids(self):
        text = self.until(
            r"started solver_node \(process (\d+)\) and pull_publisher \(process (\d+)\)"
        )
        return int(text[1]), int(text[2])

    def wait(self):
        return self.process.wait(timeout=TIMEOUT)


@pytest.fixture
def start(tmp_path):
    """Return a function that starts demos; what still runs at the end is ended."""
    demos = []

    def start(*args, **environ):
        folder = tmp_path / str(len(demos))
        folder.mkdir()
        demos.append(Demo(folder, *args, **environ))
        return demos[-1]

    yield start
    for demo in demos:
        if demo.process.poll() is None:
            demo.process.terminate()
            demo.wait()


def gone(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return True
    return False


def heights(recording, name):
    base = recording.finger(name).base
    return np.array([base.points(f.fingers[name].backbone[-1])[2] for f in recording.frames])


@pytest.mark.processes
def test_a_run_leaves_valid_files_of_fingers_that_move_and_touch(start):
    demo = start("--seconds", "4")
    assert demo.wait() == 0, demo.out + demo.err
    assert all(gone(pid) for pid in demo.pids())
    assert demo.err == ""
    check_what_it_left(demo)


@pytest.mark.skipif(real_ros(), reason="ROS 2 has transports of its own")
def test_a_run_within_one_process_leaves_the_same(start):
    demo = start("--seconds", "4", EMBEDDED_ROS_TRANSPORT="local")
    assert demo.wait() == 0, demo.out + demo.err
    nodes = "solver_node (in this process) and pull_publisher (in this process)"
    assert f"started {nodes}\n" in demo.out
    (line,) = demo.err.splitlines()
    assert line.startswith("embedded_ros: nodes reach each other within this process only")
    check_what_it_left(demo)


@pytest.mark.skipif(real_ros(), reason="ROS 2 has transports of its own")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_signals_end_a_run_within_one_process(start, number, code):
    demo = start("--seconds", "20", EMBEDDED_ROS_TRANSPORT="local")
    demo.until(r"^(open|close) ")
    demo.process.send_signal(number)
    assert demo.wait() == code
    assert demo.err.splitlines()[1:] == ["ccr: interrupted; what the demo had started has ended"]


def check_what_it_left(demo):
    folder = demo.folder / "demo"
    assert sorted(p.name for p in folder.iterdir()) == [
        "recording.json",
        "replay.html",
        "strip.png",
    ]
    for path in folder.iterdir():
        assert f"demo/{path.name}" in demo.out
    assert (folder / "strip.png").read_bytes().startswith(PNG)
    replay = (folder / "replay.html").read_text()
    assert "gripper_sphere" in replay and "</html>" in replay
    assert not re.search(r"""(src|href)\s*=\s*["']?https?:""", replay)

    recording = load_recording(folder / "recording.json")
    assert [f.name for f in recording.fingers] == ["finger_1", "finger_2", "finger_3"]
    assert [o.name for o in recording.objects] == [BALL.name]
    assert 3.5 < recording.duration < 10 and len(recording.frames) > 40
    moments = [f.fingers[name] for f in recording.frames for name in f.fingers]
    assert len(moments) == 3 * len(recording.frames)
    assert all(moment.converged and not moment.stale for moment in moments)
    assert all(len(moment.backbone) == 10 and "main" in moment.cables for moment in moments)
    assert any(moment.contacts for moment in moments)
    for finger in recording.fingers:
        pulls = np.array([f.fingers[finger.name].pulls[0] for f in recording.frames])
        assert pulls.max() > 0.02 * finger.rest_lengths[0]
        assert pulls[-1] == 0.0
        tips = np.array([f.fingers[finger.name].backbone[-1] for f in recording.frames])
        assert np.linalg.norm(tips - tips[0], axis=1).max() > 0.02

    sent, poses, superseded = map(
        int, re.search(r"(\d+) sent; (\d+) answered by a pose, (\d+) superseded", demo.out).groups()
    )
    assert 0 < poses <= sent and poses + superseded <= sent
    assert re.search(r"^  latency +median \d+\.\d+ ms, 99th percentile \d", demo.out, re.MULTILINE)
    assert re.search(r"^  solve time +median \d", demo.out, re.MULTILINE)
    assert re.search(r"^  contacts +[1-9]\d* made", demo.out, re.MULTILINE)
    assert re.search(r"^  markers +[1-9]", demo.out, re.MULTILINE)


@pytest.mark.processes
def test_a_solver_that_dies_is_reported(start):
    demo = start("--seconds", "20")
    solver, puller = demo.pids()
    demo.until(r"^(open|close) ")
    os.kill(solver, signal.SIGKILL)
    assert demo.wait() == 1
    assert f"solver_node (process {solver}) ended too early (killed by SIGKILL)" in demo.err
    assert gone(puller)
    assert list((demo.folder / "demo").iterdir()) == []


@pytest.mark.processes
def test_a_publisher_that_dies_is_reported(start):
    demo = start("--seconds", "20")
    solver, puller = demo.pids()
    demo.until(r"^(open|close) ")
    os.kill(puller, signal.SIGKILL)
    assert demo.wait() == 1
    assert f"pull_publisher (process {puller}) ended too early (killed by SIGKILL)" in demo.err
    assert gone(solver)


@pytest.mark.processes
@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]
)
def test_signals_end_everything(start, number, code):
    demo = start("--seconds", "20")
    pids = demo.pids()
    demo.until(r"^(open|close) ")
    demo.process.send_signal(number)
    assert demo.wait() == code
    assert demo.err == "ccr: interrupted; what the demo had started has ended\n"
    assert all(gone(pid) for pid in pids)


@pytest.mark.long
def test_two_at_once_do_not_hear_each_other(start):
    demos = [start("--seconds", "4"), start("--seconds", "4")]
    assert [demo.wait() for demo in demos] == [0, 0], [demo.err for demo in demos]
    domains = {demo.until(r"ROS_DOMAIN_ID (\d+)")[1] for demo in demos}
    assert len(domains) == 2


@pytest.mark.processes
@pytest.mark.long
def test_two_in_one_domain_are_kept_apart(start):
    domain = os.environ["ROS_DOMAIN_ID"]
    demos = [start("--seconds", "12", ROS_DOMAIN_ID=domain) for _ in range(2)]
    assert 1 in [demo.wait() for demo in demos]
    said = "".join(demo.err for demo in demos)
    assert "other nodes publish /gripper/finger_1/state" in said
    assert f"ROS domain {domain}" in said


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (["--seconds", "2"], "seconds: 2.0 is not allowed"),
        (["--seconds", "long"], "--seconds: 'long' is not allowed"),
        (["--out", "out.txt"], "out.txt: cannot be the demo's folder"),
    ],
)
def test_bad_input_is_refused_before_anything_starts(start, args, message):
    demo = start(*args)
    assert demo.wait() == 2
    assert message in demo.err
    assert demo.out == ""
