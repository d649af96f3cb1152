# SPDX-License-Identifier: Apache-2.0
"""Topics, within one process and between two."""

import signal

import pytest
from geometry_msgs.msg import Pose, PoseArray
from rclpy._rclpy_pybind11 import RCLError
from rclpy.duration import Duration
from rclpy.exceptions import InvalidTopicNameException
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
    qos_profile_sensor_data,
)
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.wait_for_message import wait_for_message
from std_msgs.msg import Empty, Float64, String

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def test_messages_arrive_in_order(node, spin):
    got = []
    node.create_subscription(Float64, "numbers", lambda m: got.append(m.data), 100)
    publisher = node.create_publisher(Float64, "numbers", 100)
    assert spin(lambda: publisher.get_subscription_count() == 1, node)
    for value in range(50):
        publisher.publish(Float64(data=float(value)))
    assert spin(lambda: len(got) == 50, node)
    assert got == [float(value) for value in range(50)]


def test_only_the_newest_message_waits_at_depth_one(node, spin):
    got = []
    subscription = node.create_subscription(Float64, "numbers", lambda m: got.append(m.data), 1)
    publisher = node.create_publisher(Float64, "numbers", 1)
    assert spin(lambda: subscription.get_publisher_count() == 1, node)
    for value in range(20):
        publisher.publish(Float64(data=float(value)))
    assert spin(lambda: 19.0 in got, node)
    assert got == [19.0]


def test_empty_messages_and_nested_ones_arrive(node, spin):
    got = []
    for kind, topic in ((Empty, "nothing"), (PoseArray, "poses")):
        node.create_subscription(kind, topic, got.append, 10)
    publishers = [node.create_publisher(Empty, "nothing", 10)]
    publishers.append(node.create_publisher(PoseArray, "poses", 10))
    assert spin(lambda: all(p.get_subscription_count() for p in publishers), node)
    message = PoseArray(poses=[Pose(), Pose()])
    message.header.frame_id = "base"
    message.poses[1].position.x = 3.0
    publishers[0].publish(Empty())
    publishers[1].publish(message)
    assert spin(lambda: len(got) == 2, node)
    assert Empty() in got
    assert message in got


def test_raw_subscription_and_raw_publish(node, spin):
    got = []
    node.create_subscription(String, "text", got.append, 10, raw=True)
    publisher = node.create_publisher(String, "text", 10)
    assert spin(lambda: publisher.get_subscription_count() == 1, node)
    publisher.publish(serialize_message(String(data="as bytes")))
    assert spin(lambda: got, node)
    assert isinstance(got[0], bytes)
    assert deserialize_message(got[0], String) == String(data="as bytes")


def test_two_argument_callbacks_get_message_info(node, spin):
    got = []
    node.create_subscription(String, "text", lambda m, info: got.append((m.data, info)), 10)
    publisher = node.create_publisher(String, "text", 10)
    assert spin(lambda: publisher.get_subscription_count() == 1, node)
    publisher.publish(String(data="hello"))
    assert spin(lambda: got, node)
    text, info = got[0]
    assert text == "hello"
    assert 0 < info["source_timestamp"] <= info["received_timestamp"]


def test_late_joiners_get_latched_messages(node, spin):
    publisher = node.create_publisher(String, "map", LATCHED)
    for text in ("old", "new"):
        publisher.publish(String(data=text))
    got = []
    node.create_subscription(String, "map", got.append, LATCHED)
    assert spin(lambda: got, node)
    assert got == [String(data="new")]


def test_volatile_late_joiners_get_nothing_old(node, spin):
    publisher = node.create_publisher(String, "map", LATCHED)
    publisher.publish(String(data="old"))
    got = []
    node.create_subscription(String, "map", got.append, 1)
    assert spin(lambda: publisher.get_subscription_count() == 1, node)
    publisher.publish(String(data="new"))
    assert spin(lambda: got, node)
    assert got == [String(data="new")]


def test_incompatible_qos_is_warned_of_on_both_sides(node, spin, capfd):
    best_effort = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    got = []
    publisher = node.create_publisher(String, "mismatch", best_effort)
    node.create_subscription(String, "mismatch", got.append, 10)
    text = []

    def warned():
        captured = capfd.readouterr()
        text.append(captured.err + captured.out)
        return "".join(text).count("incompatible QoS") >= 2

    assert spin(warned, node)
    assert "No messages will be sent to it" in "".join(text)
    assert "No messages will be received from it" in "".join(text)
    assert "RELIABILITY" in "".join(text)
    assert publisher.get_subscription_count() == 0


def test_best_effort_subscription_hears_reliable_publisher(node, spin):
    got = []
    node.create_subscription(String, "text", got.append, qos_profile_sensor_data)
    publisher = node.create_publisher(String, "text", 10)
    assert spin(lambda: publisher.get_subscription_count() == 1, node)
    publisher.publish(String(data="x"))
    assert spin(lambda: got, node)


@pytest.mark.not_fast_dds("one type per topic in a participant")
def test_different_types_on_one_topic_do_not_mix(node, spin):
    got = []
    node.create_subscription(String, "mixed", got.append, 10)
    node.create_subscription(Float64, "mixed", got.append, 10)
    publisher = node.create_publisher(Float64, "mixed", 10)
    assert spin(lambda: publisher.get_subscription_count() == 1, node)
    publisher.publish(Float64(data=1.0))
    assert spin(lambda: got, node)
    assert got == [Float64(data=1.0)]


