# SPDX-License-Identifier: Apache-2.0
"""The service that describes the interfaces a node uses."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from rcl_interfaces.msg import ParameterDescriptor
from type_description_interfaces.msg import (
    Field,
    FieldType,
    IndividualTypeDescription,
    TypeDescription,
    TypeSource,
)
from type_description_interfaces.srv import GetTypeDescription

from embedded_ros.interfaces.description import describe
from embedded_ros.interfaces.registry import registry

from .type_hash import TypeHash

if TYPE_CHECKING:
    from .node import Node

START_TYPE_DESCRIPTION_SERVICE_PARAM = "start_type_description_service"


class TypeDescriptionService:
    """Serves ``~/get_type_description``, unless the node's parameter
    ``start_type_description_service`` is false.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        if not node.has_parameter(START_TYPE_DESCRIPTION_SERVICE_PARAM):
            about = "If enabled, start the ~/get_type_description service."
            descriptor = ParameterDescriptor(description=about, read_only=True)
            node.declare_parameter(START_TYPE_DESCRIPTION_SERVICE_PARAM, True, descriptor)
        wanted = node.get_parameter(START_TYPE_DESCRIPTION_SERVICE_PARAM).value
        self.enabled = wanted is True
        if not isinstance(wanted, bool):
            node.get_logger().error(
                f"parameter '{START_TYPE_DESCRIPTION_SERVICE_PARAM}' must be a bool, got {wanted!r}"
            )
        if self.enabled:
            name = f"{node.get_name()}/get_type_description"
            node.create_service(GetTypeDescription, name, self._answer)

    def _used(self) -> Iterator[str]:
        """The interfaces that the node uses."""
        node = self._node
        if node._ros_rosout is not None:
            yield "rcl_interfaces/msg/Log"
        topic_ends: list[Any] = [*node._publishers, *node._subscriptions]
        for topic_end in topic_ends:
            yield topic_end.msg_type._spec_.name
        for service_end in (*node._services, *node._clients):
            name = service_end.srv_type._name
            yield name
            yield name.removesuffix("_SendGoal")  # the action that the service is part of

    def _answer(self, request: Any, response: Any) -> Any:
        wanted = str(TypeHash.parse(request.type_hash))
        name = next((one for one in self._used() if registry.type_hash(one) == wanted), None)
        if wanted == "INVALID":
            response.failure_reason = "Failed to parse type hash"
        elif name is None:
            response.failure_reason = "Type not currently in use by this node"
        else:
            tree = describe(name, registry.spec)
            main, others = tree["type_description"], tree["referenced_type_descriptions"]
            response.type_description = TypeDescription(
                type_description=_message(main),
                referenced_type_descriptions=[_message(other) for other in others],
            )
            if request.include_type_sources:
                response.type_sources = [_source(one["type_name"]) for one in (main, *others)]
            response.successful = True
        return response


def _message(description: dict[str, Any]) -> Any:
    """One description as a message, with the default values that hashes leave out."""
    name = description["type_name"]
    defaults = {member.name: member.default for member in registry.spec(name).fields}
    fields = [
        Field(
            name=field["name"],
            type=FieldType(**field["type"]),
            default_value=_default_text(defaults.get(field["name"])),
        )
        for field in description["fields"]
    ]
    return IndividualTypeDescription(type_name=name, fields=fields)


def _default_text(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, list):
        return str(tuple(item[0] if isinstance(item, bytes) else item for item in value))
    return str(value[0] if isinstance(value, bytes) else value)


def _source(name: str) -> Any:
    """The text that defines an interface; parts of services and actions have none of their own."""
    _, kind, short = name.split("/")
    if "_" in short:
        return TypeSource(type_name=name, encoding="implicit")
    text = registry.text(name).rstrip("\n")
    return TypeSource(type_name=name, encoding=kind, raw_file_contents=text)
