# SPDX-License-Identifier: Apache-2.0
"""Message classes: what rosidl's generated Python gives, with field checks on."""

import array
import copy
import math
import os
import pickle
import re
import subprocess
import sys
from collections import UserList, UserString
from pathlib import Path

import numpy as np
import pytest
from action_msgs.msg import GoalStatusArray
from action_msgs.srv import CancelGoal
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point, Pose, PoseWithCovariance, Quaternion, TransformStamped
from nav_msgs.msg import OccupancyGrid
from rcl_interfaces.msg import IntegerRange, ParameterDescriptor
from rclpy._rclpy_pybind11 import RMWError
from rclpy.exceptions import NoTypeSupportImportedException
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.type_support import (
    check_for_type_support,
    check_is_valid_msg_type,
    check_is_valid_srv_type,
)
from sensor_msgs.msg import Image, JointState, NavSatStatus
from shape_msgs.msg import SolidPrimitive
from std_msgs.msg import (
    Bool,
    ColorRGBA,
    Float32,
    Float64MultiArray,
    Header,
    Int8,
    String,
    UInt8,
    UInt16,
)
from std_srvs.srv import SetBool, Trigger
from tf2_msgs.action import LookupTransform
from unique_identifier_msgs.msg import UUID
from visualization_msgs.msg import Marker, MarkerArray

ROOT = Path(__file__).resolve().parents[2]


def test_defaults_come_from_the_definition():
    assert Quaternion() == Quaternion(x=0.0, y=0.0, z=0.0, w=1.0)
    assert Pose().orientation.w == 1.0
    assert NavSatStatus().status == -2
    assert DiagnosticStatus().level == b"\x00"
    assert String().data == ""
    assert Marker().lifetime.sec == 0


def test_members_do_not_share_state():
    first, second = Pose(), Pose()
    first.position.x = 1.0
    assert second.position.x == 0.0
    one, other = MarkerArray(), MarkerArray()
    one.markers.append(Marker())
    assert other.markers == []


def test_constructor_takes_keywords_only():
    assert Point(x=1.0).x == 1.0
    with pytest.raises(TypeError):
        Point(1.0, 2.0, 3.0)
    with pytest.raises(AssertionError):
        Point(q=1.0)


def test_unknown_attributes_are_refused():
    with pytest.raises(AttributeError):
        Point().q = 1.0


def test_constants_are_on_the_class_and_read_only():
    assert Marker.ARROW == 0
    assert Marker.DELETEALL == 3
    assert Marker().LINE_STRIP == 4
    assert DiagnosticStatus.ERROR == b"\x02"
    with pytest.raises(AttributeError):
        Marker.ARROW = 5
    with pytest.raises(AttributeError):
        del Marker.ARROW
    with pytest.raises(AttributeError):
        Marker().ARROW = 5
    assert Quaternion.W__DEFAULT == 1.0
    with pytest.raises(AttributeError):
        Quaternion.W__DEFAULT = 0.0


def test_field_types_are_listed():
    assert Point.get_fields_and_field_types() == {"x": "double", "y": "double", "z": "double"}
    assert PoseWithCovariance.get_fields_and_field_types()["covariance"] == "double[36]"
    assert JointState.get_fields_and_field_types()["name"] == "sequence<string>"
    assert SolidPrimitive.get_fields_and_field_types()["dimensions"] == "sequence<double, 3>"
    assert TransformStamped.get_fields_and_field_types()["header"] == "std_msgs/Header"
    assert DiagnosticStatus.get_fields_and_field_types()["level"] == "octet"
    assert Bool.get_fields_and_field_types()["data"] == "boolean"
    types = ParameterDescriptor.get_fields_and_field_types()
    assert types["integer_range"] == "sequence<rcl_interfaces/IntegerRange, 1>"


@pytest.mark.parametrize(
    ("message", "member", "value"),
    [
        (Point(), "x", 1),
        (Point(), "x", "1.0"),
        (Point(), "x", None),
        (Int8(), "data", 128),
        (Int8(), "data", -129),
        (Int8(), "data", 1.0),
        (UInt8(), "data", -1),
        (UInt16(), "data", 65536),
        (Bool(), "data", 1),
        (String(), "data", b"x"),
        (Float32(), "data", 1e39),
        (DiagnosticStatus(), "level", 0),
        (DiagnosticStatus(), "level", b"12"),
        (DiagnosticStatus(), "values", [Point()]),
        (Pose(), "position", Quaternion()),
        (JointState(), "position", [1]),
        (JointState(), "position", 1.0),
        (JointState(), "position", array.array("f", [1.0])),
        (JointState(), "name", "not a list"),
        (JointState(), "name", [1]),
        (PoseWithCovariance(), "covariance", [0.0] * 35),
        (PoseWithCovariance(), "covariance", np.zeros(36, dtype=np.float32)),
        (SolidPrimitive(), "dimensions", [1.0] * 4),
        (ParameterDescriptor(), "integer_range", [IntegerRange(), IntegerRange()]),
    ],
)
def test_wrong_values_are_refused_by_name(message, member, value):
    before = copy.deepcopy(message)
    with pytest.raises(AssertionError, match=member):
        setattr(message, member, value)
    assert message == before


