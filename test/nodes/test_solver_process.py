# SPDX-License-Identifier: Apache-2.0
"""The solver node as a process of its own: on the graph, at its end, and when it cannot start."""

import signal

import pytest
from node_processes import WAIT, end, failed_start, launcher
from probe import shown
from visualization_msgs.msg import MarkerArray


@pytest.fixture
def launch():
    """Return a function that starts a solver node in a process; none is left behind."""
    yield from launcher("solver_node")


@pytest.mark.processes
def test_two_processes_and_a_probe(probe, launch, small_gripper):
    left = launch("-r", "__ns:=/left", "-p", f"gripper_file:={small_gripper}")
    right = launch("-r", "__ns:=/right", "-p", f"gripper_file:={small_gripper}")
    one = probe.pull_and_wait("/left/thumb", [0.005, 0.0])
    other = probe.pull_and_wait("/right/thumb", [0.0, 0.004])
    assert (list(one.pulls), list(other.pulls)) == ([0.005, 0.0], [0.0, 0.004])
    assert one.header.frame_id == "left/thumb_base"
    assert other.header.frame_id == "right/thumb_base"
    assert end(left, signal.SIGINT) == 0
    assert end(right, signal.SIGTERM) == 0


@pytest.mark.processes
def test_who_comes_late_sees_all_at_once(probe, launch):
    process = launch("-r", "__ns:=/gripper")
    probe.pull_and_wait("finger_2", [0.003])
    arrays = probe.markers()
    fingers = [f"finger_{i}/disks" for i in (1, 2, 3)]
    probe.until(lambda: arrays and all(shown(arrays[-1], f) for f in fingers), "all fingers")
    late = probe.join(MarkerArray, "markers")
    array = probe.until(lambda: late, "the latched markers")[0]
    assert len(shown(array, "finger_3/disks")) == 10
    assert end(process, signal.SIGINT) == 0


@pytest.mark.parametrize("how", ["SIGINT", "SIGTERM"])
def test_ends_well_in_the_middle_of_a_solve(launch, how):
    """The context is down when the solve is done, so that its pose can no more be published."""
    interrupted = f"""
import os, signal, sys, time
from ccr_ros.runtime import enable_ros
enable_ros()
from ccr_ros.model import FingerSolver
solve = FingerSolver.solve
def interrupted(*args):
    os.kill(os.getpid(), signal.{how})
    time.sleep(0.5)  # rclpy answers signals in a thread of its own
    return solve(*args)
FingerSolver.solve = interrupted
from ccr_ros.nodes.entry import solver_node
sys.exit(solver_node())
"""
    process = launch("-r", "__ns:=/gripper", script=interrupted)
    _, errors = process.communicate(timeout=WAIT)
    assert "Traceback" not in errors
    assert process.returncode == 0


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("-p", "gripper_file:=no_such_gripper"), "gripper_sphere"),
        (("-p", "gripper_file:=straight"), "straight.yaml"),
        (("-p", "arcs_per_segment:=0"), "arcs_per_segment"),
        (("--params-file", "no_such_file.yaml"), "no_such_file.yaml"),
        (("-r", "__ns:=/1bad"), "1bad"),
        (("--bogus",), "--bogus"),
    ],
)
def test_what_cannot_start_says_why_in_one_line(arguments, text):
    assert text in failed_start("solver_node", *arguments)
