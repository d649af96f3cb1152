# SPDX-License-Identifier: Apache-2.0
"""The messages that a service or an action consists of, derived from its text as rosidl derives
them, and the classes that group them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from .classes import snake_case
from .parser import Section, parse_message
from .spec import Field, FieldType, MessageSpec

_UUID = Field("goal_id", FieldType("unique_identifier_msgs/msg/UUID"))

SERVICE_PARTS = ("Request", "Response", "Event")
ACTION_PARTS = ("Goal", "Result", "Feedback")


def _service(request: MessageSpec, response: MessageSpec) -> list[MessageSpec]:
    """The messages of a service, and the service itself as its type description has it."""
    name = request.name.removesuffix("_Request")
    event = (
        Field("info", FieldType("service_msgs/msg/ServiceEventInfo")),
        Field("request", FieldType(request.name, "sequence", 1)),
        Field("response", FieldType(response.name, "sequence", 1)),
    )
    whole = (
        Field(f"{part.lower()}_message", FieldType(f"{name}_{part}")) for part in SERVICE_PARTS
    )
    return [
        request,
        response,
        MessageSpec(f"{name}_Event", event),
        MessageSpec(name, tuple(whole)),
    ]


def derive_service(sections: list[Section], name: str) -> list[MessageSpec]:
    """Request, response and event of service `name` (``package/srv/Name``), and itself."""
    request, response = sections
    return _service(
        parse_message(request, f"{name}_Request"), parse_message(response, f"{name}_Response")
    )


def derive_action(sections: list[Section], name: str) -> list[MessageSpec]:
    """Goal, result and feedback of action `name`, the messages of its two services and of its
    feedback topic, and itself.
    """
    goal, result, feedback = (FieldType(f"{name}_{part}") for part in ACTION_PARTS)
    stamp = Field("stamp", FieldType("builtin_interfaces/msg/Time"))
    whole = (
        Field("goal", goal),
        Field("result", result),
        Field("feedback", feedback),
        Field("send_goal_service", FieldType(f"{name}_SendGoal")),
        Field("get_result_service", FieldType(f"{name}_GetResult")),
        Field("feedback_message", FieldType(f"{name}_FeedbackMessage")),
    )
    return [
        *(parse_message(s, f"{name}_{p}") for s, p in zip(sections, ACTION_PARTS, strict=True)),
        *_service(
            MessageSpec(f"{name}_SendGoal_Request", (_UUID, Field("goal", goal))),
            MessageSpec(f"{name}_SendGoal_Response", (Field("accepted", FieldType("bool")), stamp)),
        ),
        *_service(
            MessageSpec(f"{name}_GetResult_Request", (_UUID,)),
            MessageSpec(
                f"{name}_GetResult_Response",
                (Field("status", FieldType("int8")), Field("result", result)),
            ),
        ),
        MessageSpec(f"{name}_FeedbackMessage", (_UUID, Field("feedback", feedback))),
        MessageSpec(name, whole),
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
