# SPDX-License-Identifier: Apache-2.0
"""What interfaces there are."""

from __future__ import annotations

from collections.abc import Iterable
from importlib.util import find_spec

from embedded_ros.interfaces.packages import KINDS
from embedded_ros.interfaces.registry import registry


def get_interface_packages() -> dict[str, str]:
    """Packages with interfaces, each with the folder it was read from (empty: built in)."""
    return {package: str(registry.folder(package) or "") for package in sorted(registry.packages)}


def _interfaces(package_names: Iterable[str], kinds: Iterable[str]) -> dict[str, list[str]]:
    wanted = list(package_names) or sorted(registry.packages)
    for package in wanted:
        if package not in registry.packages and find_spec(package) is None:
            raise LookupError(f"Unknown package '{package}'")
    found = {
        package: [f"{kind}/{name}" for kind in kinds for name in registry.names(package, kind)]
        for package in wanted
    }
    return {package: names for package, names in found.items() if names}


def get_interfaces(package_names: Iterable[str] = ()) -> dict[str, list[str]]:
    """The interfaces of some packages, or of all: ``{"std_msgs": ["msg/Bool", ...]}``.

    :raises LookupError: a package is not known.
    """
    return _interfaces(package_names, KINDS)


def get_message_interfaces(package_names: Iterable[str] = ()) -> dict[str, list[str]]:
    """The messages of some packages, or of all.

    :raises LookupError: a package is not known.
    """
    return _interfaces(package_names, ("msg",))


def get_service_interfaces(package_names: Iterable[str] = ()) -> dict[str, list[str]]:
    """The services of some packages, or of all.

    :raises LookupError: a package is not known.
    """
    return _interfaces(package_names, ("srv",))


def get_action_interfaces(package_names: Iterable[str] = ()) -> dict[str, list[str]]:
    """The actions of some packages, or of all.

    :raises LookupError: a package is not known.
    """
    return _interfaces(package_names, ("action",))


def get_interface_path(interface_name: str) -> str:
    """The file that defines an interface (``package/msg/Name``, with or without ``.msg``).

    :raises ValueError: the name is malformed.
    :raises LookupError: the interface is not known, or built in and so without a file.
    """
    parts = interface_name.split("/")
    if len(parts) < 2 or not all(parts) or ".." in parts:
        raise ValueError(
            f"Invalid name '{interface_name}'. Expected non-empty parts separated by '/'"
        )
    if parts[0] not in registry.packages:
        raise LookupError(f"Unknown package '{parts[0]}'")
    path = registry.path(interface_name.removesuffix(f".{parts[-2]}"))
    if path is None:
        raise LookupError(f"Could not find a file of the interface '{interface_name}'")
    return str(path)
