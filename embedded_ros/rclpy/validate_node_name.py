# SPDX-License-Identifier: Apache-2.0
"""Rules for node names."""

from __future__ import annotations

import re

from .exceptions import InvalidNodeNameException


def is_valid_node_name(name: str) -> bool:
    """Whether a node may have this name."""
    return re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name) is not None and len(name) <= 255


def validate_node_name(node_name: str) -> bool:
    """Return True for a valid node name.

    :raises InvalidNodeNameException: it is not valid.
    """
    if not node_name:
        raise InvalidNodeNameException(node_name, "node name must not be empty", 0)
    bad = re.search(r"[^A-Za-z0-9_]", node_name)
    if bad:
        text = "node name must not contain characters other than alphanumerics or '_'"
        raise InvalidNodeNameException(node_name, text, bad.start())
    if node_name[0].isdigit():
        raise InvalidNodeNameException(node_name, "node name must not start with a number", 0)
    if len(node_name) > 255:
        raise InvalidNodeNameException(node_name, "node name length must not exceed 255", 254)
    return True
