# SPDX-License-Identifier: Apache-2.0
"""Rules for fully expanded topic and service names."""

from __future__ import annotations

from .exceptions import InvalidServiceNameException, InvalidTopicNameException
from .impl.names import check_absolute_name


def validate_full_topic_name(name: str, *, is_service: bool = False) -> bool:
    """Return True for a valid full topic or service name.

    :raises InvalidTopicNameException: it is not valid (InvalidServiceNameException for services).
    """

    def fail(text: str, index: int) -> None:
        kind = InvalidServiceNameException if is_service else InvalidTopicNameException
        raise kind(name, text, index)

    check_absolute_name(name, "topic name", fail, ending="", limit=247)
    return True
