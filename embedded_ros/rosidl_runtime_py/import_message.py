# SPDX-License-Identifier: Apache-2.0
"""From the type of a member to its class."""

from __future__ import annotations

import importlib
from typing import Any

from rosidl_parser.definition import NamespacedType


def import_message_from_namespaced_type(message_type: NamespacedType) -> Any:
    """Import the class of an interface.

    :raises ModuleNotFoundError: there is no such package.
    :raises AttributeError: the package has no such interface.
    """
    module = importlib.import_module(".".join(message_type.namespaces))
    action, _, suffix = message_type.name.rpartition("_")
    if suffix == "FeedbackMessage":
        return getattr(module, action).Impl.FeedbackMessage
    return getattr(module, message_type.name)
