# SPDX-License-Identifier: Apache-2.0
"""Interfaces described by the nodes that use them."""

import pytest
from geometry_msgs.msg import PoseStamped
from rclpy.parameter import Parameter
from std_msgs.msg import String
from std_srvs.srv import SetBool
from type_description_interfaces.msg import FieldType
from type_description_interfaces.srv import GetTypeDescription

START = "start_type_description_service"
#: of std_srvs/srv/SetBool
SERVICE_HASH = "RIHS01_abe9e4bb6b41b40e6789712c00ec8871923e089af3f667a79992a428cff2da0a"


@pytest.fixture
def user(make_node):
    """A node that uses some interfaces."""
    node = make_node("user")
    node.create_publisher(PoseStamped, "pose", 1)
    node.create_subscription(String, "text", lambda _: None, 1)
    node.create_service(SetBool, "switch", lambda request, response: response)
    return node


@pytest.fixture
def describe(user, make_node, spin):
    """Ask the node for an interface, by hash."""
    asker = make_node("asker")
    client = asker.create_client(GetTypeDescription, "user/get_type_description")
    assert client.wait_for_service(60)

    def call(type_hash, sources=True):
        request = GetTypeDescription.Request(
            type_name="any", type_hash=str(type_hash), include_type_sources=sources
        )
        future = client.call_async(request)
        assert spin(future.done, user, asker)
        return future.result()

    return call


@pytest.fixture
def topic_hash(user, spin):
    def find(topic):
        def infos():
            return [
                *user.get_publishers_info_by_topic(topic),
                *user.get_subscriptions_info_by_topic(topic),
            ]

        assert spin(infos, user)
        return infos()[0].topic_type_hash

    return find


def names(descriptions):
    return [description.type_name for description in descriptions]


def test_messages(describe, topic_hash):
    response = describe(topic_hash("pose"))
    assert (response.successful, response.failure_reason) == (True, "")
    main = response.type_description.type_description
    assert main.type_name == "geometry_msgs/msg/PoseStamped"
    assert [(field.name, field.type.nested_type_name) for field in main.fields] == [
        ("header", "std_msgs/msg/Header"),
        ("pose", "geometry_msgs/msg/Pose"),
    ]
    referenced = response.type_description.referenced_type_descriptions
    assert names(referenced) == [
        "builtin_interfaces/msg/Time",
        "geometry_msgs/msg/Point",
        "geometry_msgs/msg/Pose",
        "geometry_msgs/msg/Quaternion",
        "std_msgs/msg/Header",
    ]
    assert [
        (field.name, field.type.type_id, field.default_value) for field in referenced[3].fields
    ] == [
        ("x", FieldType.FIELD_TYPE_DOUBLE, "0.0"),
        ("y", FieldType.FIELD_TYPE_DOUBLE, "0.0"),
        ("z", FieldType.FIELD_TYPE_DOUBLE, "0.0"),
        ("w", FieldType.FIELD_TYPE_DOUBLE, "1.0"),
    ]
    assert names(response.type_sources) == [main.type_name, *names(referenced)]
    assert {source.encoding for source in response.type_sources} == {"msg"}
    assert "Pose pose" in response.type_sources[0].raw_file_contents


def test_sources_are_told_if_wanted(describe, topic_hash):
    response = describe(topic_hash("text"), sources=False)
    assert response.successful
    (field,) = response.type_description.type_description.fields
    assert (field.name, field.type.type_id) == ("data", FieldType.FIELD_TYPE_STRING)
    assert not response.type_sources


def test_services(describe):
    response = describe(SERVICE_HASH)
    assert response.successful
    assert response.type_description.type_description.type_name == "std_srvs/srv/SetBool"
    assert [(source.type_name, source.encoding) for source in response.type_sources] == [
        ("std_srvs/srv/SetBool", "srv"),
        ("builtin_interfaces/msg/Time", "msg"),
        ("service_msgs/msg/ServiceEventInfo", "msg"),
        ("std_srvs/srv/SetBool_Event", "implicit"),
        ("std_srvs/srv/SetBool_Request", "implicit"),
        ("std_srvs/srv/SetBool_Response", "implicit"),
    ]
    first, last = response.type_sources[0], response.type_sources[-1]
    assert "bool success" in first.raw_file_contents
    assert last.raw_file_contents == ""


@pytest.mark.parametrize(
    ("type_hash", "reason"),
    [
        ("nonsense", "Failed to parse type hash"),
        ("", "Failed to parse type hash"),
        ("RIHS01_1234", "Failed to parse type hash"),
        ("RIHS01_" + "0" * 64, "Type not currently in use by this node"),
    ],
)
def test_what_is_not_known(describe, type_hash, reason):
    response = describe(type_hash)
    assert not response.successful
    assert response.failure_reason == reason


def test_the_parameter(make_node):
    node = make_node("open")
    assert node.get_parameter(START).value is True
    assert node.describe_parameter(START).read_only
    assert any("type_description" in service.service_name for service in node.services)
    node = make_node("closed", parameter_overrides=[Parameter(START, value=False)])
    assert node.get_parameter(START).value is False
    assert not any("type_description" in service.service_name for service in node.services)
