# SPDX-License-Identifier: Apache-2.0
"""Parameter services answer nonsense, where those of the real rclpy end the node."""

import pytest
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import GetParameterTypes, SetParameters, SetParametersAtomically


@pytest.mark.parametrize("kind", [SetParameters, SetParametersAtomically])
def test_unknown_types_are_refused(node, spin, kind):
    node.declare_parameter("number", 1)
    name = "set_parameters" + ("" if kind is SetParameters else "_atomically")
    client = node.create_client(kind, f"{node.get_name()}/{name}")
    assert client.wait_for_service(60)
    wrong = Parameter(name="number", value=ParameterValue(type=42))
    future = client.call_async(kind.Request(parameters=[wrong]))
    assert spin(future.done, node)
    response = future.result()
    result = response.results[0] if kind is SetParameters else response.result
    assert not result.successful
    assert "42" in result.reason
    assert node.get_parameter("number").value == 1


def test_types_of_undeclared_parameters_where_they_are_allowed(make_node, spin):
    node = make_node("loose", allow_undeclared_parameters=True)
    client = node.create_client(GetParameterTypes, "loose/get_parameter_types")
    assert client.wait_for_service(60)
    future = client.call_async(GetParameterTypes.Request(names=["absent"]))
    assert spin(future.done, node)
    assert list(future.result().types) == [0]
