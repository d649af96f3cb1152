# SPDX-License-Identifier: Apache-2.0
"""AsyncParameterClient, ParameterEventHandler and parameter files."""

import pytest
from rcl_interfaces.msg import ParameterDescriptor, ParameterType
from rclpy.parameter import (
    Parameter,
    get_parameter_value,
    parameter_dict_from_yaml_file,
    parameter_value_to_python,
)
from rclpy.parameter_client import AsyncParameterClient
from rclpy.parameter_event_handler import ParameterEventHandler

FILE = """
/**:
  ros__parameters:
    number: 3
    arm: {speed: 9}
/ns/holder:
  ros__parameters:
    arm:
      speed: 4
      names: [a, b]
"""


@pytest.fixture
def holder(make_node):
    node = make_node("holder", namespace="/ns")
    node.declare_parameter("number", 1)
    node.declare_parameter("free", 1.5, ParameterDescriptor(dynamic_typing=True))
    node.declare_parameter("arm.speed", 2)
    node.declare_parameter("arm.names", ["x"])
    return node


@pytest.fixture
def user(make_node):
    return make_node("user", namespace="/ns")


@pytest.fixture
def client(holder, user):
    client = AsyncParameterClient(user, "holder")
    assert client.wait_for_services(60)
    assert client.services_are_ready()
    return client


@pytest.fixture
def result(holder, user, spin):
    def run(future):
        assert spin(future.done, holder, user)
        return future.result()

    return run


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "parameters.yaml"
    path.write_text(FILE, encoding="utf-8")
    return str(path)


def test_read(client, result):
    assert set(result(client.list_parameters(["arm"])).result.names) == {"arm.speed", "arm.names"}
    assert "arm.speed" not in result(client.list_parameters(depth=1)).result.names
    (value,) = result(client.get_parameters(["arm.speed"])).values
    assert parameter_value_to_python(value) == 2
    types = result(client.get_parameter_types(["number", "arm.names"])).types
    assert list(types) == [
        ParameterType.PARAMETER_INTEGER,
        ParameterType.PARAMETER_STRING_ARRAY,
    ]
    (descriptor,) = result(client.describe_parameters(["free"])).descriptors
    assert descriptor.dynamic_typing


def test_set(holder, client, result, user, spin):
    done = []
    wanted = [Parameter("number", value=5), Parameter("free", value=2.5).to_parameter_msg()]
    future = client.set_parameters(wanted, callback=done.append)
    assert spin(lambda: done == [future], holder, user)
    assert [one.successful for one in future.result().results] == [True, True]
    assert [holder.get_parameter(name).value for name in ("number", "free")] == [5, 2.5]
    wanted = [Parameter("number", value=6), Parameter("absent", value=1)]
    assert not result(client.set_parameters_atomically(wanted)).result.successful
    assert holder.get_parameter("number").value == 5


def test_delete(holder, client, result):
    results = result(client.delete_parameters(["free", "number"])).results
    assert [one.successful for one in results] == [True, False]
    assert not holder.has_parameter("free")
    assert holder.has_parameter("number")


def test_files(holder, client, result, file):
    assert all(one.successful for one in result(client.load_parameter_file(file)).results)
    assert holder.get_parameter("number").value == 1
    assert list(holder.get_parameter("arm.names").value) == ["a", "b"]
    assert result(client.load_parameter_file_atomically(file, use_wildcard=True)).result.successful
    assert [holder.get_parameter(name).value for name in ("number", "arm.speed")] == [3, 4]


def test_what_is_in_a_file(file, tmp_path):
    found = parameter_dict_from_yaml_file(file, True, ["/ns/holder"], namespace="left.")
    values = {name: parameter_value_to_python(message.value) for name, message in found.items()}
    assert values == {"left.number": 3, "left.arm.speed": 4, "left.arm.names": ["a", "b"]}
    with pytest.raises(RuntimeError, match="/other"):
        parameter_dict_from_yaml_file(file, target_nodes=["/other"])
    bad = tmp_path / "bad.yaml"
    bad.write_text("/node: {number: 1}", encoding="utf-8")
    with pytest.raises(RuntimeError, match="not a valid ROS parameter file"):
        parameter_dict_from_yaml_file(str(bad))


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("true", True),
        ("3", 3),
        ("3.5", 3.5),
        ("word", "word"),
        ("[1, 2]", [1, 2]),
        ("[1.5]", [1.5]),
        ("[a, b]", ["a", "b"]),
        ("[1, a]", "[1, a]"),
        ("", ""),
    ],
)
def test_values_are_guessed_from_text(text, value):
    assert parameter_value_to_python(get_parameter_value(text)) == value


def test_nobody_there(user):
    client = AsyncParameterClient(user, "nobody")
    assert not client.services_are_ready()
    assert not client.wait_for_services(0.1)


def test_event_handlers(holder, user, spin):
    heard = []
    handler = ParameterEventHandler(user)

    def hear(mark):
        return lambda parameter: heard.append((mark, parameter_value_to_python(parameter.value)))

    first = handler.add_parameter_callback("number", "holder", hear("first"))
    handler.add_parameter_callback("number", "/ns/holder", hear("second"))
    handler.add_parameter_callback("number", "/elsewhere/holder", hear("never"))
    handler.add_parameter_callback("arm.speed", "/ns/holder", hear("speed"))
    events = []
    every = handler.add_parameter_event_callback(events.append)
    subscription = handler.parameter_event_subscription
    assert spin(lambda: subscription.get_publisher_count() == 2, holder, user)

    holder.set_parameters([Parameter("number", value=2)])
    assert spin(lambda: events, holder, user)
    assert heard == [("second", 2), ("first", 2)]
    (changed,) = ParameterEventHandler.get_parameters_from_event(events[0])
    assert (events[0].node, changed.name) == ("/ns/holder", "number")

    handler.remove_parameter_callback(first)
    with pytest.raises(RuntimeError):
        handler.remove_parameter_callback(first)
    holder.set_parameters([Parameter("number", value=3)])
    assert spin(lambda: len(events) == 2, holder, user)
    assert heard[2:] == [("second", 3)]

    handler.remove_parameter_event_callback(every)
    with pytest.raises(RuntimeError):
        handler.remove_parameter_event_callback(every)
    holder.set_parameters([Parameter("arm.speed", value=7)])
    assert spin(lambda: ("speed", 7) in heard, holder, user)
    assert len(events) == 2
    handler.destroy()
    assert subscription not in user.subscriptions


def test_event_handlers_of_own_parameters(make_node, spin):
    node, heard = make_node("own"), []
    node.declare_parameter("number", 1)
    handler = ParameterEventHandler(node)
    handler.add_parameter_callback("number", "", heard.append)
    publishers = handler.parameter_event_subscription.get_publisher_count
    assert spin(lambda: publishers() == 1, node)
    node.set_parameters([Parameter("number", value=8)])
    assert spin(lambda: heard, node)
    assert heard[0].value.integer_value == 8
