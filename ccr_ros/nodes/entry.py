# SPDX-License-Identifier: Apache-2.0
"""Console scripts of the nodes: make rclpy importable first, import and run the node only then."""

from __future__ import annotations

import sys


def solver_node() -> int:
    """Run the solver node; arguments are in ``sys.argv``. Returns the exit code."""
    try:  # all imports in it, as a Ctrl-C may come while the libraries load
        from ccr_ros.model.errors import CcrError
        from ccr_ros.runtime import enable_ros

        try:
            enable_ros()
            from ccr_ros.nodes.solver_node import main

            return main()
        except CcrError as error:
            print(f"solver_node: error: {error}", file=sys.stderr)
            return 1
    except KeyboardInterrupt:
        return 0
