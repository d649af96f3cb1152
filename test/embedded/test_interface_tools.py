# SPDX-License-Identifier: Apache-2.0
"""rosidl_runtime_py: messages to text and back, and lists of interfaces."""

import math

import pytest
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from example_interfaces.msg import WString
from geometry_msgs.msg import PoseStamped, PoseWithCovariance
from rosidl_parser.definition import (
    Array,
    BasicType,
    BoundedSequence,
    NamespacedType,
    UnboundedSequence,
    UnboundedString,
    UnboundedWString,
)
from rosidl_runtime_py import (
    get_action_interfaces,
    get_interface_packages,
    get_interface_path,
    get_interfaces,
    get_message_interfaces,
    get_message_slot_types,
    get_service_interfaces,
    message_to_csv,
    message_to_ordereddict,
    message_to_yaml,
    set_message_fields,
)
from rosidl_runtime_py.utilities import (
    get_action,
    get_interface,
    get_message,
    get_service,
    is_action,
    is_message,
    is_service,
)
from sensor_msgs.msg import Image, JointState
from shape_msgs.msg import SolidPrimitive
from std_msgs.msg import Bool, Byte, Char, Float32, Header, Int8, String
from std_srvs.srv import SetBool
from tf2_msgs.action import LookupTransform


def test_slot_types_describe_members():
    assert get_message_slot_types(JointState) == {
        "header": NamespacedType(["std_msgs", "msg"], "Header"),
        "name": UnboundedSequence(UnboundedString()),
        "position": UnboundedSequence(BasicType("double")),
        "velocity": UnboundedSequence(BasicType("double")),
        "effort": UnboundedSequence(BasicType("double")),
    }
    types = {
        Bool: BasicType("boolean"),
        Byte: BasicType("octet"),
        Char: BasicType("uint8"),
        Float32: BasicType("float"),
        WString: UnboundedWString(),
    }
    for cls, data in types.items():
        assert (data,) == cls.SLOT_TYPES
    solid = get_message_slot_types(SolidPrimitive)
    assert solid["dimensions"] == BoundedSequence(BasicType("double"), 3)
    pose = get_message_slot_types(PoseWithCovariance())
    assert pose["covariance"] == Array(BasicType("double"), 36)


def test_yaml_is_what_topic_echo_prints():
    state = JointState(name=["a", "yes"], position=[1.0, 1e-5, math.nan, math.inf])
    state.header.frame_id = "bäse"
    assert message_to_yaml(state) == (
        "header:\n"
        "  stamp:\n"
        "    sec: 0\n"
        "    nanosec: 0\n"
        "  frame_id: bäse\n"
        "name:\n"
        "- a\n"
        "- 'yes'\n"
        "position:\n"
        "- 1.0\n"
        "- 1.0e-05\n"
        "- .nan\n"
        "- .inf\n"
        "velocity: []\n"
        "effort: []\n"
    )
    flow = message_to_yaml(state, flow_style=True)
    assert "header:\n  stamp:\n    sec: 0\n" in flow
    assert "position: [1.0, 1.0e-05, .nan, .inf]\n" in flow


def test_long_values_can_be_cut_or_left_out():
    image = Image(encoding="mono8", data=[1, 2, 3, 4])
    assert message_to_ordereddict(image, truncate_length=2)["data"] == [1, 2, "..."]
    assert message_to_ordereddict(image, truncate_length=2)["encoding"] == "mo..."
    short = message_to_ordereddict(image, no_arr=True, no_str=True)
    assert short["data"] == "<sequence type: uint8, length: 4>"
    assert short["encoding"] == "<string length: <5>>"
    pose = message_to_ordereddict(PoseWithCovariance(), no_arr=True)
    assert pose["covariance"] == "<array type: double[36]>"
    report = DiagnosticArray(status=[DiagnosticStatus(values=[KeyValue(), KeyValue()])])
    assert message_to_csv(report, no_arr=True).endswith(
        "<sequence type: diagnostic_msgs/msg/DiagnosticStatus, length: 1>"
    )
    solid = message_to_ordereddict(SolidPrimitive(dimensions=[1.0]), no_arr=True)
    assert solid["dimensions"] == "<sequence type: double[3], length: 1>"


def test_comma_separated_values():
    state = JointState(name=["a", "b"], position=[1.0, 2.0])
    state.header.stamp.sec = 5
    assert message_to_csv(state) == "5,0,,a,b,1.0,2.0,,"
    assert message_to_csv(state, truncate_length=1) == "5,0,,a,...,1.0,...,,"


