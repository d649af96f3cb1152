# SPDX-License-Identifier: Apache-2.0
"""What the rules for absolute names have in common."""

from __future__ import annotations

import re
from collections.abc import Callable


def check_absolute_name(
    name: str, kind: str, fail: Callable[[str, int], None], *, ending: str, limit: int
) -> None:
    """Call `fail` with a text and a place if `name` is no absolute name; it is to raise.

    :param kind: what is named, as ``topic name``.
    :param ending: added to the text for a name with a slash at its end.
    :param limit: how long the name may be.
    """
    if not name:
        fail(f"{kind} must not be empty", 0)
    if not name.startswith("/"):
        fail(f"{kind} must be absolute, it must lead with a '/'", 0)
    if name.endswith("/"):
        fail(f"{kind} must not end with a '/'{ending}", len(name) - 1)
    if bad := re.search(r"[^A-Za-z0-9_/]", name):
        text = "must not contain characters other than alphanumerics, '_', or '/'"
        fail(f"{kind} {text}", bad.start())
    if (repeated := name.find("//")) >= 0:
        fail(f"{kind} must not contain repeated '/'", repeated + 1)
    if digit := re.search(r"/\d", name):
        fail(f"{kind} must not have a token that starts with a number", digit.start() + 1)
    if len(name) > limit:
        fail(f"{kind} should not exceed {limit} characters", limit - 1)
