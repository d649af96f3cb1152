# SPDX-License-Identifier: Apache-2.0
"""What nodes see of the graph, names, and tf broadcasters."""

import time

import pytest
import rclpy.node
from geometry_msgs.msg import PoseArray, TransformStamped
from rclpy.exceptions import (
    InvalidHandle,
    InvalidNamespaceException,
    InvalidNodeNameException,
    NoTypeSupportImportedException,
)
from rclpy.node import Node, NodeNameNonExistentError
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    InvalidQoSProfileException,
    QoSProfile,
    ReliabilityPolicy,
    qos_profile_parameters,
    qos_profile_sensor_data,
)
from std_msgs.msg import String
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from tf2_ros import StaticTransformBroadcaster, TransformBroadcaster

LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def test_names(make_node):
    node = make_node("solver", namespace="gripper/left")
    assert node.get_name() == "solver"
    assert node.get_namespace() == "/gripper/left"
    assert node.get_fully_qualified_name() == "/gripper/left/solver"
    assert node.get_logger().name == "gripper.left.solver"


@pytest.mark.parametrize("name", ["", "with space", "1st", "a/b"])
def test_bad_node_names(make_node, name):
    with pytest.raises(InvalidNodeNameException):
        make_node(name)


@pytest.mark.parametrize("namespace", ["/a b", "/1", "/a//b", "/a/"])
def test_bad_namespaces(make_node, namespace):
    with pytest.raises(InvalidNamespaceException):
        make_node("n", namespace=namespace)


def test_topics_and_owners(make_node, spin):
    node = make_node("solver", namespace="/left")
    viewer = make_node("viewer")
    node.create_publisher(PoseArray, "backbone", LATCHED)
    viewer.create_subscription(PoseArray, "/left/backbone", lambda _: None, 1)
    assert spin(lambda: viewer.count_publishers("/left/backbone") == 1, viewer)
    assert node.count_subscribers("backbone") == 1
    topics = dict(viewer.get_topic_names_and_types())
    assert topics["/left/backbone"] == ["geometry_msgs/msg/PoseArray"]
    assert {("solver", "/left"), ("viewer", "/")} <= set(viewer.get_node_names_and_namespaces())
    published = dict(viewer.get_publisher_names_and_types_by_node("solver", "/left"))
    assert published["/left/backbone"] == ["geometry_msgs/msg/PoseArray"]
    (info,) = viewer.get_publishers_info_by_topic("/left/backbone")
    assert (info.node_name, info.node_namespace) == ("solver", "/left")
    assert info.topic_type == "geometry_msgs/msg/PoseArray"
    assert info.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
    assert info.qos_profile.reliability == ReliabilityPolicy.RELIABLE
    assert str(info.topic_type_hash).startswith("RIHS01_")
    with pytest.raises(NodeNameNonExistentError):
        viewer.get_publisher_names_and_types_by_node("nobody", "/")


def test_destroyed_nodes_leave(make_node, spin):
    node, viewer = make_node("short"), make_node("viewer")
    node.create_publisher(String, "text", 1)
    assert spin(lambda: "short" in viewer.get_node_names(), viewer)
    node.destroy_node()
    assert spin(lambda: "short" not in viewer.get_node_names(), viewer)
    assert spin(lambda: viewer.count_publishers("text") == 0, viewer)


def test_node_subclasses(context):
    class Own(Node):
        def __init__(self):
            super().__init__("own", context=context)
            self.declare_parameter("p", 1)

    node = Own()
    assert node.get_parameter("p").value == 1
    node.destroy_node()


def test_the_node_module_knows_what_programs_import_from_it():
    for name in ("Publisher", "Subscription", "Client", "Service", "Timer", "Rate", "QoSProfile"):
        assert getattr(rclpy.node, name).__name__ == name
    assert rclpy.node.HIDDEN_NODE_PREFIX == "_"
    assert issubclass(rclpy.node.ReentrantCallbackGroup, rclpy.node.CallbackGroup)


def test_publishers_take_message_classes_only(node):
    for kind in (int, "std_msgs/msg/String"):
        with pytest.raises((NoTypeSupportImportedException, AttributeError, TypeError)):
            node.create_publisher(kind, "text", 1)


