# SPDX-License-Identifier: Apache-2.0
"""What the solver node says on /diagnostics about the object in hand."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticStatus

from .diagnostics import make_status, time_values
from .grasp_channel import GraspChannel


def grasp_verdict(channel: GraspChannel) -> tuple[bytes, str]:
    """Return level and message: ERROR where the newest has no solution, WARN if doubtful."""
    live = channel.live
    if live is None:
        return DiagnosticStatus.OK, "no object"
    if live.failure:
        # What the fingers have let go of is no fault of theirs.
        return DiagnosticStatus.WARN if live.lost else DiagnosticStatus.ERROR, live.failure
    doubts = live.refusal or channel.doubt
    if doubts:
        return DiagnosticStatus.WARN, doubts
    return DiagnosticStatus.OK, "held" if live.held else "stands"


def grasp_status(channel: GraspChannel, node_name: str, gripper: str) -> DiagnosticStatus:
    """Return the whole status."""
    level, message = grasp_verdict(channel)
    values: dict[str, object] = {
        "solves": channel.solves,
        "solves not converged": channel.failures,
        **time_values(channel.solve_times),
    }
    live = channel.live
    if live is not None:
        values |= {"object": live.body.name, "mass [kg]": f"{live.body.mass:g}"}
        if live.solution is not None:
            values |= {
                "contacts": len(live.solution.contacts),
                "iterations": live.solution.iterations,
            }
    return make_status(f"{node_name}: grasp", gripper, level, message, values)
