# SPDX-License-Identifier: Apache-2.0
"""rclpy and the ROS 2 interface packages on machines without ROS 2, over real DDS.

:func:`enable` makes ``import rclpy``, ``import std_msgs.msg`` and so on work when no real rclpy is
installed. What goes over the wire is what ROS 2 Jazzy sends, so nodes on both kinds of machine see
each other.
"""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Sequence
from pathlib import Path

__all__ = ["MissingDependencyError", "enable", "interface_folders"]

_REQUIRED = {
    "cyclonedds": "cyclonedds>=11.0.1,<11.1",
    "rosbags": "rosbags",
    "numpy": "numpy",
    "yaml": "pyyaml",
}


class MissingDependencyError(ImportError):
    """A package that the embedded runtime needs is not installed."""


def interface_folders(path: Path | str) -> list[Path]:
    """The interface packages at `path`: the folder itself or its children that hold package.xml and
    msg, srv or action.

    :raises FileNotFoundError: `path` is no folder.
    """
    root = Path(path).resolve()
    if not root.is_dir():
        raise FileNotFoundError(f"interface path {root} is not a folder")
    return [
        folder
        for folder in [root, *sorted(child for child in root.iterdir() if child.is_dir())]
        if (folder / "package.xml").is_file()
        and any((folder / kind).is_dir() for kind in ("msg", "srv", "action"))
    ]


def enable(interface_paths: Sequence[Path | str] = ()) -> bool:
    """Serve rclpy and the interface packages, unless a real rclpy is installed.

    :param interface_paths: folders that are, or directly hold, ROS interface packages (package.xml
        beside msg/, srv/ or action/); their types become importable under the name in package.xml.
    :return: True when this runtime serves rclpy, False when a real one is there and nothing was
        done. Calling again is harmless and adds further interface paths.
    :raises MissingDependencyError: a needed package is not installed.
    :raises FileNotFoundError: an interface path is no folder.
    """
    finder = next((f for f in sys.meta_path if type(f).__name__ == "InterfaceFinder"), None)
    if finder is None:
        if "rclpy" in sys.modules or importlib.util.find_spec("rclpy") is not None:
            return False
        missing = [
            need for name, need in _REQUIRED.items() if importlib.util.find_spec(name) is None
        ]
        if missing:
            wanted = " ".join(f"'{need}'" for need in missing)
            raise MissingDependencyError(
                "no ROS 2 is sourced, and the embedded runtime needs packages that are not "
                "installed; "
                f"run: {sys.executable} -m pip install {wanted}"
            )
        from .finder import InterfaceFinder
        from .interfaces.registry import registry

        finder = InterfaceFinder(registry)
        sys.meta_path.append(finder)
    folders = [folder for path in interface_paths for folder in interface_folders(path)]
    finder.add_packages(folders)  # type: ignore[attr-defined]
    return True