def test_qos_profiles():
    assert QoSProfile(depth=3).history == HistoryPolicy.KEEP_LAST
    assert qos_profile_sensor_data.reliability == ReliabilityPolicy.BEST_EFFORT
    assert qos_profile_sensor_data.depth == 5
    assert qos_profile_parameters.depth == 1000
    assert QoSProfile(depth=3) == QoSProfile(depth=3)
    assert QoSProfile(depth=3) != QoSProfile(depth=4)
    with pytest.raises(InvalidQoSProfileException):
        QoSProfile()
    with pytest.raises(InvalidQoSProfileException):
        QoSProfile(history=HistoryPolicy.KEEP_LAST)
    with pytest.warns(UserWarning, match="zero depth"):
        QoSProfile(depth=0)


def test_services_are_counted(node, spin):
    node.create_client(Trigger, "ask")
    node.create_service(Trigger, "ask", lambda request, response: response)
    node.create_service(Trigger, "/ask", lambda request, response: response)
    assert spin(lambda: node.count_services("ask") == 2 and node.count_clients("/ask") == 1, node)
    assert node.count_services("nobody") == 0
    for count in (node.count_services, node.count_clients):
        with pytest.raises(ValueError, match="is invalid"):
            count("42")
        with pytest.raises(TypeError):
            count(42)


def test_counting_does_not_remap_but_infos_do(make_node, spin):
    node = make_node(cli_args=["--ros-args", "-r", "from:=to"])
    node.create_publisher(String, "from", 1)
    assert spin(lambda: node.count_publishers("/to") == 1, node)
    assert node.count_publishers("from") == 0
    assert len(node.get_publishers_info_by_topic("from")) == 1


def test_only_what_was_created_is_listed(node):
    assert [publisher.topic_name for publisher in node.publishers] == ["/parameter_events"]


def test_handles_are_context_managers_until_destroyed(node):
    publisher = node.create_publisher(String, "text", 1)
    subscription = node.create_subscription(String, "text", print, 1)
    timer = node.create_timer(10.0, print)
    service = node.create_service(Trigger, "ask", lambda request, response: response)
    client = node.create_client(Trigger, "ask")
    made = (publisher, subscription, timer, service, client)
    for entity in made:
        with entity.handle:
            pass
    node.destroy_publisher(publisher)
    node.destroy_subscription(subscription)
    node.destroy_timer(timer)
    node.destroy_service(service)
    node.destroy_client(client)
    node.destroy_node()
    for entity in (*made, node):
        with pytest.raises(InvalidHandle), entity.handle:
            pass


def test_messages_can_be_taken_without_spinning(node):
    subscription = node.create_subscription(String, "text", print, 1)
    publisher = node.create_publisher(String, "text", 1)
    publisher.publish(String(data="x"))
    taken = None
    end = time.monotonic() + 60
    while taken is None and time.monotonic() < end:
        with subscription.handle:
            taken = subscription.handle.take_message(subscription.msg_type, False)
    message, info = taken
    assert message == String(data="x")
    assert info["source_timestamp"] > 0


def test_transform_broadcasters(node, spin):
    moving, fixed = [], []
    node.create_subscription(TFMessage, "/tf", moving.append, 10)
    broadcaster, static = TransformBroadcaster(node), StaticTransformBroadcaster(node)
    assert spin(lambda: broadcaster.pub_tf.get_subscription_count() == 1, node)
    transform = TransformStamped(child_frame_id="tip")
    transform.header.frame_id = "base"
    broadcaster.sendTransform([transform, transform])
    static.sendTransform(transform)
    static.sendTransform(TransformStamped(child_frame_id="other"))
    transform.transform.translation.x = 1.0
    static.sendTransform(transform)
    node.create_subscription(TFMessage, "/tf_static", fixed.append, LATCHED)
    assert spin(lambda: moving and fixed, node)
    assert len(moving[0].transforms) == 2
    latest = {t.child_frame_id: t.transform.translation.x for t in fixed[-1].transforms}
    assert latest == {"tip": 1.0, "other": 0.0}


def test_what_could_not_be_made_is_not_in_the_graph(make_node, spin):
    node, viewer = make_node("maker"), make_node("viewer")
    with pytest.raises(RuntimeError):
        node.create_subscription(String, "text", lambda: None, 1)
    other = node.create_publisher(String, "other", 1)
    assert spin(lambda: viewer.count_publishers("other") == 1, viewer)
    assert viewer.count_subscribers("text") == 0
    other.destroy()
    assert spin(lambda: viewer.count_publishers("other") == 0, viewer)
