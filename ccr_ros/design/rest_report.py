# SPDX-License-Identifier: Apache-2.0
"""Rest shapes that were found, told to people, to programs and at the head of finger files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ccr_ros import __version__
from ccr_ros.model.finger import Finger

from .best_fit import BestFit
from .rest_shape import RestShape
from .target import DesiredShape
from .verify import PullPath


@dataclass(frozen=True, eq=False)
class Found:
    """A rest shape, where pulling it from rest leads, and how it was found if by a best fit."""

    shape: RestShape
    path: PullPath
    fit: BestFit | None = None

    @property
    def rank(self) -> tuple[bool, bool, bool, float]:
        """What a better one has less of: misses, jumps, instability; error if missed; tension."""
        path, tension = self.path, float(self.shape.tensions.max(initial=0.0))
        last = tension if path.reached else path.squared_error
        return not path.reached, bool(path.jumps), not self.shape.stable, last

    @property
    def verdict(self) -> str:
        """One line: whether the pulls lead from rest to the wanted shape."""
        path = self.path
        if not path.completed:
            return f"NOT REACHED: {path.message}"
        error = f"sum of squared disk errors {path.squared_error * 1e6:.2g} mm2"
        if not path.reached:
            rms = np.sqrt(path.squared_error / (len(path.last.backbone) - 1))
            error += f", RMS {rms * 1e3:.3g} mm"
        words = "reached" if path.reached else "NOT REACHED"
        notes = [f"{words} from rest in {path.wanted} steps of the pulls, {error}"]
        if path.jumps:
            notes.append(f"after snapping to another branch at {_percentages(path.jumps)}")
        if path.unstable:
            notes.append(f"over poses that are not stable, at {_percentages(path.unstable)}")
        return ", ".join(notes)


def comment(found: Found, source: str) -> str:
    """Return the head of a finger file: where the rest shape comes from and what it is for."""
    pulls = ", ".join(
        f"{name} {pull * 1e3:.4f} mm ({pull / rest:.4%})"
        for name, pull, rest in zip(
            found.shape.finger.cable_names,
            found.shape.pulls,
            found.shape.rest_lengths,
            strict=True,
        )
    )
    return (
        f"Rest shape by `ccr design rest-shape` (ccr_ros {__version__}) for {source}.\n"
        f"Pulls that bend it into that shape: {pulls}.\n"
        f"Forward model: {found.verdict}."
    )


def print_table(
    finger: Finger,
    wanted: DesiredShape,
    found: Sequence[Found],
    best: Found | None,
    refused: Sequence[str],
) -> None:
    """Print what was found, in mm and percent."""
    newton = finger.forces_are == "newton"
    unit = "N" if newton else "1/m2 (per EI)"
    print(f"{finger.name}: {finger.length * 1e3:g} mm, {finger.segments} segments\n")
    width = max(5, *(len(name) for name in finger.cable_names))
    for number, item in enumerate(found, 1):
        shape = item.shape
        mark = ", the best" if item is best and len(found) > 1 else ""
        print(f"  rest shape {number} of {len(found)}{mark}")
        for name, pull, rest, tension in zip(
            finger.cable_names, shape.pulls, shape.rest_lengths, shape.tensions, strict=True
        ):
            note = "  slack" if tension == 0 else ""
            print(
                f"    {name:<{width}}  pull {pull * 1e3:.3f} mm, {pull / rest:.2%} of rest;"
                f" tension {tension:.4g} {unit}{note}"
            )
        energy = f"{shape.energy * 1e3:.4g} mJ" if newton else f"{shape.energy:.4g} 1/m (per EI)"
        stable = "stable" if shape.stable else "NOT STABLE: a disturbance moves it"
        print(
            f"    energy {energy}; {stable} (smallest eigenvalue {shape.smallest_eigenvalue:.3g});"
            f" rest bends by {shape.largest_curvature:.3g} 1/m at most"
        )
        for contact in item.path.last.contacts:
            point = f"{contact.point}{f' of {contact.cable}' if contact.cable else ''}"
            print(
                f"    disk {contact.disk}, {point}, presses on {contact.obstacle}:"
                f" {contact.force:.4g} {unit}"
            )
        if shape.rest_gap < 0:
            print(f"    the rest shape stands {-shape.rest_gap * 1e3:.3g} mm inside an obstacle")
        if item.fit is not None:
            print(f"    {_fit_line(item.fit)}")
        print(f"    {item.verdict}\n")
    for line in refused:
        print(f"  no rest shape: {line}")
    if best is not None:
        _print_disks(wanted, best)


def _fit_line(fit: BestFit) -> str:
    end = "a least error" if fit.optimal else "ended before it was the least"
    line = (
        f"best fit: from {fit.first_error * 1e6:.2g} mm2 to {fit.shape.squared_error * 1e6:.2g}"
        f" mm2 in {fit.solves} forward solves, {end}"
    )
    return line + (f"; {fit.at_bound} ends of pieces bend as far as allowed" * bool(fit.at_bound))


def _print_disks(wanted: DesiredShape, best: Found) -> None:
    head = "".join(f"{f'{what} {c}':>11}" for what in ("rest", "pulled") for c in "xyz")
    print(f"  {'disk':>4}{head} mm{'error mm':>12}")
    errors = wanted.errors(best.path.last.backbone)
    rows = np.hstack([best.shape.rest, best.path.last.backbone]) * 1e3
    for i, (row, error) in enumerate(zip(rows, errors, strict=True)):
        print(f"  {i:>4}" + "".join(f"{v:>11.3f}" for v in row) + f"   {error * 1e3:>12.1e}")


def to_dict(
    finger: Finger,
    wanted: DesiredShape,
    found: Sequence[Found],
    best: Found | None,
    refused: Sequence[str],
) -> dict[str, Any]:
    """Return all of it as plain lists and numbers, ready for JSON; SI units."""
    return {
        "finger": finger.name,
        "forces_are": finger.forces_are,
        "reached": best is not None and best.path.reached,
        "best": None if best is None else list(found).index(best),
        "refused": list(refused),
        "wanted": wanted.points.tolist(),
        "shapes": [_entry(item) for item in found],
    }


def _entry(item: Found) -> dict[str, Any]:
    shape, path = item.shape, item.path
    names = shape.finger.cable_names

    def by_cable(values: np.ndarray) -> dict[str, float]:
        return dict(zip(names, values.tolist(), strict=True))

    return {
        "pulls": by_cable(shape.pulls),
        "rest_lengths": by_cable(shape.rest_lengths),
        "tensions": by_cable(shape.tensions),
        "energy": shape.energy,
        "stable": shape.stable,
        "smallest_eigenvalue": shape.smallest_eigenvalue,
        "largest_curvature": shape.largest_curvature,
        "rest_gap": shape.rest_gap if np.isfinite(shape.rest_gap) else None,
        "rest_curvature": np.asarray(shape.finger.rest_curvature).tolist(),
        "rest": shape.rest.tolist(),
        "backbone": path.last.backbone.tolist(),
        "contacts": path.last.to_dict()["contacts"],
        "fit": None
        if item.fit is None
        else {
            "first_error": item.fit.first_error,
            "solves": item.fit.solves,
            "optimal": item.fit.optimal,
            "at_bound": item.fit.at_bound,
        },
        "forward": {
            "reached": path.reached,
            "squared_error": path.squared_error,
            "tolerance": path.tolerance,
            "steps": path.wanted,
            "jumps": list(path.jumps),
            "unstable": list(path.unstable),
            "message": path.message,
        },
    }


def _percentages(fractions: Sequence[float]) -> str:
    return ", ".join(f"{f:.0%}" for f in fractions) + " of the pulls"
