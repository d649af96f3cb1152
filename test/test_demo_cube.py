# SPDX-License-Identifier: Apache-2.0
"""The pieces of the cube's demo; test_demo_cube_run.py runs the whole."""

import math
from dataclasses import replace

import numpy as np
import pytest
import rclpy
from ccr_msgs.msg import GraspContact, GraspState, ObjectArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter

from ccr_ros.demo.cube import HELD, THERE, CubeNode
from ccr_ros.demo.cube_scene import CUBE, EDGE, GRIPPER_FILE, HEIGHT, TABLE
from ccr_ros.demo.cube_summary import cube_lines
from ccr_ros.demo.kinds import NAMES, demo_kind
from ccr_ros.demo.objects_seen import ObjectsSeen
from ccr_ros.model import InvalidValue, Pose, UnknownName, load_gripper
from ccr_ros.nodes.conversions import pose_message
from ccr_ros.nodes.qos import LATCHED
from ccr_ros.resources import find_config
from ccr_ros.viz.recorded_grasp import GripContact, GripFrame, heading
from ccr_ros.viz.recording import FingerFrame, Frame, RecordedFinger, Recording
from ccr_ros.viz.recording_json import recording_from_json, recording_to_json
from ccr_ros.viz.strip import figure_of_recording

STORY = (
    ("close", False, 0.0, 0.1), ("hold", True, -1.0, 0.6), ("turn left", True, 19.0, 0.4),
    ("turn right", True, -21.0, 0.3), ("put down", False, -1.0, 0.0),
)  # fmt: skip


def turned(degrees):
    half = math.radians(degrees) / 2
    return Pose(np.array([0.0, 0.0, HEIGHT]), np.array([0.0, 0.0, math.sin(half), math.cos(half)]))


@pytest.fixture
def recording():
    """Two frames per phase of a story in which one finger presses with 0.1 N."""
    finger = FingerFrame(
        pulls=[0.002], tensions=[3.0], backbone=[[0, 0, 0], [0, 0, 0.18]],
        orientations=[[0, 0, 0, 1]] * 2,
    )  # fmt: skip
    frames = []
    for phase, held, angle, margin in STORY:
        contact = GripContact("one", [0.02, 0.0, HEIGHT], 0.1, [0.0, 0.0, -0.05], margin)
        for _ in range(2):
            grip = GripFrame(CUBE.name, held, (contact,))
            poses = {CUBE.name: turned(angle)}
            frames.append(Frame(float(len(frames)), {"one": finger}, poses, phase, grip))
    return Recording("g", (RecordedFinger("one", Pose(), 0.008, ("main",)),), frames, (CUBE,))


def test_the_summary_tells_turns_margins_and_forces(recording):
    lines = cube_lines(recording)
    assert len(lines) == len(STORY) + 3
    assert "turn left" in lines[2] and "turned +20.0 deg" in lines[2] and "margin 0.40" in lines[2]
    assert "margin" not in lines[0]  # what is supported may slip as it likes
    assert "20.0 deg to the left and 20.0 deg to the right" in lines[-3]
    assert "smallest friction margin on the way 0.30 (at 6.0 s" in lines[-2]
    assert "0.1 N" in lines[-1]


def test_where_the_margin_is_not_told_it_is_not_the_smallest(recording):
    frames = list(recording.frames)
    contact = replace(frames[5].grip.contacts[0], margin=None)
    frames[5] = replace(frames[5], grip=replace(frames[5].grip, contacts=(contact,)))
    lines = cube_lines(replace(recording, frames=frames))
    assert "smallest friction margin on the way 0.30 (at 6.0 s" in lines[-2]


def test_a_recording_keeps_what_it_knows_of_the_grip(recording):
    back = recording_from_json(recording_to_json(recording))
    for was, now in zip(recording.frames, back.frames, strict=True):
        assert (now.grip.object, now.grip.held) == (was.grip.object, was.grip.held)
        assert now.grip.margin == was.grip.margin == now.grip.margin_of("one")
        np.testing.assert_allclose(now.grip.contacts[0].friction, [0.0, 0.0, -0.05])
    assert back.turned(back.frames[4], CUBE.name) == pytest.approx(math.radians(19.0), abs=1e-5)


