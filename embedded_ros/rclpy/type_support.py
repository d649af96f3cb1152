# SPDX-License-Identifier: Apache-2.0
"""Checks that a class is a ROS interface."""

from __future__ import annotations

from typing import Any

from embedded_ros.interfaces.classes import Message
from embedded_ros.interfaces.derived import Group

from .exceptions import NoTypeSupportImportedException


def check_is_valid_msg_type(msg_type: Any) -> None:
    """:raises NoTypeSupportImportedException: `msg_type` is no message class."""
    if not (
        isinstance(msg_type, type) and issubclass(msg_type, Message) and hasattr(msg_type, "_spec_")
    ):
        raise NoTypeSupportImportedException()


def check_is_valid_srv_type(srv_type: Any) -> None:
    """:raises NoTypeSupportImportedException: `srv_type` is no service class."""
    if not (isinstance(srv_type, Group) and "/srv/" in getattr(srv_type, "_name", "")):
        raise NoTypeSupportImportedException()


def check_for_type_support(msg_or_srv_type: Any) -> None:
    """:raises AttributeError: the class is neither a message nor a service."""
    if not isinstance(msg_or_srv_type, (type(Message), Group)):
        raise AttributeError(
            f"{msg_or_srv_type!r} is not a ROS interface type; pass a class from a package.msg "
            f"or package.srv module"
        )
