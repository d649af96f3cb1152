# SPDX-License-Identifier: Apache-2.0
"""Parameters of a node, read and set by others through its services."""

import pytest
from rcl_interfaces import srv
from rcl_interfaces.msg import (
    IntegerRange,
    ParameterDescriptor,
    ParameterType,
    ParameterValue,
    SetParametersResult,
)
from rclpy.parameter import Parameter

SERVICES = {
    "describe_parameters": srv.DescribeParameters,
    "get_parameters": srv.GetParameters,
    "get_parameter_types": srv.GetParameterTypes,
    "list_parameters": srv.ListParameters,
    "set_parameters": srv.SetParameters,
    "set_parameters_atomically": srv.SetParametersAtomically,
}


@pytest.fixture
def holder(make_node):
    """A node with parameters of many kinds."""
    node = make_node("holder", namespace="/ns")
    limits = [IntegerRange(from_value=0, to_value=10)]
    node.declare_parameter("number", 1, ParameterDescriptor(integer_range=limits))
    node.declare_parameter("fixed", "as made", ParameterDescriptor(read_only=True))
    node.declare_parameter("free", 1.5, ParameterDescriptor(dynamic_typing=True))
    node.declare_parameter("open", Parameter.Type.STRING)
    node.declare_parameter("arm.left.gains", [1.0, 2.0], ParameterDescriptor(description="gains"))
    node.declare_parameter("arm.speed", 3)
    return node


@pytest.fixture
def ask(holder, make_node, spin):
    """Call one of the holder's services and return the response."""
    user = make_node("user")
    clients = {}

    def call(name, **fields):
        kind = SERVICES[name]
        if name not in clients:
            clients[name] = user.create_client(kind, f"/ns/holder/{name}")
            assert clients[name].wait_for_service(60)
        future = clients[name].call_async(kind.Request(**fields))
        assert spin(future.done, holder, user)
        return future.result()

    return call


def wanted(**values):
    """Messages that set parameters; ``__`` in a name stands for a dot."""
    return [
        Parameter(name.replace("__", "."), value=value).to_parameter_msg()
        for name, value in values.items()
    ]


@pytest.fixture
def set_one(ask):
    def run(**values):
        (result,) = ask("set_parameters", parameters=wanted(**values)).results
        return result

    return run


@pytest.mark.parametrize(
    ("prefixes", "depth", "names"),
    [
        ([], 1, {"number", "fixed", "free", "open", "use_sim_time"}),
        (["arm"], 0, {"arm.speed", "arm.left.gains"}),
        (["arm"], 1, {"arm.speed"}),
        (["arm.left", "number"], 0, {"arm.left.gains", "number"}),
        (["ar", "nothing"], 0, set()),
    ],
)
def test_list(ask, prefixes, depth, names):
    result = ask("list_parameters", prefixes=prefixes, depth=depth).result
    assert set(result.names) - {"start_type_description_service"} == names
    assert set(result.prefixes) == {name.rpartition(".")[0] for name in names} - {""}


def test_list_has_everything(ask):
    result = ask("list_parameters").result
    assert {"number", "fixed", "open", "arm.speed", "arm.left.gains"} <= set(result.names)
    assert list(result.prefixes) == ["arm.left", "arm"]


def test_get(ask):
    values = ask("get_parameters", names=["number", "arm.left.gains"]).values
    assert [value.type for value in values] == [
        ParameterType.PARAMETER_INTEGER,
        ParameterType.PARAMETER_DOUBLE_ARRAY,
    ]
    assert (values[0].integer_value, list(values[1].double_array_value)) == (1, [1.0, 2.0])


@pytest.mark.parametrize("missing", ["absent", "open"])
def test_one_parameter_without_a_value_empties_the_answer(ask, missing):
    assert list(ask("get_parameters", names=["number", missing]).values) == []


def test_types(ask):
    types = ask("get_parameter_types", names=["number", "open", "free"]).types
    kinds = Parameter.Type.INTEGER, Parameter.Type.NOT_SET, Parameter.Type.DOUBLE
    assert list(types) == [kind.value for kind in kinds]
    assert list(ask("get_parameter_types", names=["number", "absent"]).types) == []


