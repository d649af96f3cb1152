# SPDX-License-Identifier: Apache-2.0
"""Console scripts of the nodes: make rclpy importable first, import and run the node only then."""

from __future__ import annotations

import sys

from ccr_ros.model.errors import CcrError
from ccr_ros.runtime import enable_ros


def solver_node() -> int:
    """Run the solver node; arguments are in ``sys.argv``. Returns the exit code."""
    try:
        enable_ros()
        from ccr_ros.nodes.solver_node import main

        return main()
    except KeyboardInterrupt:  # Ctrl-C while the libraries load
        return 0
    except CcrError as error:
        print(f"solver_node: error: {error}", file=sys.stderr)
        return 1
