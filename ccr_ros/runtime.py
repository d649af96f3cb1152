# SPDX-License-Identifier: Apache-2.0
"""Makes ``rclpy`` and the interface packages importable, with or without ROS 2.

Whatever starts a node calls :func:`enable_ros` first and imports the node only then; the
nodes themselves are ordinary rclpy code that knows nothing of this.
"""

from __future__ import annotations

from importlib.machinery import PathFinder

from ccr_ros.model.errors import CcrError
from ccr_ros.resources import msg_defs_dir

BUILD_LINE = "colcon build --base-paths src/ccr src/ccr/msg_defs"


class RuntimeMissing(CcrError):
    """Neither ROS 2 nor the embedded runtime can be used as things are; its text says why."""


def real_ros() -> bool:
    """Tell whether a real ``rclpy`` is on the path (as in a shell with ROS 2 sourced)."""
    # PathFinder looks at sys.path only, so that the embedded runtime never answers for ROS. A
    # folder rclpy without __init__.py, as beside a checkout of its sources, has no origin.
    spec = PathFinder.find_spec("rclpy")
    return spec is not None and spec.origin is not None


def enable_ros() -> bool:
    """Make ``rclpy`` and the interface packages importable; call before the first such import.

    Under real ROS 2 this changes nothing. Calling it again does no harm.

    Returns:
        Whether the embedded runtime is in use.

    Raises:
        RuntimeMissing: ROS 2 is sourced but ``ccr_msgs`` is not; or there is no ROS 2 and the
            embedded runtime's dependencies are not installed, or EMBEDDED_ROS_TRANSPORT asks for
            what is not there.
    """
    if real_ros():
        if PathFinder.find_spec("ccr_msgs") is None:
            raise RuntimeMissing(
                "ROS 2 is sourced, but ccr_msgs is not there; build the workspace "
                f"({BUILD_LINE}) and source its install/setup.bash"
            )
        return False
    import embedded_ros

    try:
        embedded_ros.enable(interface_paths=[msg_defs_dir()])
    except (embedded_ros.MissingDependencyError, ValueError) as error:
        raise RuntimeMissing(str(error)) from error
    return True
