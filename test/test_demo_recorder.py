# SPDX-License-Identifier: Apache-2.0
"""The demo's recorder, fed through real topics."""

import time

import pytest
import rclpy
from ccr_msgs.msg import CablePulls
from geometry_msgs.msg import PoseArray
from rclpy.executors import SingleThreadedExecutor
from std_msgs.msg import Header

from ccr_ros.demo.recorder import Recorder
from ccr_ros.demo.script import GRIPPER_FILE
from ccr_ros.model import FingerSolver, InvalidValue, load_gripper
from ccr_ros.nodes.conversions import pose_array, state_message
from ccr_ros.nodes.qos import COMMAND, LATCHED
from ccr_ros.resources import find_config


@pytest.fixture
def graph():
    """A recorder, a node that publishes for the solver, and a function that spins both."""
    context = rclpy.Context()
    rclpy.init(args=[], context=context)
    gripper = load_gripper(find_config(GRIPPER_FILE))
    recorder = Recorder(gripper, context=context)
    solver = rclpy.create_node("in_place_of_the_solver", context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(recorder)
    executor.add_node(solver)

    def spin(done, limit=20.0):
        end = time.monotonic() + limit
        while not done() and time.monotonic() < end:
            executor.spin_once(timeout_sec=0.02)
        return done()

    yield gripper, recorder, solver, spin
    executor.shutdown()
    recorder.destroy_node()
    solver.destroy_node()
    context.try_shutdown()


def test_no_frame_is_taken_before_the_whole_pose_of_every_finger(graph):
    """States alone are not poses: a finger's backbone may come later than its state."""
    gripper, recorder, solver, spin = graph
    header = Header(stamp=solver.get_clock().now().to_msg())
    pulls = solver.create_publisher(CablePulls, "finger_1/cable_pulls", COMMAND)
    held_back = []
    for mounted in gripper.fingers:
        name = mounted.finger.name
        solution = FingerSolver(mounted.finger).rest
        messages = {
            f"{name}/backbone": pose_array(header, solution.backbone, solution.quaternions),
            f"{name}/cables/main": pose_array(
                header, solution.cables["main"], solution.quaternions
            ),
            f"{name}/state": state_message(header, solution, stale=False, dropped=0),
        }
        for topic, message in messages.items():
            publisher = solver.create_publisher(type(message), topic, LATCHED)
            if topic == "finger_3/backbone":
                assert isinstance(message, PoseArray)
                held_back.append((publisher, message))
            else:
                publisher.publish(message)
    assert spin(lambda: recorder.complete and pulls.get_subscription_count())
    pulls.publish(CablePulls(header=header, pulls=[0.0]))
    assert spin(lambda: recorder.elapsed is not None and recorder.elapsed > 0.3)
    with pytest.raises(InvalidValue):
        recorder.recording()

    for publisher, message in held_back:
        publisher.publish(message)

    def recorded():
        try:
            return len(recorder.recording().frames) > 1
        except InvalidValue:
            return False

    assert spin(recorded)
    assert all(len(frame.fingers) == 3 for frame in recorder.recording().frames)
