# SPDX-License-Identifier: Apache-2.0
"""Log filters: once, skip the first, at most every so often. State belongs to the calling line."""

from __future__ import annotations

import os
import sys
import time
from types import FrameType
from typing import Any, ClassVar, NamedTuple

_PACKAGE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


class CallerId(NamedTuple):
    """The line that logs."""

    function_name: str
    file_path: str
    line_number: int
    last_index: int


def find_caller() -> CallerId:
    """The first frame outside of rclpy's logging."""
    frame: FrameType | None = sys._getframe(1)
    while (
        frame is not None
        and frame.f_code.co_filename.startswith(_PACKAGE)
        and "log" in os.path.basename(frame.f_code.co_filename)
    ):
        frame = frame.f_back
    if frame is None:
        return CallerId("", "", 0, 0)
    code = frame.f_code
    return CallerId(code.co_name, code.co_filename, frame.f_lineno, frame.f_lasti)


class LoggingFilter:
    """Base of the filters: the arguments it takes, and how it decides."""

    #: argument name -> default; a missing default means that the argument is required
    params: ClassVar[dict[str, Any]] = {}
    required: ClassVar[frozenset[str]] = frozenset()

    @classmethod
    def initialize_context(cls, context: dict[str, Any], **kwargs: Any) -> None:
        """Put the arguments and the first state into ``context``.

        :raises TypeError: a required argument is missing.
        """
        for name in cls.required:
            if kwargs.get(name) is None:
                raise TypeError(
                    f'Required parameter "{name}" was not specified for logging filter '
                    f'"{cls.__name__}"'
                )
        for name, default in cls.params.items():
            context[name] = kwargs.get(name, default)

    @staticmethod
    def should_log(context: dict[str, Any]) -> bool:
        """Decide, and note that a message came by."""
        raise NotImplementedError


class Once(LoggingFilter):
    """Lets the first message pass."""

    params: ClassVar[dict[str, Any]] = {"once": None}

    @staticmethod
    def should_log(context: dict[str, Any]) -> bool:
        first = not context.get("has_been_logged_once", False)
        context["has_been_logged_once"] = True
        return first


class Throttle(LoggingFilter):
    """Lets a message pass when the last one that passed is long enough ago."""

    params: ClassVar[dict[str, Any]] = {
        "throttle_duration_sec": None,
        "throttle_time_source_type": None,
    }
    required = frozenset(("throttle_duration_sec",))

    @classmethod
    def initialize_context(cls, context: dict[str, Any], **kwargs: Any) -> None:
        super().initialize_context(context, **kwargs)
        source = context["throttle_time_source_type"]
        if isinstance(source, str) and source not in (
            "RCUTILS_STEADY_TIME",
            "RCUTILS_SYSTEM_TIME",
        ):
            raise ValueError(f'Received invalid "throttle_time_source_type" of "{source}"')

    @staticmethod
    def should_log(context: dict[str, Any]) -> bool:
        source = context["throttle_time_source_type"]
        if source is not None and not isinstance(source, str):
            now = source.now().nanoseconds
        else:
            now = time.time_ns() if source == "RCUTILS_SYSTEM_TIME" else time.monotonic_ns()
        # As in ROS: counted from zero, so a simulated clock throttles until the first period is
        # over.
        if now < context.get("throttle_last_logged", 0) + int(
            context["throttle_duration_sec"] * 1e9
        ):
            return False
        context["throttle_last_logged"] = now
        return True


class SkipFirst(LoggingFilter):
    """Lets all but the first message pass."""

    params: ClassVar[dict[str, Any]] = {"skip_first": None}

    @staticmethod
    def should_log(context: dict[str, Any]) -> bool:
        first = not context.get("first_has_been_skipped", False)
        context["first_has_been_skipped"] = True
        return not first


#: the order in which filters decide
FILTERS: dict[str, type[LoggingFilter]] = {
    "throttle": Throttle,
    "skip_first": SkipFirst,
    "once": Once,
}


def filters_from_kwargs(kwargs: dict[str, Any]) -> list[str]:
    """The filters that logging arguments ask for.

    :raises TypeError: an argument belongs to no filter, or its filter lacks another one.
    """
    wanted = [
        name
        for name, filter_class in FILTERS.items()
        if any(kwargs.get(param) for param in filter_class.params)
    ]
    for name in wanted:
        for param in FILTERS[name].required:
            if kwargs.get(param) is None:
                raise TypeError(
                    f'required parameter "{param}" not specified but is required for the '
                    f'logging filter "{name}"'
                )
    known = {param for filter_class in FILTERS.values() for param in filter_class.params} | {"name"}
    for param in kwargs:
        if param not in known:
            raise TypeError(f'parameter "{param}" is not one of the recognized logging options')
    return wanted
