# SPDX-License-Identifier: Apache-2.0
"""The seam between rclpy and the middleware.

Everything above talks to the classes of :mod:`.base`; :func:`open_participant` is the one place
that names a middleware.
"""

from __future__ import annotations

from .base import INFINITE, Endpoint, Participant, Qos, Reader, Sample, StatusChange, Waiter, Writer

__all__ = [
    "INFINITE",
    "Endpoint",
    "Participant",
    "Qos",
    "Reader",
    "Sample",
    "StatusChange",
    "Waiter",
    "Writer",
    "open_participant",
]


def open_participant(domain_id: int) -> Participant:
    """Join a DDS domain."""
    from .cyclone import CycloneParticipant

    return CycloneParticipant(domain_id)
