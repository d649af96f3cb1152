# SPDX-License-Identifier: Apache-2.0
"""Starts nodes in whichever way they can reach each other."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .environment import import_environment
from .parts import Starter
from .processes import Children, Show


@contextmanager
def starter_of_nodes(namespace: str, show: Show | None = None) -> Iterator[Starter]:
    """Give what starts nodes; those it has started end with the ``with`` block.

    They are processes, or threads of this one where nodes of other processes cannot be reached.
    `ccr_ros.runtime.enable_ros` must have been called.

    Args:
        namespace: Of the nodes; only in threads of use, whose log lines are shown from errors on.
        show: Told what processes write, line by line; see `processes.Child`.
    """
    import rclpy

    if rclpy.get_rmw_implementation_identifier() == "embedded_local":
        from .threads import Threads

        with Threads(namespace.strip("/").replace("/", ".")) as threads:
            yield threads
        return
    environ = {**os.environ, **import_environment(os.environ)}
    with (
        tempfile.TemporaryDirectory(prefix="ccr_nodes_") as logs,
        Children(Path(logs), environ, show) as children,
    ):
        yield children
