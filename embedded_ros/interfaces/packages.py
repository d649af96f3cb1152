# SPDX-License-Identifier: Apache-2.0
"""Finds interface packages: folders with package.xml beside msg/, srv/ or action/."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Mapping
from pathlib import Path

from .spec import DefinitionError

KINDS = ("msg", "srv", "action")

_IGNORE = {"COLCON_IGNORE", "AMENT_IGNORE", "CATKIN_IGNORE"}


def package_name(folder: Path) -> str:
    """The name in a folder's package.xml.

    :raises DefinitionError: there is no readable package.xml with a name.
    """
    manifest = folder / "package.xml"
    try:
        name = ElementTree.parse(manifest).getroot().findtext("name", "").strip()
    except (OSError, ElementTree.ParseError) as error:
        raise DefinitionError(f"{manifest}: {error}") from error
    if not name.isidentifier():
        raise DefinitionError(f"{manifest}: the package name {name!r} is no identifier")
    return name


def interface_folders(path: Path | str) -> list[Path]:
    """The interface packages at or below `path`, such as the src folder of a workspace.

    As colcon does, this looks neither into packages, nor into hidden folders, nor into those that
    hold COLCON_IGNORE.

    :raises FileNotFoundError: `path` is no folder.
    """
    root = Path(path).resolve()
    if not root.is_dir():
        raise FileNotFoundError(f"interface path {root} is not a folder")
    found = []
    for folder, children, files in os.walk(root):
        if "package.xml" in files and any(kind in children for kind in KINDS):
            found.append(Path(folder))
        if "package.xml" in files or not _IGNORE.isdisjoint(files):
            children.clear()
        children[:] = sorted(child for child in children if not child.startswith("."))
    return found


def folders_of_environment(environ: Mapping[str, str]) -> Iterator[Path]:
    """The interface packages below EMBEDDED_ROS_INTERFACE_PATH, then those installed below
    AMENT_PREFIX_PATH; what does not exist is passed over, as on any search path.
    """
    for path in environ.get("EMBEDDED_ROS_INTERFACE_PATH", "").split(os.pathsep):
        if path and Path(path).is_dir():
            yield from interface_folders(path)
    for prefix in environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        share = Path(prefix, "share")
        index = share / "ament_index" / "resource_index" / "rosidl_interfaces"
        if prefix and index.is_dir():
            yield from (share / package for package in sorted(os.listdir(index)))