def test_publishing_another_type_is_refused(node):
    publisher = node.create_publisher(Float64, "numbers", 1)
    with pytest.raises(TypeError):
        publisher.publish(String(data="1"))


@pytest.mark.parametrize(("qos", "error"), [(-1, ValueError), ("ten", TypeError), (1.5, TypeError)])
def test_bad_qos_is_refused(node, qos, error):
    with pytest.raises(error):
        node.create_publisher(Float64, "numbers", qos)


@pytest.mark.parametrize("topic", ["", "with space", "9lives", "end/", "double//slash"])
def test_bad_topic_names_are_refused(node, topic):
    with pytest.raises(InvalidTopicNameException):
        node.create_publisher(Float64, topic, 1)


def test_callback_of_the_wrong_shape_is_refused(node):
    with pytest.raises(RuntimeError):
        node.create_subscription(Float64, "numbers", lambda: None, 1)


def test_destroyed_subscription_is_silent(node, spin):
    got, other = [], []
    subscription = node.create_subscription(String, "text", got.append, 10)
    node.create_subscription(String, "text", other.append, 10)
    publisher = node.create_publisher(String, "text", 10)
    assert spin(lambda: publisher.get_subscription_count() == 2, node)
    assert node.destroy_subscription(subscription)
    assert not node.destroy_subscription(subscription)
    publisher.publish(String(data="x"))
    assert spin(lambda: other, node)
    assert got == []


def test_manual_liveliness_and_acknowledgement(node, spin):
    qos = QoSProfile(
        depth=5,
        liveliness=LivelinessPolicy.MANUAL_BY_TOPIC,
        liveliness_lease_duration=Duration(seconds=5),
    )
    got = []
    node.create_subscription(String, "alive", got.append, qos)
    publisher = node.create_publisher(String, "alive", qos)
    assert spin(lambda: publisher.get_subscription_count() == 1, node)
    publisher.assert_liveliness()
    publisher.publish(String(data="x"))
    assert publisher.wait_for_all_acked(Duration(seconds=10))
    assert spin(lambda: got, node)


def test_wait_for_message(node):
    publisher = node.create_publisher(String, "map", LATCHED)
    publisher.publish(String(data="here"))
    found, message = wait_for_message(String, node, "map", qos_profile=LATCHED, time_to_wait=60)
    assert (found, message) == (True, String(data="here"))
    assert wait_for_message(String, node, "never", time_to_wait=0.05) == (False, None)


@pytest.mark.processes
def test_two_processes_talk_and_latched_data_waits(node, spin, program):
    talker = program("talker.py")
    talker.wait_for_line("ready")
    counts, maps = [], []
    node.create_subscription(String, "chatter", lambda m: counts.append(int(m.data)), 10)
    node.create_subscription(String, "map", lambda m: maps.append(m.data), LATCHED)
    assert spin(lambda: len(counts) >= 5 and maps, node)
    assert counts == list(range(counts[0], counts[0] + len(counts)))
    assert maps == ["the map"]
    assert ("talker", "/") in node.get_node_names_and_namespaces()
    talker.process.send_signal(signal.SIGINT)
    assert talker.finish()[0] == 0
    assert spin(lambda: node.count_publishers("chatter") == 0, node)


@pytest.mark.processes
def test_remapping_on_the_command_line_of_another_process(node, spin, program):
    remaps = ["-r", "__ns:=/left", "-r", "__node:=speaker", "-r", "chatter:=words"]
    talker = program("talker.py", "--ros-args", *remaps)
    got = []
    node.create_subscription(String, "/left/words", got.append, 10)
    assert spin(lambda: got, node)
    assert spin(lambda: ("speaker", "/left") in node.get_node_names_and_namespaces(), node)
    talker.process.send_signal(signal.SIGINT)
    assert talker.finish()[0] == 0


def test_what_is_left_after_a_shutdown(node, context):
    publisher = node.create_publisher(String, "words", 1)
    subscription = node.create_subscription(String, "words", print, 1)
    timer = node.create_timer(1.0, None)
    context.shutdown()
    assert publisher.topic_name == subscription.topic_name == "/words"
    timer.cancel()
    assert timer.is_canceled()
    for use in (
        lambda: publisher.publish(String()),
        publisher.get_subscription_count,
        lambda: node.create_publisher(String, "more", 1),
        lambda: node.create_timer(1.0, None),
        lambda: node.create_guard_condition(print),
    ):
        with pytest.raises(RCLError):
            use()
    publisher.destroy()


class Hoarder(Node):
    """A node with attributes of its own, under names that programs like."""

    def __init__(self, **kwargs):
        super().__init__("hoarder", **kwargs)
        self._name = self._namespace = self._info = self._entry = self._arguments = None
        self._open = self._destroyed = self._released = self._public = self._profile = True

    def _keep(self):
        raise AssertionError

    _destroy = _announce = _release = _full_name = _endpoints = _keep


def test_attributes_of_users_do_no_harm(context, spin):
    node = Hoarder(context=context)
    got = []
    node.create_subscription(String, "words", got.append, 1)
    publisher = node.create_publisher(String, "words", 1)
    assert spin(lambda: publisher.get_subscription_count() == 1, node)
    publisher.publish(String(data="a"))
    assert spin(lambda: got, node)
    assert node.get_fully_qualified_name() == "/hoarder"
    assert spin(lambda: node.get_publishers_info_by_topic("words"), node)
    assert node.destroy_publisher(publisher)
    node.destroy_node()
