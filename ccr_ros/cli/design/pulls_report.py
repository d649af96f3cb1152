# SPDX-License-Identifier: Apache-2.0
"""What `ccr design pulls` prints and writes: a table for people, JSON, and the pulls of a path."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from typing import Any

import numpy as np

from ccr_ros.design.pulls import PullSolution
from ccr_ros.design.pulls_targets import Target, TipTarget
from ccr_ros.model import InvalidFile


def as_json(found: PullSolution) -> dict[str, Any]:
    """Return an answer as plain lists and numbers, SI units."""
    solution = found.solution
    error = found.error
    values = {
        "position": error.position,
        "rotation": error.rotation,
        "force": error.force,
        "gap": error.gap,
    }
    return {
        "reached": found.reached,
        "nearest": found.optimal,
        "error": {key: value for key, value in values.items() if value is not None},
        "limits": list(found.limits),
        "direct": found.direct,
        "iterations": found.iterations,
        "seconds": found.seconds,
        "message": found.message,
        **solution.to_dict(),
    }


def print_answer(found: PullSolution, rest_lengths: np.ndarray) -> None:
    """Print an answer for people."""
    solution = found.solution
    finger = solution.finger
    unit = "N" if finger.forces_are == "newton" else "1/m2 (per EI)"
    print(f"{finger.name}: {finger.length * 1e3:g} mm, {finger.segments} segments\n")
    print(f"  {'cable':<12}{'pull':>10}{'of rest':>9}{'tension':>12} {unit}")
    rows = zip(finger.cable_names, found.pulls, rest_lengths, solution.tensions, strict=True)
    for name, pull, rest, tension in rows:
        note = "  slack" if tension == 0 else ""
        print(f"  {name:<12}{pull * 1e3:>7.3f} mm{pull / rest:>9.2%}{tension:>12.4g}{note}")
    x, y, z = solution.backbone[-1] * 1e3
    print(f"\n  tip at {x:.3f}, {y:.3f}, {z:.3f} mm")
    for contact in solution.contacts:
        print(f"  disk {contact.disk} on {contact.obstacle}: {contact.force:.4g} {unit}")
    state = "reached" if found.reached else "NOT REACHED"
    print(f"  {state}, error {found.error.text(unit)}")
    if found.limits:
        print(f"  held by: {', '.join(found.limits)}")
    if found.message:
        print(f"  {found.message}")
    certificate = solution.certificate
    print(
        f"  {'stable' if certificate.stable else 'NOT STABLE'}"
        f" (smallest eigenvalue {certificate.smallest_eigenvalue:.3g});"
        f" {found.iterations} steps, {found.seconds * 1e3:.1f} ms"
    )


def print_path(found: Sequence[PullSolution]) -> None:
    """Print how a path was tracked."""
    finger = found[0].solution.finger
    unit = "N" if finger.forces_are == "newton" else "1/m2 (per EI)"
    off = [k for k, f in enumerate(found) if not f.reached]
    errors = [f.error.position or 0.0 for f in found]
    worst = int(np.argmax(errors))
    pulls = np.array([f.pulls for f in found]) * 1e3
    tensions = np.array([f.solution.tensions for f in found])
    print(f"{finger.name}: {len(found)} points, {len(found) - len(off)} reached")
    print(f"  largest error {errors[worst] * 1e3:.3g} mm, at point {worst + 1}")
    for name, p, t in zip(finger.cable_names, pulls.T, tensions.T, strict=True):
        print(
            f"  {name}: pulls {p.min():.3f} to {p.max():.3f} mm,"
            f" tensions {t.min():.4g} to {t.max():.4g} {unit}"
        )
    if off:
        first = found[off[0]]
        shown = ", ".join(str(k + 1) for k in off[:8]) + (", ..." if len(off) > 8 else "")
        print(f"  NOT REACHED: points {shown}; point {off[0] + 1}: {first.message}")
    seconds = [f.seconds for f in found[1:]] or [found[0].seconds]
    print(f"  {1e3 * float(np.median(seconds)):.1f} ms a point (median)")


def write_path(path: str, targets: Sequence[Target], found: Sequence[PullSolution]) -> None:
    """Write targets, pulls [m], tensions and errors [m, rad] of a path as CSV.

    Raises:
        InvalidFile: The file cannot be written.
    """
    names = found[0].solution.finger.cable_names
    columns = ["x", "y", "z"]
    columns += [f"pull_{name}" for name in names] + [f"tension_{name}" for name in names]
    columns += ["position_error", "rotation_error", "reached"]
    try:
        with open(path, "w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(columns)
            for target, f in zip(targets, found, strict=True):
                assert isinstance(target, TipTarget) and target.position is not None
                numbers = [*target.position, *f.pulls, *f.solution.tensions]
                numbers += [f.error.position or 0.0, f.error.rotation or 0.0]
                writer.writerow([*(f"{v:.9g}" for v in numbers), int(f.reached)])
    except OSError as error:
        raise InvalidFile(path, f"cannot be written: {error.strerror or error}") from None
