# SPDX-License-Identifier: Apache-2.0
"""rclpy and the ROS 2 interface packages on machines without ROS 2, over real DDS.

:func:`enable` makes ``import rclpy``, ``import std_msgs.msg`` and so on work when no real rclpy is
installed. What goes over the wire is what ROS 2 Jazzy sends, so nodes on both kinds of machine see
each other. Without cyclonedds, nodes of one process do.
"""

from __future__ import annotations

import importlib.util
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from .transport import chosen_transport

__all__ = ["MissingDependencyError", "enable"]

_REQUIRED = {
    "rosbags": "rosbags",
    "numpy": "numpy",
    "yaml": "pyyaml",
}


class MissingDependencyError(ImportError):
    """A package that the embedded runtime needs is not installed."""


def _is_ours(finder: object) -> bool:
    return type(finder).__name__ == "InterfaceFinder"


def installed(name: str) -> bool:
    """Whether the top-level package `name` is served by another than this runtime.

    Folders without ``__init__.py`` are not, though Python takes them for packages when a program
    runs beside them (in a checkout of common_interfaces, say); nor are unbuilt sources of rclpy.
    """
    others = [finder for finder in sys.meta_path if not _is_ours(finder)]
    spec = next(filter(None, (finder.find_spec(name, None) for finder in others)), None)
    if spec is None or spec.origin is None:
        return False
    folder = Path(spec.origin).parent
    sources = name == "rclpy" and (folder / "impl" / "implementation_singleton.py").is_file()
    return not sources or any(folder.glob("_rclpy_pybind11*"))


def enable(interface_paths: Sequence[Path | str] = ()) -> bool:
    """Serve rclpy and the interface packages, unless a real rclpy is installed.

    Interface packages (package.xml beside msg/, srv/ or action/) become importable under the name
    in package.xml. They are looked for in `interface_paths`, then in the folders that the
    environment variable EMBEDDED_ROS_INTERFACE_PATH lists, then below AMENT_PREFIX_PATH. The first
    definition of a type counts, and goes before the one built in here.

    :param interface_paths: folders that are or hold interface packages, such as a workspace's src.
    :return: True when this runtime serves rclpy, False when a real one is there and nothing was
        done. Calling again is harmless and adds further interface paths.
    :raises MissingDependencyError: a needed package is not installed.
    :raises FileNotFoundError: an interface path is no folder.
    :raises ValueError: EMBEDDED_ROS_TRANSPORT names no transport that is there.
    :raises DefinitionError: a package.xml there cannot be read (in folders that the environment
        names this is only warned of).
    """
    finder = next((f for f in sys.meta_path if _is_ours(f)), None)
    if finder is None:
        if "rclpy" in sys.modules or installed("rclpy"):
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
        chosen_transport()
        from .finder import InterfaceFinder
        from .interfaces.registry import registry

        finder = InterfaceFinder(registry)
        sys.meta_path.insert(0, finder)
        finder.add_paths(interface_paths)
        finder.add_environment(os.environ)
    else:
        finder.add_paths(interface_paths)  # type: ignore[attr-defined]
    return True
