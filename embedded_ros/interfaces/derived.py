# SPDX-License-Identifier: Apache-2.0
"""The messages that a service or an action consists of, derived from its text as rosidl derives
them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from .classes import snake_case
from .spec import Field, FieldType, MessageSpec, parse_message, split_sections

_UUID = Field("goal_id", FieldType("unique_identifier_msgs/msg/UUID"))

SERVICE_PARTS = ("Request", "Response", "Event")
ACTION_PARTS = ("Goal", "Result", "Feedback")


def _section(text: str, name: str) -> MessageSpec:
    return parse_message(text, name)


def _event(name: str) -> MessageSpec:
    return MessageSpec(
        f"{name}_Event",
        (
            Field("info", FieldType("service_msgs/msg/ServiceEventInfo")),
            Field("request", FieldType(f"{name}_Request", "sequence", 1)),
            Field("response", FieldType(f"{name}_Response", "sequence", 1)),
        ),
    )


def derive_service(text: str, name: str) -> list[MessageSpec]:
    """Request, response and event of service `name` (``package/srv/Name``)."""
    request, response = split_sections(text, 2, name)
    parts = [_section(request, f"{name}_Request"), _section(response, f"{name}_Response")]
    return [*parts, _event(name)]


def derive_action(text: str, name: str) -> list[MessageSpec]:
    """Goal, result and feedback of action `name` and the messages of its two services and its
    feedback topic.
    """
    sections = split_sections(text, 3, name)
    parts = [_section(s, f"{name}_{p}") for s, p in zip(sections, ACTION_PARTS, strict=True)]
    goal = Field("goal", FieldType(f"{name}_Goal"))
    result = Field("result", FieldType(f"{name}_Result"))
    feedback = Field("feedback", FieldType(f"{name}_Feedback"))
    stamp = Field("stamp", FieldType("builtin_interfaces/msg/Time"))
    return [
        *parts,
        MessageSpec(f"{name}_SendGoal_Request", (_UUID, goal)),
        MessageSpec(f"{name}_SendGoal_Response", (Field("accepted", FieldType("bool")), stamp)),
        _event(f"{name}_SendGoal"),
        MessageSpec(f"{name}_GetResult_Request", (_UUID,)),
        MessageSpec(f"{name}_GetResult_Response", (Field("status", FieldType("int8")), result)),
        _event(f"{name}_GetResult"),
        MessageSpec(f"{name}_FeedbackMessage", (_UUID, feedback)),
    ]


class Group(type):
    """Metaclass of service and action classes, which only group message classes and have no
    instances.
    """

    def __call__(cls, *args: Any, **kwargs: Any) -> Any:
        raise NotImplementedError(f"{cls.__name__} cannot be instantiated; use its parts")


def make_group_class(name: str, classes: Callable[[str], type]) -> Any:
    """The class of a service (``Request``, ``Response``, ``Event``) or action (``Goal``,
    ``Result``, ...).
    """
    package, kind, short = name.split("/")
    parts: dict[str, Any] = {"_name": name}
    if kind == "srv":
        parts.update({part: classes(f"{name}_{part}") for part in SERVICE_PARTS})
    else:
        parts.update({part: classes(f"{name}_{part}") for part in ACTION_PARTS})
        impl = {"FeedbackMessage": classes(f"{name}_FeedbackMessage")}
        for service in ("SendGoal", "GetResult"):
            members = {part: classes(f"{name}_{service}_{part}") for part in SERVICE_PARTS}
            impl[service + "Service"] = Group(service, (), members)
        parts["Impl"] = Group("Impl", (), impl)
    parts["__module__"] = f"{package}.{kind}._{snake_case(short)}"
    return Group(short, (), parts)
