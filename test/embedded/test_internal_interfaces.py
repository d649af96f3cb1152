# SPDX-License-Identifier: Apache-2.0
"""Custom types, the import hook, and the discovery settings."""

import importlib
import subprocess
import sys
from pathlib import Path

import embedded_sample_msgs.action
import embedded_sample_msgs.srv
import numpy as np
import pytest
import yaml
from embedded_sample_msgs.msg import Everything
from rosidl_parser.definition import BoundedSequence, BoundedString, UnboundedWString
from rosidl_runtime_py import (
    get_interface_packages,
    get_interface_path,
    get_interfaces,
    get_message_slot_types,
    message_to_yaml,
    set_message_fields,
)

import embedded_ros
from embedded_ros.finder import InterfaceFinder
from embedded_ros.transport.cyclone_config import DiscoveryError, discovery_range, domain_xml
from embedded_ros.transport.graph import dds_type_name, ros_type_name, split_topic

ROOT = Path(__file__).parents[2]


def test_constants_and_defaults_of_a_custom_type():
    message = Everything()
    assert (Everything.LIMIT, Everything.GREETING, Everything.HALF) == (7, "hello, world", 0.5)
    assert message.flag is True
    assert message.one == b"\x03"
    assert (message.letter, message.small, message.medium) == (65, -5, 16)
    assert message.big == -9_000_000_000
    assert (message.single, message.double_value) == (1.5, 2.5)
    assert message.text == 'say "hi"'
    assert list(message.numbers) == [1, -2, 3]
    assert np.array_equal(message.triple, [0.5, 1.5, 2.5])
    assert message.names == ["a", "b"]
    assert message.pair == ["", ""]
    assert len(message.two_parts) == 2
    assert message.two_parts[0] is not message.two_parts[1]
    assert message.pose.pose.orientation.w == 1.0


@pytest.mark.parametrize(
    ("member", "value"),
    [
        ("short_text", "123456"),
        ("few_parts", [1]),
        ("two_parts", []),
        ("bounded", [1.0, 2.0, 3.0]),
        ("four", [1, 2, 3]),
        ("four", [1, 2, 3, 256]),
        ("pair", ["a"]),
        ("flags", [1]),
        ("raw", [b"ab"]),
        ("wide", b"x"),
    ],
)
def test_bounds_of_a_custom_type(member, value):
    with pytest.raises(AssertionError, match=member):
        setattr(Everything(), member, value)


def test_services_and_actions_of_a_custom_package():
    ask = embedded_sample_msgs.srv.Ask
    assert ask.Request.LOUD == 1
    assert ask.Request(question=Everything().two_parts[0]).question.kind == 0
    assert ask.Response().answer == "none"
    move = embedded_sample_msgs.action.Move
    assert move.Goal(target=1.0).target == 1.0
    assert (move.Result().reached, move.Feedback().done) == (0.0, 0.0)
    assert list(move.Impl.FeedbackMessage.get_fields_and_field_types()) == ["goal_id", "feedback"]


def test_enabling_again_changes_nothing():
    assert embedded_ros.enable() is True
    assert sum(isinstance(f, InterfaceFinder) for f in sys.meta_path) == 1
    with pytest.raises(FileNotFoundError, match="nowhere"):
        embedded_ros.enable(["nowhere"])


def test_modules_carry_rclpys_names():
    for name in ("rclpy.node", "rclpy.qos", "rclpy.executors", "rclpy.impl.rcutils_logger"):
        assert importlib.import_module(name).__name__ == name
    from rclpy.node import Node

    assert Node.__module__ == "rclpy.node"


def test_a_real_rclpy_is_left_alone(tmp_path):
    (tmp_path / "rclpy").mkdir()
    (tmp_path / "rclpy" / "__init__.py").write_text("REAL = True\n")
    program = (
        f"import sys; sys.path[:0] = [{str(tmp_path)!r}, {str(ROOT)!r}]\n"
        "import embedded_ros\n"
        "before = list(sys.meta_path)\n"
        "assert embedded_ros.enable() is False\n"
        "assert sys.meta_path == before\n"
        "import rclpy\n"
        "assert rclpy.REAL\n"
        "assert not any(name.startswith('cyclonedds') for name in sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


def test_folders_that_only_look_like_packages_hide_nothing(tmp_path):
    (tmp_path / "std_msgs" / "msg").mkdir(parents=True)
    (tmp_path / "rclpy" / "impl").mkdir(parents=True)
    (tmp_path / "sensor_msgs").mkdir()
    (tmp_path / "sensor_msgs" / "__init__.py").touch()
    (tmp_path / "sensor_msgs" / "msg.py").write_text("REAL = True\n")
    program = (
        f"import sys; sys.path[:0] = [{str(tmp_path)!r}, {str(ROOT)!r}]\n"
        "import embedded_ros\n"
        "assert embedded_ros.enable()\n"
        "import std_msgs.msg, rclpy.node, sensor_msgs.msg\n"
        "assert std_msgs.msg.String(data='a').data == 'a'\n"
        "assert sensor_msgs.msg.REAL\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True)
    for name in ("__init__.py", "impl/implementation_singleton.py"):  # sources that were not built
        (tmp_path / "rclpy" / name).write_text("raise ImportError\n")
    subprocess.run([sys.executable, "-c", program], check=True)


def test_missing_dependencies_are_named():
    program = (
        f"import sys; sys.path.insert(0, {str(ROOT)!r})\n"
        "import importlib.util as util\n"
        "find = util.find_spec\n"
        "util.find_spec = lambda name, *rest: None if name == 'rosbags' else find(name, *rest)\n"
        "import embedded_ros\n"
        "try:\n    embedded_ros.enable()\n"
        "except embedded_ros.MissingDependencyError as error:\n    print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], check=True, capture_output=True, text=True
    )
    assert "pip install 'rosbags" in done.stdout
    assert "numpy" not in done.stdout


@pytest.mark.parametrize(
    ("environ", "expected"),
    [
        ({}, "SUBNET"),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "localhost"}, "LOCALHOST"),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}, "OFF"),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET", "ROS_LOCALHOST_ONLY": "1"}, "LOCALHOST"),
        ({"ROS_LOCALHOST_ONLY": "0"}, "SUBNET"),
    ],
)
def test_discovery_range(environ, expected):
    assert discovery_range(environ) == expected


