# SPDX-License-Identifier: Apache-2.0
"""What a gripper's design tells: a report for people, a mapping for programs, files' comments."""

from __future__ import annotations

from typing import Any

from .gripper import FingerDesign, GripperDesign


def kinds_of(design: GripperDesign) -> list[int]:
    """Return the number of each finger's kind, from 0: fingers of one design are of one kind."""
    order: list[int] = []
    for finger in design.fingers:
        if id(finger) not in order:
            order.append(id(finger))
    return [order.index(id(finger)) for finger in design.fingers]


def _unit(design: FingerDesign) -> str:
    return "N" if design.finger.forces_are == "newton" else "1/m2 (per EI)"


def _pull_text(design: FingerDesign) -> str:
    rest = design.rest
    return ", ".join(
        f"{name} {pull * 1e3:.3f} mm ({pull / length:.2%})"
        for name, pull, length in zip(
            design.finger.cable_names, rest.pulls, rest.rest_lengths, strict=True
        )
    )


def summary(design: FingerDesign) -> str:
    """Return in one line what a finger is made for."""
    disks = f"disks {design.first_on_contour} to {design.finger.segments}"
    return f"Pre-bent: pulled by {_pull_text(design)}, {disks} lie on the {design.curve.name}."


def report(design: GripperDesign) -> str:
    """Return the report for people, in millimetres."""
    layout = design.task.layout
    size = " x ".join(f"{1e3 * v:g}" for v in layout.body.size)
    lines = [
        f"{design.gripper.name}: {layout.fingers} fingers, {layout.body.kind} of {size} mm",
        "",
    ]
    kinds = kinds_of(design)
    for k in range(max(kinds) + 1):
        members = [f"finger_{i}" for i, kind in enumerate(kinds, 1) if kind == k]
        lines += [*_finger_lines(", ".join(members), design.fingers[kinds.index(k)]), ""]
    return "\n".join(lines)


def _finger_lines(names: str, design: FingerDesign) -> list[str]:
    solution, unit = design.solution, _unit(design)
    certificate = solution.certificate
    tensions = ", ".join(
        f"{name} {tension:.4g} {unit}"
        for name, tension in zip(design.finger.cable_names, solution.tensions, strict=True)
    )
    force = {c.disk: 0.0 for c in solution.contacts}
    for contact in solution.contacts:
        force[contact.disk] += contact.force
    lines = [
        f"  {names}: pull {_pull_text(design)}, tension {tensions}",
        f"    {'disk':>4}{'above middle':>15}{'off the object':>17}{'presses':>10} {unit}",
    ]
    for disk in range(design.first_on_contour, design.finger.segments + 1):
        gap, height = design.gaps[disk], design.heights[disk]
        lines.append(
            f"    {disk:>4}{height * 1e3:>12.1f} mm{abs(gap) * 1e3:>14.1e} mm"
            f"{force.get(disk, 0.0):>10.3g}"
        )
    stable = "stable" if certificate.stable else "NOT STABLE"
    lines += [
        f"    sum of squared disk errors {design.path.squared_error * 1e6:.1e} mm2; rest curvature"
        f" up to {design.rest.largest_curvature:.3g} 1/m",
        f"    {stable} (smallest eigenvalue {certificate.smallest_eigenvalue:.3g}); {_way(design)}",
    ]
    return lines


def _way(design: FingerDesign) -> str:
    path = design.path
    if not path.completed:
        return f"NOT REACHED: {path.message}"
    if not path.reached:
        return "NOT REACHED: pulling from rest leads to another shape"
    if path.jumps:
        return f"reached with a JUMP at {path.jumps[0]:.0%} of the pull"
    if path.unstable:
        return f"reached, but not stable from {path.unstable[0]:.0%} of the pull on"
    return "pulling from rest leads there without a jump"


def to_dict(design: GripperDesign) -> dict[str, Any]:
    """Return plain lists and numbers in SI units, ready for JSON."""
    return {
        "gripper": design.gripper.name,
        "reached": design.reached,
        "fingers": [
            {
                "name": mounted.finger.name,
                "first_on_contour": d.first_on_contour,
                "touching": list(d.touching),
                "gaps": d.gaps.tolist(),
                "heights": d.heights.tolist(),
                "squared_error": d.path.squared_error,
                "way": _way(d),
                "pose": d.solution.to_dict(),
            }
            for mounted, d in zip(design.gripper.fingers, design.fingers, strict=True)
        ],
    }
