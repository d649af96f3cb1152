# SPDX-License-Identifier: Apache-2.0
"""From names such as ``std_msgs/msg/String`` or ``std_msgs/String`` to classes.

All raise ValueError for a name that is malformed or means something else, ModuleNotFoundError for
an unknown package, AttributeError for a package without that interface.
"""

from __future__ import annotations

from typing import Any

from rosidl_parser.definition import NamespacedType

from .import_message import import_message_from_namespaced_type


def _namespaced_type(identifier: str, kind: str | None = None) -> NamespacedType:
    *namespaces, name = identifier.split("/")
    if len(namespaces) == 1 and kind is not None:
        namespaces.append(kind)
    return NamespacedType(namespaces, name)


def get_namespaced_type(identifier: str) -> NamespacedType:
    """The type of that full name."""
    return _namespaced_type(identifier)


def get_message_namespaced_type(identifier: str) -> NamespacedType:
    """The type of that name; ``msg`` may be left out."""
    return _namespaced_type(identifier, "msg")


def get_service_namespaced_type(identifier: str) -> NamespacedType:
    """The type of that name; ``srv`` may be left out."""
    return _namespaced_type(identifier, "srv")


def get_action_namespaced_type(identifier: str) -> NamespacedType:
    """The type of that name; ``action`` may be left out."""
    return _namespaced_type(identifier, "action")


def is_message(interface: Any) -> bool:
    """Whether it is a message class."""
    return hasattr(interface, "SLOT_TYPES")


def is_service(interface: Any) -> bool:
    """Whether it is a service class."""
    return hasattr(interface, "Request") and hasattr(interface, "Response")


def is_action(interface: Any) -> bool:
    """Whether it is an action class."""
    return all(hasattr(interface, part) for part in ("Goal", "Result", "Feedback"))


def get_interface(identifier: str) -> Any:
    """The class of any interface, from its full name."""
    return import_message_from_namespaced_type(get_namespaced_type(identifier))


def get_message(identifier: str) -> Any:
    """The class of a message."""
    interface = import_message_from_namespaced_type(get_message_namespaced_type(identifier))
    if not is_message(interface):
        raise ValueError(f"Expected the full name of a message, got '{identifier}'")
    return interface


def get_service(identifier: str) -> Any:
    """The class of a service."""
    interface = import_message_from_namespaced_type(get_service_namespaced_type(identifier))
    if not is_service(interface):
        raise ValueError(f"Expected the full name of a service, got '{identifier}'")
    return interface


def get_action(identifier: str) -> Any:
    """The class of an action."""
    interface = import_message_from_namespaced_type(get_action_namespaced_type(identifier))
    if not is_action(interface):
        raise ValueError(f"Expected the full name of an action, got '{identifier}'")
    return interface