def test_unknown_discovery_range_is_named():
    with pytest.raises(DiscoveryError, match="'FAR'"):
        discovery_range({"ROS_AUTOMATIC_DISCOVERY_RANGE": "far"})


def test_domain_configuration():
    local = domain_xml({"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"})
    assert 'address="127.0.0.1"' in local
    assert "<AllowMulticast>false</AllowMulticast>" in local
    # A node with twenty writers must not wait a second for each when a reader was killed.
    assert "<WriterLingerDuration>30ms</WriterLingerDuration>" in local
    users = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "CYCLONEDDS_URI": "file:///mine.xml"}
    assert domain_xml(users).endswith(",file:///mine.xml")
    for kind in (local, domain_xml({})):  # who starts later is found, however late
        assert "<InitialLocatorPruneDelay>inf</InitialLocatorPruneDelay>" in kind
    old = domain_xml({"ROS_LOCALHOST_ONLY": "1", "ROS_STATIC_PEERS": "10.0.0.1"})
    assert "10.0.0.1" not in old
    peers = domain_xml({"ROS_STATIC_PEERS": "10.0.0.1;robot.local"})
    assert '<Peer address="10.0.0.1"/><Peer address="robot.local"/>' in peers
    assert domain_xml({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT"}) == ""


def test_names_on_the_wire():
    assert dds_type_name("std_msgs/msg/String") == "std_msgs::msg::dds_::String_"
    assert ros_type_name("std_msgs::msg::dds_::String_") == "std_msgs/msg/String"
    assert ros_type_name("Other") == "Other"
    assert split_topic("rt/a/b") == ("topic", "/a/b")
    assert split_topic("rq/addRequest") == ("request", "/addRequest")
    assert split_topic("plain") == ("other", "plain")


def test_bytes_may_be_given_as_numbers_or_as_printed():
    message = Everything()
    set_message_fields(message, {"one": 2, "raw": [1, "\x02", b"\x03"]})
    assert (message.one, message.raw) == (b"\x02", [b"\x01", b"\x02", b"\x03"])
    again = Everything()
    set_message_fields(again, yaml.safe_load(message_to_yaml(message)))
    assert again == message
    with pytest.raises(AssertionError, match="one"):
        set_message_fields(message, {"one": 256})


def test_tools_know_custom_types():
    types = get_message_slot_types(Everything)
    assert types["short_text"] == BoundedString(5)
    assert types["labels"] == BoundedSequence(BoundedString(4), 2)
    assert types["wide"] == UnboundedWString()
    assert sorted(get_interfaces(["embedded_sample_msgs"])["embedded_sample_msgs"]) == [
        "action/Move",
        "msg/Everything",
        "msg/Nothing",
        "msg/Part",
        "srv/Ask",
    ]
    home = Path(__file__).parent / "interfaces" / "sample_msgs"
    assert get_interface_packages()["embedded_sample_msgs"] == str(home)
    for name in ("embedded_sample_msgs/srv/Ask", "embedded_sample_msgs/srv/Ask.srv"):
        assert get_interface_path(name) == str(home / "srv" / "Ask.srv")
    with pytest.raises(LookupError, match="a file of"):
        get_interface_path("std_msgs/msg/String")


def test_a_package_may_carry_python_modules(tmp_path):
    home = tmp_path / "carrier_msgs"
    files = {
        "package.xml": "<package><name>carrier_msgs</name></package>",
        "msg/Load.msg": "int32 mass",
        "src/carrier_msgs/loads.py": "from carrier_msgs.msg import Load\nHEAVY = Load(mass=9)\n",
    }
    for name, text in files.items():
        (home / name).parent.mkdir(parents=True, exist_ok=True)
        (home / name).write_text(text)
    embedded_ros.enable([home])
    loads = importlib.import_module("carrier_msgs.loads")
    assert importlib.import_module("carrier_msgs.msg").Load(mass=9) == loads.HEAVY
