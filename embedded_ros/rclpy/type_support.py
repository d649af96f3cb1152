# SPDX-License-Identifier: Apache-2.0
"""Checks that a class is a ROS interface."""

from __future__ import annotations

from typing import Any

from embedded_ros.interfaces.classes import MessageMeta
from embedded_ros.interfaces.derived import Group

from .exceptions import NoTypeSupportImportedException


def check_for_type_support(msg_or_srv_type: Any) -> None:
    """:raises AttributeError: the class is no ROS interface.
    :raises NoTypeSupportImportedException: it is one, but made for another runtime.
    """
    metaclass = type(msg_or_srv_type)
    if not hasattr(metaclass, "_TYPE_SUPPORT"):
        raise AttributeError(
            f"{msg_or_srv_type!r} is not a ROS interface type; pass a class from a package.msg, "
            f"package.srv or package.action module"
        )
    if not issubclass(metaclass, (MessageMeta, Group)):
        raise NoTypeSupportImportedException()


def check_is_valid_msg_type(msg_type: Any) -> None:
    """:raises AttributeError: `msg_type` is no ROS interface.
    :raises RuntimeError: it is a service or an action.
    """
    check_for_type_support(msg_type)
    if not isinstance(msg_type, MessageMeta):
        raise RuntimeError(
            f"The message type provided is not valid ({msg_type}), this might be a service or "
            f"action"
        )


def check_is_valid_srv_type(srv_type: Any) -> None:
    """:raises AttributeError: `srv_type` is no ROS interface.
    :raises RuntimeError: it is a message or an action.
    """
    check_for_type_support(srv_type)
    if not hasattr(srv_type, "Request"):
        raise RuntimeError(
            f"The service type provided is not valid ({srv_type}), this might be a message or "
            f"action"
        )
