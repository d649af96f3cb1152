# SPDX-License-Identifier: Apache-2.0
"""`ccr demo cube` as people run it: through real processes, on a ROS graph of its own."""

import math
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from mcap.reader import make_reader

from ccr_ros.demo.cube_scene import CUBE, HEIGHT
from ccr_ros.viz.recording_json import load_recording

ROOT = Path(__file__).resolve().parents[1]


def run(folder, *args):
    env = {key: value for key, value in os.environ.items() if key != "ROS_DOMAIN_ID"}
    env["PYTHONPATH"] = os.pathsep.join(filter(None, [str(ROOT), env.get("PYTHONPATH")]))
    command = [sys.executable, "-P", "-m", "ccr_ros.cli", "demo", *args]
    return subprocess.run(
        command, cwd=folder, env=env, capture_output=True, text=True, timeout=280, check=False
    )


@pytest.mark.processes
@pytest.mark.long
@pytest.mark.timeout(300)
def test_a_cube_is_grasped_turned_to_both_sides_and_put_down(tmp_path):
    done = run(tmp_path, "cube", "--hold", "2", "--record", "run.mcap")
    assert done.returncode == 0, done.stdout + done.stderr
    recording = load_recording(tmp_path / "demo" / "recording.json")
    phases = [phase for _, phase in recording.phases]
    turns = ["turn left", "turn back", "turn right", "turn back"]
    assert phases == [
        "calibrating", "close", "hold", *turns, "hold", "put down", "release", "open",
    ]  # fmt: skip

    held = [f for f in recording.frames if f.grip is not None and f.grip.held]
    angles = [math.degrees(recording.turned(f, CUBE.name)) for f in held]
    assert max(angles) > 16.0 and min(angles) < -16.0
    assert min(f.grip.margin for f in held) > 0.05
    assert all("table" not in f.objects for f in held)
    assert all(abs(f.objects[CUBE.name].position[2] - HEIGHT) < 0.006 for f in held)
    last = recording.frames[-1]
    assert not last.grip.contacts and not last.grip.held
    assert {"cube", "table", "leg"} == set(last.objects)
    assert max(abs(f.pulls).max() for f in last.fingers.values()) < 0.0005

    assert re.search(r"turned by up to \d+\.\d deg to the left and \d+\.\d deg", done.stdout)
    assert re.search(r"smallest friction margin on the way 0\.\d\d", done.stdout)
    with (tmp_path / "run.mcap").open("rb") as file:
        summary = make_reader(file).get_summary()
    topics = {channel.topic for channel in summary.channels.values()}
    assert {"/gripper/grasp_state", "/gripper/object_pose", "/gripper/finger_1/state"} <= topics


@pytest.mark.processes
def test_an_object_that_there_is_not_is_refused(tmp_path):
    done = run(tmp_path, "pyramid")
    assert done.returncode == 2 and done.stdout == ""
    assert "sphere, cube" in done.stderr