def test_numeric_sequences_are_arrays():
    state = JointState(position=[1.0, 2.0], velocity=(3.0,))
    assert state.position == array.array("d", [1.0, 2.0])
    assert isinstance(state.velocity, array.array)
    assert Image(data=bytes([1, 2])).data == array.array("B", [1, 2])
    assert OccupancyGrid(data=[-1, 100]).data.typecode == "b"
    assert Float64MultiArray().data == array.array("d")
    own = array.array("d", [5.0])
    state.effort = own
    assert state.effort is own


def test_fixed_numeric_arrays_are_numpy():
    pose = PoseWithCovariance()
    assert isinstance(pose.covariance, np.ndarray)
    assert pose.covariance.dtype == np.float64
    assert pose.covariance.shape == (36,)
    pose.covariance = [float(i) for i in range(36)]
    assert pose.covariance[35] == 35.0
    with pytest.raises(ValueError, match="invalid literal"):  # NumPy takes bytes for text
        UUID().uuid = bytes(16)
    with pytest.raises(TypeError):
        UUID().uuid = set(range(16))


def test_constructors_convert_numbers():
    # Assignment does not: there an int is no float.
    assert JointState(position=[1, 2]).position == array.array("d", [1.0, 2.0])
    assert JointState(position=np.arange(2)).position == array.array("d", [0.0, 1.0])
    assert JointState(position=range(2)).position == array.array("d", [0.0, 1.0])
    assert PoseWithCovariance(covariance=range(36)).covariance[35] == 35.0
    own = array.array("d", [5.0])
    assert JointState(position=own).position is not own
    for value in (["a"], None, 1.0):
        with pytest.raises(TypeError):
            JointState(position=value)
    with pytest.raises(OverflowError):
        Image(data=[256])
    with pytest.raises(AssertionError):
        PoseWithCovariance(covariance=[0.0] * 35)
    with pytest.raises(AssertionError):
        SolidPrimitive(dimensions=[1.0] * 4)


def test_collections_of_any_kind_are_taken():
    state = JointState()
    for value in (["a", "b"], ("a", "b"), UserList(["a", "b"])):
        state.name = value
        assert list(state.name) == ["a", "b"]
    state.name = {"a"}
    assert set(state.name) == {"a"}
    for value in (UserString("ab"), iter(["a"]), {"a": "b"}, None):
        with pytest.raises(AssertionError, match="'name' field must be a set or sequence"):
            state.name = value
    state.position = UserList([1.0])
    assert state.position == array.array("d", [1.0])
    image = Image()
    image.data = b"ab"
    assert image.data == array.array("B", [97, 98])
    pose = PoseWithCovariance()
    pose.covariance = own = np.zeros((6, 6))
    assert pose.covariance is own


def test_errors_say_what_is_wanted():
    for message, member, value, wanted in [
        (Int8(), "data", 128, "The 'data' field must be an integer in [-128, 127]"),
        (Pose(), "position", 1, "The 'position' field must be a sub message of type 'Point'"),
        (Header(), "frame_id", 1, "The 'frame_id' field must be of type 'str'"),
        (
            JointState(),
            "name",
            [1],
            "The 'name' field must be a set or sequence and each value of type 'str'",
        ),
        (
            OccupancyGrid(),
            "data",
            [128],
            "The 'data' field must be a set or sequence and each value of type 'int' "
            "and each integer in [-128, 127]",
        ),
    ]:
        with pytest.raises(AssertionError, match=f"^{re.escape(wanted)}$"):
            setattr(message, member, value)


def test_float_members_take_infinity_and_nan():
    assert math.isinf(Point(x=math.inf).x)
    assert math.isnan(ColorRGBA(r=math.nan).r)


def test_numpy_floats_are_floats_and_numpy_integers_are_not_integers():
    assert Point(x=np.float64(2.5)).x == 2.5
    with pytest.raises(AssertionError):
        Int8(data=np.int8(1))


def test_equality():
    assert Point(x=1.0) == Point(x=1.0)
    assert Point(x=1.0) != Point(x=2.0)
    assert Point() != Quaternion()
    changed = PoseWithCovariance()
    changed.covariance = [1.0] * 36
    assert changed != PoseWithCovariance()


def test_messages_are_not_hashable():
    with pytest.raises(TypeError):
        hash(Point())


