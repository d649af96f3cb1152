# SPDX-License-Identifier: Apache-2.0
"""``python -m ccr_ros.demo ball`` or ``cube``: what the demo has in place of a real object.

The demo starts it so, as its own process.
"""

import sys

from ccr_ros.model.errors import CcrError
from ccr_ros.runtime import enable_ros


def main() -> int:
    """Make rclpy importable, then run the node; return its exit code."""
    name = "demo_cube" if sys.argv[1:2] == ["cube"] else "demo_ball"
    try:
        enable_ros()
        from ccr_ros.nodes.runner import run

        if name == "demo_cube":
            from ccr_ros.demo.cube import CubeNode

            return run(CubeNode, name)
        from ccr_ros.demo.ball import BallNode

        return run(BallNode, name)
    except KeyboardInterrupt:
        return 0
    except CcrError as error:
        print(f"{name}: error: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
