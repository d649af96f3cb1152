# SPDX-License-Identifier: Apache-2.0
"""Messages to CDR bytes and back."""

from __future__ import annotations

from typing import Any

from embedded_ros.interfaces.cdr import CdrError
from embedded_ros.interfaces.registry import registry

from ._rclpy_pybind11 import RMWError
from .type_support import check_is_valid_msg_type


def serialize_message(message: Any) -> bytes:
    """Encode a message, header included.

    :raises AttributeError: `message` is no ROS message.
    """
    check_is_valid_msg_type(type(message))
    return registry.serializer(type(message))(message)


def deserialize_message(serialized_message: bytes, message_type: Any) -> Any:
    """Decode a message of a known type.

    :raises AttributeError: `message_type` is no ROS message.
    :raises RMWError: the bytes are no encoding of that type.
    """
    check_is_valid_msg_type(message_type)
    try:
        return registry.deserializer(message_type)(bytes(serialized_message))
    except CdrError as error:
        raise RMWError(f"failed to deserialize ROS message: {error}") from error