def test_the_strip_shows_the_ends_of_phases_margins_and_the_turn(recording):
    pytest.importorskip("matplotlib")
    figure = figure_of_recording(recording, phases=("turn left", "turn right", "no such"))
    labels = [axes.get_label() for axes in figure.axes]
    assert labels[:2] == ["t=5.00", "t=7.00"]
    assert labels[2:] == ["tension", "margin", "turn", "pull"]
    assert "turn left" in figure.axes[0].get_title()
    (line,) = (li for li in figure.axes[4].get_lines() if len(li.get_ydata()) == 10)
    assert line.get_ydata()[4] == pytest.approx(19.0)


@pytest.mark.parametrize("angle", [-170.0, -20.0, 0.0, 20.0, 170.0])
def test_the_heading_is_the_turn_about_z_whatever_it_began_with(angle):
    tilted = Pose(np.zeros(3), np.array([0.1, -0.2, 0.3, math.sqrt(1 - 0.14)]))
    assert heading(turned(angle) @ tilted, tilted) == pytest.approx(math.radians(angle))


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"position": [0.0, 0.0]}, "position"),
        ({"force": -1.0}, "force"),
        ({"friction": [math.nan, 0.0, 0.0]}, "friction"),
        ({"margin": 1.5}, "margin"),
        ({"finger": ""}, "finger"),
    ],
)
def test_bad_contacts_are_refused(values, text):
    good = {"finger": "one", "position": [0.0] * 3, "force": 0.1, "friction": [0.0] * 3}
    GripContact(**good)
    with pytest.raises(InvalidValue, match=text):
        GripContact(**{**good, **values})


def test_the_table_is_under_the_cube_until_the_fingers_carry_it():
    seen = ObjectsSeen(TABLE)
    assert seen.take_grasp(GraspState(object=CUBE.name)) is None  # not told yet what that is
    seen.take_objects([CUBE])
    there = pose_message(CUBE.pose.position, CUBE.pose.orientation)
    contact = GraspContact(finger="finger_1", normal_force=0.1, margin=math.nan)
    grip = seen.take_grasp(GraspState(object=CUBE.name, pose=there, contacts=[contact]))
    assert (grip.held, grip.margin) == (False, None)
    cube, top, leg = seen.bodies()
    assert top.pose.position[2] + top.dimensions[2] / 2 == pytest.approx(HEIGHT - EDGE / 2)
    assert leg.pose.position[2] - leg.dimensions[0] / 2 == pytest.approx(0.0)
    seen.take_grasp(GraspState(object=CUBE.name, pose=there, held=True))
    pose = turned(20.0)
    seen.take_pose(pose_message(pose.position, pose.orientation))
    (cube,) = seen.bodies()
    assert heading(cube.pose, CUBE.pose) == pytest.approx(math.radians(20.0))


def test_demos_have_names():
    assert [demo_kind(name).world.name for name in NAMES] == ["demo_ball", "demo_cube"]
    with pytest.raises(UnknownName, match="sphere, cube"):
        demo_kind("pyramid")


def test_the_cubes_gripper_and_its_nodes_parameters_come_with_the_package(tmp_path):
    kind = demo_kind("cube")
    path, _ = kind.gripper(tmp_path)
    assert path == find_config(GRIPPER_FILE) and len(load_gripper(path).fingers) == 3
    assert all(file.is_file() for file in kind.parameter_files)


def test_the_cube_is_there_when_it_is_said_to_be():
    context = rclpy.Context()
    rclpy.init(args=[], context=context)
    cube = CubeNode(context=context, namespace="gripper")
    person = rclpy.create_node("person", context=context, namespace="gripper")
    executor = SingleThreadedExecutor(context=context)
    for node in (cube, person):
        executor.add_node(node)
    seen = []
    person.create_subscription(ObjectArray, "objects", seen.append, LATCHED)

    def until(condition):
        for _ in range(600):
            if seen and condition(seen[-1].objects):
                return seen[-1].objects
            executor.spin_once(timeout_sec=0.1)
        raise AssertionError(seen[-1:])

    try:
        until(lambda objects: not objects)
        cube.set_parameters([Parameter(THERE, value=True)])
        (there,) = until(lambda objects: objects)
        assert (there.name, there.held, there.mass) == (CUBE.name, False, 0.01)
        cube.set_parameters([Parameter(HELD, value=True)])
        until(lambda objects: objects and objects[0].held)
    finally:
        executor.shutdown()
        cube.destroy_node()
        person.destroy_node()
        context.try_shutdown()
