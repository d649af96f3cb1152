# SPDX-License-Identifier: Apache-2.0
"""Inverse problem: the holes through which given pulls bend a finger into a wanted shape.

A discrete choice, solved as one (`routing_search`); or angles anywhere on the circle, by
Gauss-Newton from the best such choices (`routing_free`). What comes out is solved again by
`FingerSolver`, from rest, and its errors are of that solution.

The idea of shaping a finger by general routing is Mahapatra and Ghosal's (Advances in Mechanism
and Machine Science, 2023, pp. 130-138); the method here is this project's own.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..model import checks
from ..model.errors import InvalidValue
from ..model.finger import Finger
from .pull import Pull
from .routing_chain import Target
from .routing_free import Fit, fitted
from .routing_result import RoutingCandidate, RoutingDesign, verified
from .routing_search import GOOD, Found, RoutingSearch
from .segments import SegmentModel
from .target import DesiredShape

MAX_CABLES = 2
TOLERANCE = 1e-4  # m, of a disk
_WIDTH = 128
_MOST_HOLES = {1: 120, 2: 24}  # with which the search takes seconds, not minutes
_FREE_STARTS = 8
_FREE_NEAR = 2e-3  # RMS error of a disk, units of L, of a start that is tried first
_FREE_HOLES = 12  # among which the search for free angles begins
_FREE_EXACT = 1e-10  # m, RMS of a disk: no other start is tried
_CORRECTIONS = 8
_SAME_ANGLE = 1e-6  # rad
_LEAST_SPAN, _LARGEST_SPAN = 0.5, 1.1  # of a segment's length, between neighbouring centres


def design_routing(
    finger: Finger,
    shape: DesiredShape,
    pulls: Sequence[Pull],
    *,
    free: bool = False,
    largest_change: int | None = None,
    candidates: int = 5,
    tolerance: float = TOLERANCE,
) -> RoutingDesign:
    """Find the routings whose cables, pulled as given, bend a finger into a shape.

    Every cable runs from the base to the tip, and is taken to be taut.

    Args:
        finger: Its cables are not used, but for their names where there are as many.
        shape: The wanted one; frames, or tangents, are used where it has them.
        pulls: One for each cable wanted, one or two.
        free: Holes anywhere on the circle, not at `Finger.holes_per_disk` places of it.
        largest_change: Of a cable's hole from a disk to the next, in holes; ``None``: any. The
            less a cable winds, the less it rubs.
        candidates: How many routings to give at most.
        tolerance: Largest error of a disk [m] with which the shape counts as reached.

    Raises:
        InvalidValue: The shape does not fit the finger, the finger has obstacles, an option is out
            of range, or the pulls are so large that no routing found has an equilibrium.
    """
    checks.integer("candidates", candidates, low=1, high=20)
    checks.real("tolerance", tolerance, above=0, unit="m")
    if largest_change is not None:
        if free:
            raise InvalidValue("largest_change", largest_change, "left out where angles are free")
        checks.integer("largest_change", largest_change, low=0, high=finger.holes_per_disk)
    pulls = _checked_pulls(finger, pulls)
    _check_shape(finger, shape)
    if finger.obstacles:
        allowed = "none: a routing is designed for a finger in free space"
        raise InvalidValue("obstacles", [o.name for o in finger.obstacles], allowed)
    if not any(p.value for p in pulls):
        straight = ((1,) * (finger.segments + 1),) * len(pulls)
        rest = verified(finger, shape, pulls, np.zeros(np.shape(straight)), straight)
        note = "nothing is pulled: every routing leaves the finger in its rest shape"
        return RoutingDesign(shape, tuple(c for c in [rest] if c), tolerance, note)
    count = _FREE_HOLES if free else finger.holes_per_disk
    if count > _MOST_HOLES[len(pulls)]:
        allowed = f"1..{_MOST_HOLES[len(pulls)]} to choose among; or let the angles be free"
        raise InvalidValue("holes_per_disk", count, allowed)
    holes = 2 * math.pi * np.arange(count) / count
    target = _target(finger, shape, pulls)
    search = RoutingSearch(SegmentModel(finger), holes, target, _WIDTH, largest_change)
    task = _Task(finger, shape, pulls, search)
    made = _free(task, candidates) if free else _snapped(task, candidates)
    if not made:
        raise InvalidValue(
            "pulls",
            [p.value for p in pulls],
            "small enough for some routing to have an equilibrium without disks that meet",
        )
    made.sort(key=lambda c: c.cost)
    return RoutingDesign(shape, tuple(made), tolerance)


@dataclass(frozen=True, eq=False)
class _Task:
    finger: Finger
    shape: DesiredShape
    pulls: tuple[Pull, ...]
    search: RoutingSearch

    def verified(
        self, angles: np.ndarray, holes: tuple[tuple[int, ...], ...] | None
    ) -> RoutingCandidate | None:
        """Solve the finger with hole angles (C, n+1); see `routing_result.verified`."""
        return verified(self.finger, self.shape, self.pulls, angles, holes)


def _snapped(task: _Task, count: int) -> list[RoutingCandidate]:
    search = task.search
    made: list[RoutingCandidate] = []
    seen = set()
    for one in search.run():
        choices = search.choices[list(one.states)]  # (n+1, C)
        holes = tuple(tuple(int(h) + 1 for h in cable) for cable in choices.T)
        # Cables that are pulled alike may change places.
        key = tuple(sorted(holes)) if len(set(task.pulls)) == 1 else holes
        if key in seen or not math.isfinite(one.cost):
            continue
        seen.add(key)
        candidate = task.verified(search.holes[choices].T, holes)
        if candidate:
            made.append(candidate)
        if len(made) == count:
            break
    return made


def _free(task: _Task, count: int) -> list[RoutingCandidate]:
    fits: list[Fit] = []
    for good in (_FREE_NEAR, GOOD):  # a start need not be the nearest; else one that is
        task.search.good = good
        if _fit_from(task, task.search.run()[:_FREE_STARTS], fits):
            break
    fits.sort(key=lambda f: f.cost)
    made = [_corrected(task, fit) for fit in fits[:count]]
    return [c for c in made if c]


def _fit_from(task: _Task, starts: list[Found], fits: list[Fit]) -> bool:
    """Fit angles from starts, each answer once, until one is exact; tell whether one is."""
    search = task.search
    for one in starts:
        if not math.isfinite(one.cost):
            break
        start = search.holes[search.choices[list(one.states)]]
        fit = fitted(search.model, search.target, start, one.tensions)
        if fit is None:
            continue
        turned = np.exp(1j * fit.angles)
        if not any(np.abs(turned - np.exp(1j * f.angles)).max() < _SAME_ANGLE for f in fits):
            fits.append(fit)
        if math.sqrt(fit.cost / len(fit.points)) * task.finger.length < _FREE_EXACT:
            return True
    return False


def _corrected(task: _Task, fit: Fit) -> RoutingCandidate | None:
    """Return the forward model's pose for a fit, fitted anew for what the two differ by.

    They differ where the rest curvature is linear along several pieces of a segment, which
    `SegmentModel` has as one.
    """
    best = task.verified(np.mod(fit.angles.T, 2 * math.pi), None)
    target, length = task.search.target, task.finger.length
    for _ in range(_CORRECTIONS if task.finger.rest_pieces > 1 else 0):
        if best is None or best.rms_error < _FREE_EXACT:
            break
        pose = best.solution
        frames = target.frames
        if frames is not None:
            frames = fit.frames @ pose.frames.transpose(0, 2, 1) @ frames
        points = target.points + fit.points - pose.backbone / length
        nearer = replace(target, points=points, frames=frames)
        again = fitted(task.search.model, nearer, fit.angles, fit.tensions)
        found = again and task.verified(np.mod(again.angles.T, 2 * math.pi), None)
        if again is None or not found or found.cost >= best.cost:
            break
        fit, best = again, found
    return best


def _target(finger: Finger, shape: DesiredShape, pulls: Sequence[Pull]) -> Target:
    return Target(
        points=shape.points / finger.length,
        frames=shape.frames,
        tangents=shape.tangents,
        lever=1.0 / finger.segments,
        fractions=np.array([p.value if p.relative else 0.0 for p in pulls]),
        pulls=np.array([0.0 if p.relative else p.value / finger.length for p in pulls]),
    )


def _checked_pulls(finger: Finger, pulls: Sequence[Pull]) -> tuple[Pull, ...]:
    if not isinstance(pulls, list | tuple) or not 1 <= len(pulls) <= MAX_CABLES:
        raise InvalidValue("pulls", pulls, f"1 to {MAX_CABLES} pulls, one for each cable")
    checked = []
    for i, pull in enumerate(pulls):
        place = f"pulls[{i}]"
        if not isinstance(pull, Pull):
            raise InvalidValue(place, pull, "a Pull")
        below = 1.0 if pull.relative else finger.length
        unit = "" if pull.relative else "m"
        value = checks.real(place, pull.value, low=0.0, below=below, unit=unit)
        checked.append(Pull(value, pull.relative))
    values = [p.value for p in checked]
    if any(values) and not all(values):
        allowed = "more than 0 for every cable: one that is not pulled leaves its routing open"
        raise InvalidValue("pulls", values, allowed)
    return tuple(checked)


def _check_shape(finger: Finger, shape: DesiredShape) -> None:
    """As `DesiredShape.check_fits`, but measured centres may be somewhat too far apart."""
    if shape.segments != finger.segments:
        shape.check_fits(finger)
    spans = np.linalg.norm(np.diff(shape.points, axis=0), axis=1) / finger.segment_length
    low, high = _LEAST_SPAN, _LARGEST_SPAN
    bad = np.flatnonzero((spans < low) | (spans > high))
    if len(bad):
        i, l0 = int(bad[0]) + 1, finger.segment_length * 1e3
        raise InvalidValue(
            f"points[{i}]",
            shape.points[i],
            f"{low * l0:.3g} to {high * l0:.3g} mm from the point before, as a segment is {l0:.4g}"
            f" mm long (it is {spans[i - 1] * l0:.4g} mm away)",
        )
