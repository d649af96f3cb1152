# SPDX-License-Identifier: Apache-2.0
"""The demo's recorder, fed through real topics."""

import time

import pytest
import rclpy
from geometry_msgs.msg import PoseArray
from rclpy.executors import SingleThreadedExecutor
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from ccr_ros.demo.recorder import Recorder
from ccr_ros.demo.scene import GRIPPER_FILE
from ccr_ros.model import FingerSolver, InvalidValue, load_gripper
from ccr_ros.nodes.conversions import pose_array, state_message
from ccr_ros.nodes.qos import JOINT_STATES, LATCHED
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
    assert spin(lambda: recorder.complete)
    recorder.begin()
    recorder.set_phase("closing")
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
    recording = recorder.recording()
    assert all(len(frame.fingers) == 3 for frame in recording.frames)
    assert recording.phases[0][1] == "closing"


def test_servo_angles_are_put_to_their_fingers(graph):
    gripper, recorder, solver, spin = graph
    header = Header(stamp=solver.get_clock().now().to_msg())
    for mounted in gripper.fingers:
        name, solution = mounted.finger.name, FingerSolver(mounted.finger).rest
        for topic, message in (
            ("backbone", pose_array(header, solution.backbone, solution.quaternions)),
            ("cables/main", pose_array(header, solution.cables["main"], solution.quaternions)),
            ("state", state_message(header, solution, stale=False, dropped=0)),
        ):
            solver.create_publisher(type(message), f"{name}/{topic}", LATCHED).publish(message)
    joints = solver.create_publisher(JointState, "joint_states", JOINT_STATES)
    assert spin(lambda: recorder.complete and joints.get_subscription_count())
    recorder.begin()
    names = ["finger_2_main", "finger_1_main", "unknown"]

    def angles():
        joints.publish(JointState(name=names, position=[0.2, 0.1, 9.0]))
        try:
            last = recorder.recording().frames[-1].fingers
        except InvalidValue:
            return None
        return [last[n].servo_angles for n in ("finger_1", "finger_2", "finger_3")]

    def known():
        found = angles()
        return found is not None and found[0] is not None

    assert spin(known)
    one, two, three = angles()
    assert (list(one), list(two), three) == ([0.1], [0.2], None)