def test_messages_are_filled_from_plain_values():
    pose = PoseStamped()
    assert set_message_fields(pose, {"pose": {"position": {"x": 1}}}) == []
    assert pose.pose.position.x == 1.0
    assert pose.pose.orientation.w == 1.0
    report = DiagnosticArray()
    set_message_fields(report, {"status": [{"name": "a", "values": [{"key": "k"}]}, {}]})
    named = DiagnosticStatus(name="a", values=[KeyValue(key="k")])
    assert report.status == [named, DiagnosticStatus()]
    covariance = PoseWithCovariance()
    set_message_fields(covariance, {"covariance": list(range(36))})
    assert covariance.covariance[35] == 35.0
    state = JointState()
    set_message_fields(state, {"name": ["a"], "position": [1, 2.5]})
    assert (state.name, list(state.position)) == (["a"], [1.0, 2.5])


def test_stamps_are_left_to_be_set():
    pose, now = PoseStamped(), Time(sec=7)
    (stamp,) = set_message_fields(pose, {"header": "auto"}, expand_header_auto=True)
    stamp(now)
    assert pose.header == Header(stamp=now)
    header = Header()
    (stamp,) = set_message_fields(header, {"stamp": "now", "frame_id": "now"}, expand_time_now=True)
    stamp(now)
    assert header == Header(stamp=now, frame_id="now")


@pytest.mark.parametrize(
    ("message", "values", "error"),
    [
        (String(), {"dat": "x"}, AttributeError),
        (String(), "x", TypeError),
        (Header(), {"stamp": "now"}, TypeError),
        (Header(), {"stamp": 5}, TypeError),
        (Int8(), {"data": "many"}, ValueError),
        (Int8(), {"data": 1000}, AssertionError),
        (DiagnosticArray(), {"status": [5]}, TypeError),
    ],
)
def test_values_that_do_not_fit_are_refused(message, values, error):
    with pytest.raises(error):
        set_message_fields(message, values)


def test_classes_are_found_by_name():
    assert get_message("std_msgs/msg/String") is String
    assert get_message("std_msgs/String") is String
    assert get_service("std_srvs/SetBool") is SetBool
    assert get_action("tf2_msgs/LookupTransform") is LookupTransform
    assert get_interface("std_srvs/srv/SetBool_Request") is SetBool.Request
    assert get_interface("tf2_msgs/action/LookupTransform_FeedbackMessage") is (
        LookupTransform.Impl.FeedbackMessage
    )
    assert is_message(String) and not is_message(SetBool)
    assert is_service(SetBool) and not is_service(LookupTransform)
    assert is_action(LookupTransform) and not is_action(String)


@pytest.mark.parametrize(
    ("get", "name", "error"),
    [
        (get_message, "std_srvs/srv/SetBool", ValueError),
        (get_service, "std_msgs/msg/String", ValueError),
        (get_action, "std_msgs/msg/String", ValueError),
        (get_message, "std_msgs/msg/NoSuch", AttributeError),
        (get_message, "no_such_msgs/msg/String", ModuleNotFoundError),
        (get_message, "String", ValueError),
    ],
)
def test_names_that_mean_nothing_are_refused(get, name, error):
    with pytest.raises(error):
        get(name)


def test_interfaces_are_listed():
    assert {"std_msgs", "tf2_msgs"} <= set(get_interface_packages())
    assert "rclpy" not in get_interface_packages()
    assert "msg/String" in get_message_interfaces(["std_msgs"])["std_msgs"]
    assert get_service_interfaces(["std_msgs", "rclpy"]) == {}
    assert sorted(get_interfaces(["std_srvs"])["std_srvs"]) == [
        "srv/Empty",
        "srv/SetBool",
        "srv/Trigger",
    ]
    assert get_action_interfaces()["tf2_msgs"] == ["action/LookupTransform"]
    with pytest.raises(LookupError, match="no_such_msgs"):
        get_interfaces(["no_such_msgs"])


def test_wrong_names_have_no_file():
    for name in ("Part", "std_msgs//String", "std_msgs/../String"):
        with pytest.raises(ValueError, match="Invalid name"):
            get_interface_path(name)
    for name in ("no_such_msgs/msg/Part", "std_msgs/msg/NoSuch"):
        with pytest.raises(LookupError):
            get_interface_path(name)
