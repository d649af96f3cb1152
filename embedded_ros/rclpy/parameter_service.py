# SPDX-License-Identifier: Apache-2.0
"""The services through which others read and set a node's parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

from rcl_interfaces.msg import ListParametersResult
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)

from .exceptions import ParameterNotDeclaredException, ParameterUninitializedException
from .impl.parameter_checks import failure
from .parameter import Parameter
from .qos import qos_profile_parameters

if TYPE_CHECKING:
    from .node import Node


class ParameterService:
    """Serves ``~/get_parameters`` and its five companions. Every node has one, unless it was
    created with ``start_parameter_services=False``.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        for srv_type, name, answer in (
            (DescribeParameters, "describe_parameters", self._describe),
            (GetParameters, "get_parameters", self._get),
            (GetParameterTypes, "get_parameter_types", self._get_types),
            (ListParameters, "list_parameters", self._list),
            (SetParameters, "set_parameters", self._set),
            (SetParametersAtomically, "set_parameters_atomically", self._set_atomically),
        ):
            full = f"{node.get_name()}/{name}"
            node.create_service(srv_type, full, answer, qos_profile=qos_profile_parameters)

    def _describe(self, request: Any, response: Any) -> Any:
        response.descriptors = _all_or_none(self._node.describe_parameter, request.names)
        return response

    def _get(self, request: Any, response: Any) -> Any:
        found = _all_or_none(self._node.get_parameter, request.names)
        response.values = [parameter.get_parameter_value() for parameter in found]
        return response

    def _get_types(self, request: Any, response: Any) -> Any:
        found = _all_or_none(self._node.get_parameter_type, request.names)
        response.types = [Parameter.Type(kind).value for kind in found]
        return response

    def _list(self, request: Any, response: Any) -> Any:
        try:
            response.result = self._node.list_parameters(request.prefixes, request.depth)
        except (TypeError, ValueError):
            response.result = ListParametersResult()
        return response

    def _set(self, request: Any, response: Any) -> Any:
        response.results = [self._set_checked([message]) for message in request.parameters]
        return response

    def _set_atomically(self, request: Any, response: Any) -> Any:
        response.result = self._set_checked(request.parameters)
        return response

    def _set_checked(self, messages: Iterable[Any]) -> Any:
        try:
            parameters = [Parameter.from_parameter_msg(message) for message in messages]
        except (TypeError, ValueError) as error:
            return failure(str(error))
        try:
            return self._node.set_parameters_atomically(parameters)
        except ParameterNotDeclaredException as error:
            return failure(str(error))


def _all_or_none(read: Callable[[str], Any], names: Iterable[str]) -> list[Any]:
    """What ``read`` finds for the names, or nothing when one of them has nothing."""
    try:
        return [read(name) for name in names]
    except (ParameterNotDeclaredException, ParameterUninitializedException):
        return []
