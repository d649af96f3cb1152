# SPDX-License-Identifier: Apache-2.0
import pytest
from ccr_msgs.msg import FingerState
from diagnostic_msgs.msg import DiagnosticArray
from shape_msgs.msg import SolidPrimitive
from std_msgs.msg import Empty, String
from visualization_msgs.msg import MarkerArray

from ccr_ros.stack.message_text import definition, message_class, type_name


def test_a_flat_type_is_its_fields():
    assert definition(String) == "string data\n"
    assert definition(Empty) == ""


def test_arrays_and_bounds_are_written_as_in_msg_files():
    lines = definition(SolidPrimitive).splitlines()
    assert lines[:2] == ["uint8 type", "float64[<=3] dimensions"]
    assert "byte level" in definition(DiagnosticArray).splitlines()


def test_each_type_inside_follows_once():
    text = definition(FingerState)
    names = [line[5:] for line in text.splitlines() if line.startswith("MSG: ")]
    assert len(names) == len(set(names))
    assert {"std_msgs/Header", "ccr_msgs/Contact", "geometry_msgs/Quaternion"} <= set(names)


@pytest.mark.parametrize("kind", [FingerState, MarkerArray, DiagnosticArray])
def test_names_lead_back_to_their_class(kind):
    assert message_class(type_name(kind)) is kind
    assert message_class(type_name(kind).replace("/msg/", "/")) is kind
