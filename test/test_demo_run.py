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
import rclpy
from ccr_msgs.msg import FingerState
from mcap.reader import make_reader

from ccr_ros.demo.design import FILES
from ccr_ros.demo.scene import BALL, GRIP_FORCE
from ccr_ros.model import load_gripper
from ccr_ros.runtime import real_ros
from ccr_ros.viz.recording_json import load_recording

NODE_NAMES = ("solver_node", "servo_bridge_node", "gripper_coordinator_node", "demo_ball")
ROOT = Path(__file__).resolve().parents[1]
PNG = b"\x89PNG\r\n\x1a\n"
TIMEOUT = 110


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
        """Process ids of the nodes, by name."""
        return {
            name: int(self.until(rf"^started {name} \(process (\d+)\)")[1]) for name in NODE_NAMES
        }

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


@pytest.mark.processes
def test_a_run_grasps_holds_and_lets_go_and_leaves_valid_files(start):
    demo = start("--hold", "2", "--record", "run.mcap")
    assert demo.wait() == 0, demo.out + demo.err
    assert all(gone(pid) for pid in demo.pids().values())
    assert demo.err == ""
    check_what_it_left(demo)
    check_what_it_recorded(demo.folder / "run.mcap")


@pytest.mark.skipif(real_ros(), reason="ROS 2 has transports of its own")
def test_a_run_within_one_process_leaves_the_same(start):
    demo = start("--hold", "2", EMBEDDED_ROS_TRANSPORT="local")
    assert demo.wait() == 0, demo.out + demo.err
    assert all(f"started {name} (in this process)\n" in demo.out for name in NODE_NAMES)
    (line,) = demo.err.splitlines()
    assert line.startswith("embedded_ros: nodes reach each other within this process only")
    check_what_it_left(demo)


@pytest.mark.skipif(real_ros(), reason="ROS 2 has transports of its own")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_signals_end_a_run_within_one_process(start, number, code):
    demo = start("--hold", "20", EMBEDDED_ROS_TRANSPORT="local")
    demo.until(r"^(calibrating|closing) ")
    demo.process.send_signal(number)
    assert demo.wait() == code
    assert demo.err.splitlines()[1:] == ["ccr: interrupted; what the demo had started has ended"]


def check_what_it_left(demo):
    folder = demo.folder / "demo"
    left = ["recording.json", "replay.html", "strip.png"]
    assert sorted(p.name for p in folder.iterdir()) == sorted([*left, *FILES])
    for name in (*left, FILES[0]):
        assert f"demo/{name}" in demo.out
    assert len(load_gripper(folder / FILES[0]).fingers) == 3
    assert (folder / "strip.png").read_bytes().startswith(PNG)
    replay = (folder / "replay.html").read_text()
    assert "gripper_sphere" in replay and "</html>" in replay
    assert not re.search(r"""(src|href)\s*=\s*["']?https?:""", replay)

    recording = load_recording(folder / "recording.json")
    assert [f.name for f in recording.fingers] == ["finger_1", "finger_2", "finger_3"]
    assert [o.name for o in recording.objects] == [BALL.name]
    phases = [name for _, name in recording.phases]
    assert phases == [
        "calibrating",
        "closing",
        "holding 10 g",
        "holding 25 g",
        "holding, timed release",
        "releasing",
        "open",
    ]
    moments = [f.fingers[name] for f in recording.frames for name in f.fingers]
    assert len(moments) == 3 * len(recording.frames)
    assert all(moment.converged and not moment.stale for moment in moments)
    assert all(len(moment.backbone) == 10 and "main" in moment.cables for moment in moments)
    assert all(moment.servo_angles is not None for moment in moments[-3:])
    held = [f for f in recording.frames if f.phase == "holding, timed release"]
    assert any(
        all(
            sum(c.force for c in finger.contacts) == pytest.approx(GRIP_FORCE, abs=0.05)
            for finger in frame.fingers.values()
        )
        for frame in held
    )
    for finger in recording.fingers:
        pulls = np.array([f.fingers[finger.name].pulls[0] for f in recording.frames])
        assert pulls.max() > 0.03 * finger.rest_lengths[0]
        assert pulls[-1] < 0.002 * finger.rest_lengths[0]
    height = [f.objects[BALL.name].position[2] for f in recording.frames]
    assert height[0] == pytest.approx(0.110) and min(height) < 0.109  # drawn in, no more on a stand

    for line in ("pulls", "poses", "latency", "solve time", "contacts", "markers"):
        assert re.search(rf"^  {line} +\S", demo.out, re.MULTILINE)
    assert re.search(r"^ +\d+\.\d s  holding 10 g +grip 0\.\d", demo.out, re.MULTILINE)


