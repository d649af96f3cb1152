# SPDX-License-Identifier: Apache-2.0
"""What the servo bridge says about itself on /diagnostics (levels as in REP-107)."""

from __future__ import annotations

import math

from diagnostic_msgs.msg import DiagnosticStatus

from ccr_ros.actuation.bridge import ServoBridge
from ccr_ros.actuation.states import BridgeState

from .diagnostics import make_status
from .servo_topics import ServoTopics


class ServoDiagnostics:
    """Turns the bridge's state into a status; remembers what was refused since the last one.

    Args:
        node_name: Full name of the node.
        rack: Name of the rack.
    """

    def __init__(self, node_name: str, rack: str) -> None:
        self._node_name = node_name
        self._rack = rack
        self._refused_before = 0

    def status(
        self, bridge: ServoBridge | None, topics: ServoTopics, failure: str
    ) -> DiagnosticStatus:
        """Return the whole status; None: not configured, because of a failure or by choice."""
        level, message = self._verdict(bridge, topics, failure)
        self._refused_before = topics.refused
        values: dict[str, object] = {
            "commands received": topics.received,
            "commands refused": topics.refused,
        }
        for axis in bridge.axes if bridge else ():
            name = axis.joint.name
            values |= {f"{name} pull [mm]": f"{1e3 * axis.pull:.3f}"}
            if math.isfinite(axis.tension):
                values |= {f"{name} tension [N]": f"{axis.tension:.3g}"}
            if math.isfinite(axis.temperature):
                values |= {f"{name} temperature [degC]": f"{axis.temperature:.3g}"}
        return make_status(f"{self._node_name}: servos", self._rack, level, message, values)

    def _verdict(
        self, bridge: ServoBridge | None, topics: ServoTopics, failure: str
    ) -> tuple[bytes, str]:
        if bridge is None:
            level = DiagnosticStatus.ERROR if failure else DiagnosticStatus.OK
            return level, failure or "not configured"
        if bridge.fault is not None:
            fault = bridge.fault
            where = f" of {fault.joint}" if fault.joint else ""
            return DiagnosticStatus.ERROR, f"{fault.code.name}{where}: {fault.reason}"
        doubts = [failure, bridge.reason] if bridge.state != BridgeState.CALIBRATING else []
        if topics.refused > self._refused_before:
            doubts.append(topics.refusal)
        uncalibrated = [axis.joint.name for axis in bridge.axes if not axis.calibrated]
        if uncalibrated:
            doubts.append(f"to be calibrated: {', '.join(uncalibrated)}")
        unfelt = [axis.joint.name for axis in bridge.axes if math.isnan(axis.tension)]
        if unfelt and bridge.leading:
            doubts.append(f"tension not known, so not limited: {', '.join(unfelt)}")
        doubts = [doubt for doubt in doubts if doubt]
        if doubts:
            return DiagnosticStatus.WARN, "; ".join(doubts)
        return DiagnosticStatus.OK, bridge.reason or bridge.state.name.lower()
