# SPDX-License-Identifier: Apache-2.0
"""The quality of service that the nodes' topics share; docs/interfaces.md lists who uses which."""

from rclpy.qos import QoSDurabilityPolicy, QoSHistoryPolicy, QoSProfile, QoSReliabilityPolicy


def reliable(depth: int, latched: bool = False) -> QoSProfile:
    """Return a keep-last profile; latched: who joins late gets the last message."""
    return QoSProfile(
        history=QoSHistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=QoSReliabilityPolicy.RELIABLE,
        durability=(
            QoSDurabilityPolicy.TRANSIENT_LOCAL if latched else QoSDurabilityPolicy.VOLATILE
        ),
    )


# What a publisher of pulls or objects uses: only the newest counts.
COMMAND = reliable(depth=1)

# The solver's own side of its pulls is deeper: it takes what waits there at once, solves the
# newest, and can then tell how many it dropped. DDS would drop them without a word.
COMMAND_QUEUE = reliable(depth=256)

LATCHED = reliable(depth=1, latched=True)

DIAGNOSTICS = reliable(depth=10)

# joint_states: reliable, so that listeners of either kind hear it.
JOINT_STATES = reliable(depth=10)
