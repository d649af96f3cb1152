# SPDX-License-Identifier: Apache-2.0
"""What the solver node says about itself on /diagnostics (levels as in REP-107)."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from .finger_channel import FingerChannel


class FingerDiagnostics:
    """Turns the counts of a finger into a status; remembers what was dropped since the last one."""

    def __init__(self, channel: FingerChannel) -> None:
        self._channel = channel
        self._dropped_before = 0

    def begin_period(self) -> None:
        """Count a backlog anew: what was dropped before now has been reported."""
        self._dropped_before = self._channel.dropped

    def verdict(self) -> tuple[bytes, str]:
        """Return level and message: ERROR without a pose for the newest pulls, WARN if doubtful."""
        channel = self._channel
        if channel.fault:
            return DiagnosticStatus.ERROR, channel.fault
        if channel.solution is None:
            return DiagnosticStatus.OK, "starting"
        doubts = [channel.solution.certificate.message]
        dropped = channel.dropped - self._dropped_before
        if dropped:
            doubts.append(f"pulls come too fast: {dropped} dropped lately")
        doubts = [doubt for doubt in doubts if doubt]
        certificate = channel.solution.certificate
        if doubts or certificate.branch_jump or not certificate.stable:
            return DiagnosticStatus.WARN, "; ".join(doubts)
        if not channel.received:
            return DiagnosticStatus.OK, "at rest, no pulls received yet"
        return DiagnosticStatus.OK, "solved"

    def status(self, node_name: str, gripper: str) -> DiagnosticStatus:
        """Return the whole status."""
        channel = self._channel
        level, message = self.verdict()
        values: dict[str, object] = {
            "pulls received": channel.received,
            "pulls refused": channel.refused,
            "pulls dropped": channel.dropped,
            "solves": channel.solves,
            "solves not converged": channel.failures,
        }
        values |= time_values(channel.solve_times)
        if channel.solution is not None:
            certificate = channel.solution.certificate
            values |= {
                "contacts": len(channel.solution.contacts),
                "stable": certificate.stable,
                "smallest eigenvalue": f"{certificate.smallest_eigenvalue:.3g}",
                "iterations": certificate.iterations,
                "KKT residual": f"{certificate.kkt:.2g}",
            }
        return make_status(f"{node_name}: {channel.finger.name}", gripper, level, message, values)


def time_values(seconds: Collection[float]) -> dict[str, object]:
    """Return the key-values of solve times [s]; none of none."""
    if not seconds:
        return {}
    p50, p99 = np.percentile(list(seconds), (50, 99)) * 1e3
    return {"solve time p50 [ms]": f"{p50:.3f}", "solve time p99 [ms]": f"{p99:.3f}"}


def make_status(
    name: str, hardware: str, level: bytes, message: str, values: dict[str, object]
) -> DiagnosticStatus:
    """Return a status with its key-values as text."""
    return DiagnosticStatus(
        level=level,
        name=name,
        message=message,
        hardware_id=hardware,
        values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
    )