def test_describe(ask):
    number, fixed, gains = ask(
        "describe_parameters", names=["number", "fixed", "arm.left.gains"]
    ).descriptors
    assert (number.name, number.type) == ("number", ParameterType.PARAMETER_INTEGER)
    assert number.integer_range == [IntegerRange(from_value=0, to_value=10)]
    assert fixed.read_only and not number.read_only
    assert gains.description == "gains"
    assert list(ask("describe_parameters", names=["number", "absent"]).descriptors) == []


def test_set(holder, set_one):
    heard = []
    holder.add_post_set_parameters_callback(heard.extend)
    assert set_one(number=7) == SetParametersResult(successful=True)
    assert holder.get_parameter("number").value == 7
    assert [parameter.name for parameter in heard] == ["number"]
    assert set_one(arm__left__gains=[4.0]).successful
    assert list(holder.get_parameter("arm.left.gains").value) == [4.0]


def test_dynamically_typed_parameters_change_type_and_go(holder, set_one):
    assert set_one(free="text").successful
    assert holder.get_parameter("free").value == "text"
    assert set_one(free=None).successful
    assert not holder.has_parameter("free")


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"number": 1.0}, "Wrong parameter type, expected 'Type.INTEGER' got 'Type.DOUBLE'"),
        ({"number": 11}, "Parameter number out of range. Min: 0, Max: 10, value: 11"),
        ({"fixed": "other"}, "Trying to set a read-only parameter: fixed."),
        ({"number": None}, "Static parameter cannot be undeclared"),
        ({"absent": 1}, "Invalid access to undeclared parameter(s)"),
    ],
)
def test_refusals_say_why(holder, set_one, values, reason):
    result = set_one(**values)
    assert not result.successful
    assert result.reason.startswith(reason)
    assert holder.get_parameter("number").value == 1
    assert holder.get_parameter("fixed").value == "as made"
    assert not holder.has_parameter("absent")


def test_callbacks_refuse(holder, set_one):
    refusal = SetParametersResult(successful=False, reason="not today")
    holder.add_on_set_parameters_callback(lambda parameters: refusal)
    assert set_one(number=2) == refusal
    assert holder.get_parameter("number").value == 1


def test_parameters_are_set_one_after_the_other(holder, ask):
    results = ask("set_parameters", parameters=wanted(number=2, absent=1, arm__speed=5)).results
    assert [result.successful for result in results] == [True, False, True]
    assert [holder.get_parameter(name).value for name in ("number", "arm.speed")] == [2, 5]


def test_or_all_at_once(holder, ask):
    refused = ask("set_parameters_atomically", parameters=wanted(number=2, fixed="x")).result
    assert not refused.successful
    assert holder.get_parameter("number").value == 1
    assert ask("set_parameters_atomically", parameters=wanted(number=2, free=2.5)).result.successful
    assert [holder.get_parameter(name).value for name in ("number", "free")] == [2, 2.5]


def test_undeclared_parameters_where_they_are_allowed(make_node, spin):
    node = make_node("loose", allow_undeclared_parameters=True)
    client = node.create_client(srv.SetParameters, "loose/set_parameters")
    assert client.wait_for_service(60)
    future = client.call_async(srv.SetParameters.Request(parameters=wanted(new=[True, False])))
    assert spin(future.done, node)
    assert future.result().results[0].successful
    assert list(node.get_parameter("new").value) == [True, False]
    getter = node.create_client(srv.GetParameters, "loose/get_parameters")
    assert getter.wait_for_service(60)
    future = getter.call_async(srv.GetParameters.Request(names=["new", "other"]))
    assert spin(future.done, node)
    assert future.result().values[1] == ParameterValue()


def test_who_has_the_services(make_node, spin):
    make_node("open")
    viewer = make_node("closed", start_parameter_services=False)

    def services(name):
        return {key: types for key, types in viewer.get_service_names_and_types_by_node(name, "/")}

    expected = {f"/open/{name}" for name in SERVICES}
    assert spin(lambda: expected <= set(services("open")), viewer)
    assert services("open")["/open/set_parameters"] == ["rcl_interfaces/srv/SetParameters"]
    assert not any("parameter" in name for name in services("closed"))
