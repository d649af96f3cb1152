# SPDX-License-Identifier: Apache-2.0
"""Rules for fully expanded topic and service names."""

from __future__ import annotations

import re

from .exceptions import InvalidServiceNameException, InvalidTopicNameException


def validate_full_topic_name(name: str, *, is_service: bool = False) -> bool:
    """Return True for a valid full topic or service name.

    :raises InvalidTopicNameException: it is not valid (InvalidServiceNameException for services).
    """

    def fail(text: str, index: int) -> None:
        kind = InvalidServiceNameException if is_service else InvalidTopicNameException
        raise kind(name, text, index)

    if not name:
        fail("topic name must not be empty", 0)
    if not name.startswith("/"):
        fail("topic name must be absolute, it must lead with a '/'", 0)
    if name.endswith("/"):
        fail("topic name must not end with a '/'", len(name) - 1)
    bad = re.search(r"[^A-Za-z0-9_/]", name)
    if bad:
        fail(
            "topic name must not contain characters other than alphanumerics, '_', or '/'",
            bad.start(),
        )
    repeated = name.find("//")
    if repeated >= 0:
        fail("topic name must not contain repeated '/'", repeated + 1)
    digit = re.search(r"/\d", name)
    if digit:
        fail("topic name must not have a token that starts with a number", digit.start() + 1)
    if len(name) > 247:
        fail("topic name should not exceed 247 characters", 246)
    return True