def check_what_it_recorded(path):
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    counts = summary.statistics.channel_message_counts
    found = {channel.topic: counts.get(key, 0) for key, channel in summary.channels.items()}
    for topic in (
        "finger_1/state",
        "finger_2/cable_pulls",
        "finger_3/cable_pull_commands",
        "finger_3/backbone",
        "finger_1/cables/main",
        "objects",
        "markers",
        "gripper_state",
        "servo_state",
        "servo_commands",
        "joint_states",
    ):
        assert found[f"/gripper/{topic}"] > 0, topic
    assert found["/tf"] > 0 and found["/tf_static"] > 0 and found["/diagnostics"] > 0


@pytest.mark.processes
@pytest.mark.parametrize("name", ["solver_node", "gripper_coordinator_node"])
def test_a_node_that_dies_is_reported(start, name):
    demo = start("--hold", "20")
    pids = demo.pids()
    demo.until(r"^(calibrating|closing) ")
    os.kill(pids[name], signal.SIGKILL)
    assert demo.wait() == 1
    assert f"{name} (process {pids[name]}) ended too early (killed by SIGKILL)" in demo.err
    assert all(gone(pid) for pid in pids.values())
    assert {path.name for path in (demo.folder / "demo").iterdir()} == set(FILES)


@pytest.mark.processes
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGHUP, 129)])
def test_signals_end_everything(start, number, code):
    demo = start("--hold", "20")
    pids = demo.pids()
    demo.until(r"^(calibrating|closing) ")
    demo.process.send_signal(number)
    assert demo.wait() == code
    assert demo.err == "ccr: interrupted; what the demo had started has ended\n"
    assert all(gone(pid) for pid in pids.values())


@pytest.mark.processes
@pytest.mark.long
def test_two_at_once_do_not_hear_each_other(start):
    first, second = start("--hold", "20"), start("--hold", "20")
    domains = [demo.until(r"ROS_DOMAIN_ID (\d+)")[1] for demo in (first, second)]
    assert domains[0] != domains[1]
    for demo in (first, second):
        demo.until("^calibrating ")  # with nobody in the way


@pytest.mark.processes
def test_who_is_in_the_way_is_named(start):
    domain = os.environ["ROS_DOMAIN_ID"]
    context = rclpy.Context()
    rclpy.init(args=[], context=context)
    rival = rclpy.create_node("rival", namespace="/gripper", context=context)
    rival.create_publisher(FingerState, "finger_1/state", 1)
    demo = start("--hold", "20", ROS_DOMAIN_ID=domain)
    assert demo.wait() == 1
    assert "other nodes publish /gripper/finger_1/state" in demo.err
    assert f"ROS domain {domain}" in demo.err
    rival.destroy_node()
    context.try_shutdown()


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (["--hold", "1"], "hold: 1.0 is not allowed"),
        (["--hold", "long"], "--hold: 'long' is not allowed"),
        (["--record", "run.bag"], "--record: 'run.bag' is not allowed; must be a name that ends"),
        (["--out", "out.txt"], "out.txt: cannot be the demo's folder"),
    ],
)
def test_bad_input_is_refused_before_anything_starts(start, args, message):
    demo = start(*args)
    assert demo.wait() == 2
    assert message in demo.err
    assert demo.out == ""
