# SPDX-License-Identifier: Apache-2.0
"""``python -m ccr_ros.demo`` runs the pull publisher; the demo starts it so, as its own process."""

import sys

from ccr_ros.model.errors import CcrError
from ccr_ros.runtime import enable_ros


def main() -> int:
    """Make rclpy importable, then run the node; return its exit code."""
    try:
        enable_ros()
        from ccr_ros.demo.pull_publisher import main as run

        return run()
    except KeyboardInterrupt:
        return 0
    except CcrError as error:
        print(f"pull_publisher: error: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
