# SPDX-License-Identifier: Apache-2.0
"""What `ccr grasp` found, for people and for programs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ccr_ros.grasp.clearance import DiskClearance
from ccr_ros.grasp.quality import Compliance, GraspQuality, SlipLoads
from ccr_ros.grasp.statics import GraspSolution


@dataclass(frozen=True, eq=False)
class Findings:
    """A grasp and its measures.

    Attributes:
        gripper: Its name.
        solution: After the object was let go, or where that failed.
        held: The fingers alone hold the object, stable, and do not pass through each other.
        clearance: How near the fingers' disks come to each other.
        through: They meet, and the equilibrium does not know.
        quality, compliance, loads: None where they were not asked for, or cannot be.
    """

    gripper: str
    solution: GraspSolution
    held: bool
    clearance: DiskClearance
    through: bool
    quality: GraspQuality | None
    compliance: Compliance | None
    loads: SlipLoads | None


def report(found: Findings) -> str:
    """Return the findings as lines for people."""
    solution, body = found.solution, found.solution.body
    unit = "N" if solution.fingers[0].finger.forces_are == "newton" else "1/m2 (per EI)"
    x, y, z = _millimetres(body.pose.position)
    turned = math.degrees(2 * math.acos(min(1.0, abs(float(body.pose.orientation[3])))))
    lines = [
        f"{found.gripper}: {len(solution.fingers)} fingers; {body.name}, {body.mass * 1e3:g} g,"
        f" friction {body.friction:g}",
        "",
        f"  object at {x:.3f} {y:.3f} {z:.3f} mm, turned by {turned:.2f} deg",
        "",
        f"  {'finger':<12}{'disk':>4}  {'point':<10}{'x':>9}{'y':>9}{'z':>9} mm"
        f"{'normal':>10}{'friction':>10} {unit}{'margin':>8}",
    ]
    for c in solution.contacts:
        x, y, z = _millimetres(c.position)
        margin = "" if math.isnan(c.margin) else f"{c.margin:.3f}"
        lines.append(
            f"  {c.finger:<12}{c.disk:>4}  {c.point:<10}{x:>9.2f}{y:>9.2f}{z:>9.2f}   "
            f"{c.force:>10.4g}{float(np.linalg.norm(c.friction_force)):>10.3g} "
            f"{' ' * len(unit)}{margin:>8}  {c.status}"
        )
    if not solution.contacts:
        lines.append("  nothing touches the object")
    for d in solution.disk_contacts:
        x, y, z = _millimetres(d.position)
        lines.append(f"  {d.in_words()} at {x:.2f} {y:.2f} {z:.2f} mm with {d.force:.4g} {unit}")
    lines += ["", *_measures(found, unit)]
    state = "held" if found.held else "NOT HELD"
    lines.append(
        f"  {state} (smallest eigenvalue {solution.smallest_eigenvalue:.3g};"
        f" force residual {solution.residual:.1e})"
    )
    if solution.message:
        lines.append(f"  {solution.message}")
    if found.through:
        near = found.clearance.in_words()
        lines.append(f"  {near}, of which this equilibrium knows nothing; with --disks it does")
    return "\n".join(lines)


def _measures(found: Findings, unit: str) -> list[str]:
    lines = []
    if found.quality is not None:
        q = found.quality
        if q.force_closure:
            closed = f"epsilon {q.epsilon:.3g}..{q.epsilon_upper:.3g}, weakest against"
        else:
            closed = "no force closure: nothing balances"
        margin = "none" if math.isnan(q.margin) else f"{round(q.margin, 3) + 0.0:.3f}"  # no -0.000
        lines += [
            f"  friction margin {margin}",
            f"  {closed} {q.weakest_in_words}",
            f"  normal forces no larger than now could carry {q.payload:.4g} {unit}, spread best",
        ]
    if found.compliance is not None:
        c = found.compliance
        stiffness = f"{c.stiffness:.3g} {unit}/m" if c.stiffness else "not resisted at all"
        lines.append(f"  softest against {c.softest_in_words}: {stiffness}")
    if found.loads is not None:
        s = found.loads
        if math.isinf(s.slips_at):
            first = f"nothing slips up to {s.held:.4g} {unit}"
        else:
            first = f"at {s.slips_at:.4g} {unit} {s.first or 'all'} slip"
        if math.isinf(s.lost_at):
            last = f"held up to {s.held:.4g} {unit}"
        else:
            last = f"lost between {s.held:.4g} and {s.lost_at:.4g} {unit}"
        if s.slipping:
            lines.append(f"  slipping already: {', '.join(s.slipping)}")
        lines += [f"  more weight, now {s.present:.4g} {unit}: {last}", f"    {first}"]
    return [*lines, ""] if lines else []


def to_dict(found: Findings) -> dict[str, Any]:
    """Return the findings as what JSON can hold; null where a number is not known or infinite."""
    solution, body = found.solution, found.solution.body
    result: dict[str, Any] = {
        "gripper": found.gripper,
        "held": found.held,
        "converged": solution.converged,
        "stable": solution.stable,
        "supported": solution.supported,
        "message": solution.message,
        "forces_are": solution.fingers[0].finger.forces_are,
        "pulls": {
            f.finger.name: dict(zip(f.finger.cable_names, f.pulls.tolist(), strict=True))
            for f in solution.fingers
        },
        "object": {
            "name": body.name,
            "mass": body.mass,
            "friction": body.friction,
            "position": body.pose.position.tolist(),
            "orientation": body.pose.orientation.tolist(),
        },
        "contacts": [
            {
                "finger": c.finger,
                "disk": c.disk,
                "point": c.point,
                "cable": c.cable,
                "position": c.position.tolist(),
                "normal": c.normal.tolist(),
                "force": c.force,
                "friction_force": c.friction_force.tolist(),
                "status": c.status,
                "margin": _number(c.margin),
            }
            for c in solution.contacts
        ],
        "disk_contacts": [
            {
                "fingers": list(d.fingers),
                "disks": list(d.disks),
                "position": d.position.tolist(),
                "normal": d.normal.tolist(),
                "force": d.force,
            }
            for d in solution.disk_contacts
        ],
    }
    near = found.clearance
    result["clearance"] = {"gap": near.gap, "fingers": near.fingers, "disks": near.disks}
    if found.quality is not None:
        q = found.quality
        result["quality"] = {
            "margin": _number(q.margin),
            "force_closure": q.force_closure,
            "epsilon": [q.epsilon, q.epsilon_upper],
            "weakest": q.weakest.tolist(),
            "weakest_in_words": q.weakest_in_words,
            "length": q.length,
            "payload": _number(q.payload),
        }
    if found.compliance is not None:
        result["softest"] = found.compliance.softest.tolist()
        result["softest_in_words"] = found.compliance.softest_in_words
        result["stiffness"] = found.compliance.stiffness
    if found.loads is not None:
        s = found.loads
        result["loads"] = {
            "direction": s.direction.tolist(),
            "present": s.present,
            "slipping": list(s.slipping),
            "slips_at": _number(s.slips_at),
            "first": s.first,
            "held": s.held,
            "lost_at": _number(s.lost_at),
        }
    return result


def _millimetres(position: np.ndarray) -> np.ndarray:
    return (position * 1e3).round(3) + 0.0  # no -0.000


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
