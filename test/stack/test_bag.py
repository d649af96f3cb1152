# SPDX-License-Identifier: Apache-2.0
"""What was recorded is read back with the decoder that Foxglove's own tools use."""

import sys
import time

import pytest
import rclpy
import yaml
from ccr_msgs.msg import Contact, FingerState
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

from ccr_ros.model import CcrError, InvalidFile, InvalidValue
from ccr_ros.stack.bag import BagWriter, checked_bag_path, record_topic

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def read(path):
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        return list(reader.iter_decoded_messages())


def test_messages_come_back_as_they_were(tmp_path):
    path = tmp_path / "run.mcap"
    state = FingerState(finger="thumb", cables=["main"], pulls=[0.005], contacts=[Contact(disk=7)])
    joints = JointState(name=["a", "b"], position=[0.5, -1.5])
    with BagWriter(path) as bag:
        bag.add_topic("/gripper/thumb/state", FingerState, LATCHED)
        bag.add_topic("/gripper/joint_states", JointState, QoSProfile(depth=10))
        bag.write("/gripper/thumb/state", serialize_message(state))
        bag.write("/gripper/joint_states", serialize_message(joints))
        assert bag.count == 2
    first, second = read(path)
    schema, channel, message, decoded = first
    assert (schema.name, schema.encoding) == ("ccr_msgs/msg/FingerState", "ros2msg")
    assert (channel.topic, channel.message_encoding) == ("/gripper/thumb/state", "cdr")
    assert abs(message.log_time - time.time_ns()) < 600e9
    assert (decoded.finger, list(decoded.pulls)) == ("thumb", [0.005])
    assert decoded.contacts[0].disk == 7
    assert list(second[3].position) == [0.5, -1.5]


def test_the_qos_is_kept_as_rosbag2_reads_it(tmp_path):
    with BagWriter(tmp_path / "run.mcap") as bag:
        bag.add_topic("/latched", JointState, LATCHED)
        bag.write("/latched", serialize_message(JointState()))
    ((_, channel, _, _),) = read(tmp_path / "run.mcap")
    (qos,) = yaml.safe_load(channel.metadata["offered_qos_profiles"])
    assert (qos["history"], qos["depth"]) == ("keep_last", 1)
    assert (qos["reliability"], qos["durability"]) == ("reliable", "transient_local")
    assert qos["deadline"] == {"sec": 9223372036, "nsec": 854775807}


def test_a_node_records_what_is_published(tmp_path):
    context = Context()
    rclpy.init(args=[], context=context)
    executor = SingleThreadedExecutor(context=context)
    talker = rclpy.create_node("talker", context=context, namespace="gripper")
    listener = rclpy.create_node("listener", context=context, namespace="gripper")
    try:
        executor.add_node(listener)
        with BagWriter(tmp_path / "run.mcap") as bag:
            record_topic(listener, bag, JointState, "joint_states", LATCHED)
            publisher = talker.create_publisher(JointState, "joint_states", LATCHED)
            publisher.publish(JointState(name=["a"], position=[2.5]))
            deadline = time.monotonic() + 30
            while not bag.count and time.monotonic() < deadline:
                executor.spin_once(timeout_sec=0.1)
    finally:
        executor.shutdown()
        talker.destroy_node()
        listener.destroy_node()
        context.try_shutdown()
    ((_, channel, _, decoded),) = read(tmp_path / "run.mcap")
    assert channel.topic == "/gripper/joint_states"
    assert list(decoded.position) == [2.5]


def test_bad_places_are_refused_before_any_work(tmp_path):
    with pytest.raises(InvalidValue, match=r"--record.*ends in \.mcap"):
        checked_bag_path(tmp_path / "run.bag")
    with pytest.raises(InvalidFile, match="there is no directory"):
        checked_bag_path(tmp_path / "none" / "run.mcap")
    (tmp_path / "folder.mcap").mkdir()
    with pytest.raises(InvalidFile, match="is a directory"):
        checked_bag_path(tmp_path / "folder.mcap")


def test_without_the_library_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "mcap.writer", None)
    with pytest.raises(CcrError, match="extra 'record'"):
        checked_bag_path(tmp_path / "run.mcap")
