# SPDX-License-Identifier: Apache-2.0
"""Rules for topic and service names as programs write them."""

from __future__ import annotations

import re

from .exceptions import InvalidServiceNameException, InvalidTopicNameException


def validate_topic_name(name: str, *, is_service: bool = False) -> bool:
    """Return True for a valid topic or service name; ``~`` and ``{...}`` are allowed.

    :raises InvalidTopicNameException: it is not valid (InvalidServiceNameException for services).
    """

    def fail(text: str, index: int) -> None:
        kind = InvalidServiceNameException if is_service else InvalidTopicNameException
        raise kind(name, text, index)

    if not name:
        fail("topic name must not be empty string", 0)
    if name.endswith("/"):
        fail("topic name must not end with a forward slash", len(name) - 1)
    bad = re.search(r"[^A-Za-z0-9_/~{}]", name)
    if bad:
        fail(
            "topic name must not contain characters other than alphanumerics, '_', '~', "
            "'{', or '}'",
            bad.start(),
        )
    tilde = name.find("~", 1)
    if tilde > 0:
        fail("topic name must not have a tilde '~' unless it is the first character", tilde)
    if name.startswith("~") and len(name) > 1 and name[1] != "/":
        fail("tilde '~' must be followed by a forward slash '/'", 1)
    repeated = name.find("//")
    if repeated >= 0:
        fail("topic name must not contain repeated '/'", repeated + 1)
    outside = re.sub(r"\{[^{}]*\}", lambda m: "_" * len(m[0]), name)
    brace = re.search(r"[{}]", outside)
    if brace:
        fail("topic name has mismatched curly braces", brace.start())
    inside = re.search(r"\{(\d|[^}]*[^A-Za-z0-9_}])", name)
    if inside:
        fail(
            "substitution name must be alphanumeric and not start with a number", inside.start() + 1
        )
    digit = re.search(r"(^|/)\d", name)
    if digit:
        fail("topic name token must not start with a number", digit.end() - 1)
    return True
