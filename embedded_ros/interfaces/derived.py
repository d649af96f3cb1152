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

    _TYPE_SUPPORT = "embedded_ros"

    def __call__(cls, *args: Any, **kwargs: Any) -> Any:
        kind = "Action" if hasattr(cls, "Goal") else "Service"
        raise NotImplementedError(f"{kind} classes can not be instantiated")


def _group(name: str, members: dict[str, Any], file_stem: str) -> Any:
    """A class of the interface `name` in the module of the file that defines it."""
    package, kind, short = name.split("/")
    module = f"{package}.{kind}._{snake_case(file_stem)}"
    return Group(short, (), {"_name": name, "__module__": module, **members})


def make_group_class(name: str, classes: Callable[[str], Any]) -> Any:
    """The class of a service (``Request``, ``Response``, ``Event``), of an action (``Goal``,
    ``Result``, ...) or of one of an action's own services (``Name_SendGoal``, ``Name_GetResult``).

    :param classes: gives the class of any other interface.
    """
    _, kind, short = name.split("/")
    if kind == "srv" or "_" in short:
        members = {part: classes(f"{name}_{part}") for part in SERVICE_PARTS}
        return _group(name, members, short.split("_")[0])
    members = {part: classes(f"{name}_{part}") for part in ACTION_PARTS}
    members["Impl"] = type(
        "Impl",
        (),
        {
            "SendGoalService": classes(f"{name}_SendGoal"),
            "GetResultService": classes(f"{name}_GetResult"),
            "FeedbackMessage": classes(f"{name}_FeedbackMessage"),
            "CancelGoalService": classes("action_msgs/srv/CancelGoal"),
            "GoalStatusMessage": classes("action_msgs/msg/GoalStatusArray"),
        },
    )
    return _group(name, members, short)
