# SPDX-License-Identifier: Apache-2.0
"""The CDR codec against rosbags' own serialiser, on random messages of many types."""

import math
import random

import numpy as np
import pytest
from embedded_sample_msgs.msg import Everything, Nothing, Part
from example_interfaces.msg import WString
from hypothesis import given, settings
from hypothesis import strategies as st
from rclpy._rclpy_pybind11 import RMWError
from rclpy.serialization import deserialize_message, serialize_message
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from embedded_ros.interfaces.registry import registry
from embedded_ros.interfaces.spec import FieldType, int_range

STORE = get_typestore(Stores.ROS2_JAZZY)
ALL_TYPES = sorted(STORE.fielddefs)


def random_value(ftype: FieldType, rng: random.Random):
    """A value that a member of this type may hold."""
    if ftype.kind != "scalar":
        count = ftype.size if ftype.kind == "array" else rng.randint(0, min(ftype.size or 3, 3))
        return [random_value(ftype.scalar, rng) for _ in range(count)]
    if ftype.is_message:
        return random_message(ftype.base, rng)
    if ftype.base in ("string", "wstring"):
        text = "".join(rng.choice("ab é") for _ in range(rng.randint(0, 6)))
        return text[: ftype.string_bound] if ftype.string_bound else text
    if ftype.base == "bool":
        return rng.random() < 0.5
    if ftype.base == "byte":
        return bytes([rng.randrange(256)])
    if ftype.base.startswith("float"):
        return float(np.float32(rng.uniform(-1e3, 1e3)))
    return rng.randint(*int_range(ftype.base))


def random_message(name: str, rng: random.Random):
    """A message with random content."""
    cls = registry.message_class(name)
    spec = registry.spec(name)
    return cls(**{member.name: random_value(member.type, rng) for member in spec.fields})


@pytest.mark.parametrize("name", ALL_TYPES)
def test_same_bytes_as_rosbags(name):
    rng = random.Random(name)
    cls = registry.message_class(name)
    for _ in range(3):
        message = random_message(name, rng)
        payload = serialize_message(message)
        theirs = STORE.deserialize_cdr(payload, name)
        assert bytes(STORE.serialize_cdr(theirs, name)) == payload
        assert deserialize_message(payload, cls) == message
        big = bytes(STORE.serialize_cdr(theirs, name, little_endian=False))
        assert deserialize_message(big, cls) == message


@given(st.randoms(use_true_random=False))
@settings(max_examples=200, deadline=None)
def test_every_kind_of_member_survives(rng):
    message = random_message("embedded_sample_msgs/msg/Everything", rng)
    payload = serialize_message(message)
    assert deserialize_message(payload, Everything) == message
    # A writer may pad the payload to a multiple of four bytes.
    assert deserialize_message(payload + b"\0" * (-len(payload) % 4), Everything) == message


@given(st.integers(min_value=0), st.randoms(use_true_random=False))
@settings(max_examples=100, deadline=None)
def test_a_cut_payload_is_an_error_and_nothing_else(cut, rng):
    message = random_message("embedded_sample_msgs/msg/Everything", rng)
    payload = serialize_message(message)
    with pytest.raises(RMWError):
        deserialize_message(payload[: cut % len(payload)], Everything)


@given(st.binary(max_size=200))
@settings(max_examples=200, deadline=None)
def test_garbage_is_an_error_or_a_message(data):
    try:
        message = deserialize_message(b"\0\1\0\0" + data, Everything)
    except RMWError:
        return
    assert isinstance(message, Everything)


def test_known_bytes():
    assert serialize_message(Nothing()) == b"\0\1\0\0\0"
    part = Part(kind=1, value=2.0, label="ab")
    expected = bytes.fromhex("00010000 01 00000000000000 0000000000000040 03000000 616200")
    assert serialize_message(part) == expected
    assert deserialize_message(expected, Part) == part


def test_wide_characters_take_four_bytes():
    # As rclpy writes them with rmw_cyclonedds_cpp: UTF-16 code units, each in four bytes.
    message = WString(data="a\U0001f600b")
    expected = bytes.fromhex("00010000 04000000 61000000 3dd80000 00de0000 62000000")
    assert serialize_message(message) == expected
    assert deserialize_message(expected, WString) == message
    with pytest.raises(RMWError):
        deserialize_message(expected[:8] + b"\0\0\1\0" + expected[12:], WString)


