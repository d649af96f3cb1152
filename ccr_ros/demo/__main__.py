# SPDX-License-Identifier: Apache-2.0
"""``python -m ccr_ros.demo`` runs the demo's ball; the demo starts it so, as its own process."""

import sys

from ccr_ros.model.errors import CcrError
from ccr_ros.runtime import enable_ros


def main() -> int:
    """Make rclpy importable, then run the node; return its exit code."""
    try:
        enable_ros()
        from ccr_ros.demo.ball import BallNode
        from ccr_ros.nodes.runner import run

        return run(BallNode, "demo_ball")
    except KeyboardInterrupt:
        return 0
    except CcrError as error:
        print(f"demo_ball: error: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