def test_repr_names_package_and_members():
    assert repr(Point(x=1.0)) == "geometry_msgs.msg.Point(x=1.0, y=0.0, z=0.0)"
    assert repr(String(data="hi")) == "std_msgs.msg.String(data='hi')"
    assert "position=[1.0, 2.0]" in repr(JointState(position=[1.0, 2.0]))
    nested = repr(DiagnosticStatus(values=[KeyValue(key="a", value="b")]))
    assert "values=[diagnostic_msgs.msg.KeyValue(key='a', value='b')]" in nested


def test_copy_and_pickle():
    marker = Marker(ns="a", points=[Point(x=1.0)], colors=[ColorRGBA(a=1.0)])
    assert copy.deepcopy(marker) == marker
    assert pickle.loads(pickle.dumps(marker)) == marker
    assert copy.deepcopy(marker).points is not marker.points
    feedback = LookupTransform.Impl.FeedbackMessage()
    assert pickle.loads(pickle.dumps(feedback)) == feedback


def test_services_group_their_messages():
    assert SetBool.Request(data=True).data is True
    response = Trigger.Response(success=True, message="done")
    assert (response.success, response.message) == (True, "done")
    with pytest.raises(NotImplementedError, match="Service classes can not be instantiated"):
        SetBool()
    check_is_valid_srv_type(SetBool)
    with pytest.raises(RuntimeError, match="message or action"):
        check_is_valid_srv_type(SetBool.Request)
    with pytest.raises(RuntimeError, match="service or action"):
        check_is_valid_msg_type(SetBool)


def test_actions_name_what_they_consist_of():
    impl = LookupTransform.Impl
    assert impl.CancelGoalService is CancelGoal
    assert impl.GoalStatusMessage is GoalStatusArray
    assert impl.SendGoalService.__name__ == "LookupTransform_SendGoal"
    assert impl.SendGoalService.Request(goal=LookupTransform.Goal(advanced=True)).goal.advanced
    assert isinstance(impl.GetResultService.Response().result, LookupTransform.Result)
    assert impl.FeedbackMessage().feedback == LookupTransform.Feedback()
    for service in (impl.SendGoalService, impl.GetResultService, impl.CancelGoalService):
        check_is_valid_srv_type(service)
    check_is_valid_msg_type(impl.FeedbackMessage)
    check_for_type_support(LookupTransform)
    with pytest.raises(RuntimeError):
        check_is_valid_srv_type(LookupTransform)
    with pytest.raises(NotImplementedError, match="Action classes can not be instantiated"):
        LookupTransform()


def test_what_is_no_interface_has_no_type_support():
    class Foreign(type):
        _TYPE_SUPPORT = None

        @classmethod
        def __import_type_support__(cls):
            pass

    for thing in (None, int):
        with pytest.raises(AttributeError):
            check_for_type_support(thing)
    with pytest.raises(NoTypeSupportImportedException):
        check_for_type_support(Foreign("Thing", (), {}))


def test_module_contents():
    import std_msgs.msg
    from std_msgs.msg._multi_array_layout import MultiArrayLayout

    assert "Float64" in dir(std_msgs.msg)
    assert MultiArrayLayout is std_msgs.msg.MultiArrayLayout
    assert Time.__module__ == "builtin_interfaces.msg._time"
    with pytest.raises(ImportError):
        from std_msgs.msg import NoSuchMessage  # noqa: F401
    with pytest.raises(ModuleNotFoundError):
        import std_msgs.nothing


def test_messages_become_bytes_and_come_back():
    state = JointState(name=["a", "ü"], position=[1.0, math.inf])
    payload = serialize_message(state)
    assert isinstance(payload, bytes)
    assert deserialize_message(payload, JointState) == state
    # What another program sent as text need not be UTF-8.
    latin = serialize_message(String(data="ue")).replace(b"ue", b"\xfce")
    assert deserialize_message(latin, String).data == "\ufffde"
    with pytest.raises(RMWError, match="failed to deserialize"):
        deserialize_message(payload[:-9], JointState)
    for wrong in (SetBool, int):
        with pytest.raises(AttributeError):
            serialize_message(wrong)
    with pytest.raises(AttributeError):
        deserialize_message(payload, int)
    with pytest.raises(TypeError):
        deserialize_message("text", String)


def test_field_checks_can_be_turned_off():
    program = (
        "import embedded_ros; embedded_ros.enable()\n"
        "from geometry_msgs.msg import Pose\n"
        "from std_msgs.msg import Header\n"
        "pose = Pose(position='here')\n"
        "pose.orientation = 3\n"
        "print(pose.position, pose.orientation, Header(frame_id=1).frame_id)\n"
    )
    path = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
    environment = {**os.environ, "ROS_PYTHON_CHECK_FIELDS": "0", "PYTHONPATH": path}
    done = subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, text=True
    )
    assert done.stdout.split() == ["here", "3", "1"], done.stderr