def test_other_encodings_are_refused():
    with pytest.raises(RMWError, match="encoding 7"):
        deserialize_message(b"\0\7" + serialize_message(Part())[2:], Part)


def test_special_floats():
    part = deserialize_message(serialize_message(Part(value=math.inf)), Part)
    assert part.value == math.inf
    assert math.isnan(deserialize_message(serialize_message(Part(value=math.nan)), Part).value)


def test_a_list_changed_to_something_else_is_an_error():
    message = Everything()
    message.parts.append("no part")
    with pytest.raises((AttributeError, TypeError, ValueError)):
        serialize_message(message)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        # As announced by ROS 2 Jazzy.
        (
            "std_msgs/msg/String",
            "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
        ),
        (
            "rmw_dds_common/msg/ParticipantEntitiesInfo",
            "RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e",
        ),
        (
            "visualization_msgs/msg/MarkerArray",
            "RIHS01_86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf",
        ),
        (
            "action_msgs/srv/CancelGoal",
            "RIHS01_573d8b0a534451d7bc2ac8c5ffde8ac14b8593b7001175d0cd6516dcbeb8689a",
        ),
        (
            "action_msgs/srv/CancelGoal_Request",
            "RIHS01_3d3c84653c1f96918086887e1dcb236faec88b81a5b14fd4cf4840065bcdf8af",
        ),
        (
            "action_msgs/srv/CancelGoal_Event",
            "RIHS01_178f81615ce6be41ad328211d7a56b08b00e73f41f0b8aec256b2f3ff97a5e7e",
        ),
        (
            "example_interfaces/action/Fibonacci",
            "RIHS01_9508051da1ea4658de144b09bd0690ff3de52104683d847aed764d2915906f51",
        ),
        (
            "example_interfaces/action/Fibonacci_SendGoal",
            "RIHS01_d1a57fb2a4afe8c21e34fb10db206f16ce6729b28531141472df92277c55b557",
        ),
        (
            "example_interfaces/action/Fibonacci_FeedbackMessage",
            "RIHS01_c1de71afd52e49a89c53d8262366884185bc0a02f78ce051c4e46b0a7fe59bb2",
        ),
        (
            "example_interfaces/msg/Char",
            "RIHS01_320dcd57e1183fb08463cc3ab50bf7e5ce0ecee39f64d15a9e9eeca3384c91a5",
        ),
        (
            "example_interfaces/msg/WString",
            "RIHS01_32033e06d9dfe5468c5d6e1dc8b7a23c8910bad071cfd4e151a951d580e68dd8",
        ),
        (
            "std_srvs/srv/Empty_Request",
            "RIHS01_458eaf200a3f63d9cc53d19436edebc0c140ef4c93ca75d5bd4ce19fd7759e35",
        ),
    ],
)
def test_type_hashes(name, expected):
    assert registry.type_hash(name) == expected


# rosbags takes char for IDL's char; in .msg files it is another name of uint8.
WITH_CHAR = {
    "service_msgs/msg/ServiceEventInfo",
    "std_msgs/msg/Char",
    "rmw_dds_common/msg/Gid",
    "rmw_dds_common/msg/NodeEntitiesInfo",
    "rmw_dds_common/msg/ParticipantEntitiesInfo",
}


@pytest.mark.parametrize("name", sorted({*ALL_TYPES} - WITH_CHAR))
def test_type_hashes_as_rosbags_computes_them(name):
    assert registry.type_hash(name) == STORE.hash_rihs01(name)


def test_type_hash_of_a_custom_type_is_that_of_its_text():
    store = get_typestore(Stores.ROS2_JAZZY)
    text = "uint8 kind\nfloat64 value\nstring label"
    store.register(get_types_from_msg(text, "embedded_sample_msgs/msg/Part"))
    expected = store.hash_rihs01("embedded_sample_msgs/msg/Part")
    assert registry.type_hash("embedded_sample_msgs/msg/Part") == expected
