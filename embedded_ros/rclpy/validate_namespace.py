# SPDX-License-Identifier: Apache-2.0
"""Rules for namespaces."""

from __future__ import annotations

import re

from .exceptions import InvalidNamespaceException


def validate_namespace(namespace: str) -> bool:
    """Return True for a valid absolute namespace.

    :raises InvalidNamespaceException: it is not valid.
    """

    def fail(text: str, index: int) -> None:
        raise InvalidNamespaceException(namespace, text, index)

    if not namespace:
        fail("namespace must not be empty", 0)
    if not namespace.startswith("/"):
        fail("namespace must be absolute, it must lead with a '/'", 0)
    if namespace == "/":
        return True
    if namespace.endswith("/"):
        fail("namespace must not end with a '/', unless only a '/'", len(namespace) - 1)
    bad = re.search(r"[^A-Za-z0-9_/]", namespace)
    if bad:
        fail(
            "namespace must not contain characters other than alphanumerics, '_', or '/'",
            bad.start(),
        )
    repeated = namespace.find("//")
    if repeated >= 0:
        fail("namespace must not contain repeated '/'", repeated + 1)
    digit = re.search(r"/\d", namespace)
    if digit:
        fail("namespace must not have a token that starts with a number", digit.start() + 1)
    if len(namespace) > 245:
        fail("namespace should not exceed 245 characters", 244)
    return True
