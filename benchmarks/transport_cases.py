# SPDX-License-Identifier: Apache-2.0
"""The messages that are sent between two processes, and the same as cyclonedds' own classes."""

from __future__ import annotations

import functools
import importlib
import os
import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from geometry_msgs.msg import Point, Pose, PoseArray
from std_msgs.msg import ColorRGBA, Float64, Header
from visualization_msgs.msg import Marker, MarkerArray

POSES = 10
MARKERS, POINTS = 60, 20


@dataclass(frozen=True)
class Case:
    """A message with the time of sending in it.

    Attributes:
        n: How much is in it.
        make: Makes the message.
        header: Its header, None for the Float64, whose value is the time [ns].
        offset: Of eight bytes in the encoded message that may be anything.
        period: Seconds between two messages.
    """

    n: int
    make: Callable[[], Any]
    header: Callable[[Any], Any] | None
    offset: int
    period: float = 0.01

    def stamp(self, message: Any) -> None:
        """Write the present time into the message."""
        now = time.monotonic_ns()  # since the machine was started: one clock for its processes
        if self.header is None:
            message.data = float(now)
        else:
            stamp = self.header(message).stamp
            stamp.sec, stamp.nanosec = divmod(now, 10**9)

    def age(self, message: Any) -> float:
        """Milliseconds since then."""
        now = time.monotonic_ns()
        if self.header is None:
            return (now - message.data) * 1e-6
        stamp = self.header(message).stamp
        return (now - stamp.sec * 10**9 - stamp.nanosec) * 1e-6


def _poses() -> Any:
    return PoseArray(header=Header(frame_id="base"), poses=[Pose() for _ in range(POSES)])


def _markers() -> Any:
    def marker(i: int) -> Any:
        points = [Point(x=0.01 * k, y=0.1 * i) for k in range(POINTS)]
        colour = ColorRGBA(r=1.0, a=1.0)
        head = Header(frame_id="base")
        return Marker(header=head, ns="finger", id=i, type=4, color=colour, points=points)

    return MarkerArray(markers=[marker(i) for i in range(MARKERS)])


CASES = {
    "Float64": Case(1, Float64, None, 4),
    "PoseArray": Case(POSES, _poses, lambda m: m.header, 4),
    # At a rate that all carriers keep up with.
    "MarkerArray": Case(MARKERS, _markers, lambda m: m.markers[0].header, 8, 0.05),
    "round trip": Case(1, Float64, None, 4),
    "idle": Case(1, Float64, None, 4),
}


def domain_from_environment() -> int:
    """The ROS domain."""
    return int(os.environ.get("ROS_DOMAIN_ID", "0") or 0)


@functools.cache
def idl_struct(kind: Any) -> Any:
    """The class of cyclonedds for a message class."""
    from cyclonedds.idl import make_idl_struct

    members = {name: _idl_type(text) for name, text in kind.get_fields_and_field_types().items()}
    return make_idl_struct(kind.__name__, f"bench.{kind.__name__}_", members)


def _idl_type(text: str) -> Any:
    from cyclonedds.idl import types

    if match := re.fullmatch(r"sequence<(.*?)(?:, \d+)?>", text):
        return types.sequence[_idl_type(match[1])]
    if match := re.fullmatch(r"(.*)\[(\d+)\]", text):
        return types.array[_idl_type(match[1]), int(match[2])]
    if "/" in text:
        package, name = text.split("/")
        return idl_struct(getattr(importlib.import_module(f"{package}.msg"), name))
    plain = {"boolean": bool, "octet": types.uint8, "string": str}
    names = {"float": "float32", "double": "float64"}
    return plain.get(text) or getattr(types, names.get(text, text))


def as_idl(value: Any) -> Any:
    """A message as an object of cyclonedds' class; other values as they are, arrays as lists."""
    if hasattr(value, "get_fields_and_field_types"):
        fields = value.get_fields_and_field_types()
        return idl_struct(type(value))(**{name: as_idl(getattr(value, name)) for name in fields})
    if isinstance(value, (str, bytes)):
        return value
    return [as_idl(item) for item in value] if hasattr(value, "__len__") else value
