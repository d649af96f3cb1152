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
from ..model.finger import Cable, Finger
from ..model.solution import Solution
from ..model.solver import FingerSolver
from .pull import Pull
from .routing_chain import Target
from .routing_free import Fit, fitted
from .routing_search import Found, RoutingSearch
from .segments import SegmentModel
from .target import DesiredShape

MAX_CABLES = 2
TOLERANCE = 1e-4  # m, of a disk
_WIDTH = {1: 128, 2: 64}
_FREE_STARTS = 8
_FREE_HOLES = 12  # at least, where the search for free angles begins
_FREE_EXACT = 1e-9  # m, RMS of a disk: no other start is tried
_SAME_ANGLE = 1e-6  # rad
_LEAST_SPAN, _LARGEST_SPAN = 0.5, 1.1  # of a segment's length, between neighbouring centres


@dataclass(frozen=True, eq=False)
class RoutingCandidate:
    """A routing and the pose it gives.

    Attributes:
        solution: Of `FingerSolver`, from rest; its finger has the routing.
        holes: One tuple per cable, a hole from 1 for each disk from the base; ``None`` for free
            angles.
        errors: (n+1,) distances of the disks from the wanted ones [m].
        turn: Largest angle of a disk's frame from the wanted one [rad]; ``None`` where the wanted
            frames are not known.
        cost: Sum of the squared errors [m^2]; of frames by the way of a segment's length.
    """

    solution: Solution
    holes: tuple[tuple[int, ...], ...] | None
    errors: np.ndarray
    turn: float | None
    cost: float

    @property
    def finger(self) -> Finger:
        """The finger with this routing."""
        return self.solution.finger

    @property
    def max_error(self) -> float:
        """Largest distance of a disk from the wanted one [m]."""
        return float(self.errors.max())

    @property
    def rms_error(self) -> float:
        """Root of the mean squared distance of the disks from the wanted ones [m]."""
        return float(np.sqrt(np.mean(self.errors**2)))


@dataclass(frozen=True, eq=False)
class RoutingDesign:
    """The best routings found, nearest to the wanted shape first.

    Attributes:
        shape: The wanted one.
        candidates: At least one; each converged.
        tolerance: Largest error of a disk [m] with which a shape counts as reached.
        note: What to know of the answer, in one line; may be empty.
    """

    shape: DesiredShape
    candidates: tuple[RoutingCandidate, ...]
    tolerance: float
    note: str = ""

    @property
    def best(self) -> RoutingCandidate:
        """The nearest."""
        return self.candidates[0]

    @property
    def reached(self) -> bool:
        """Whether the best routing brings every disk within the tolerance."""
        return self.best.max_error <= self.tolerance

    @property
    def alike(self) -> int:
        """Number of candidates whose disks all lie within the tolerance."""
        return sum(c.max_error <= self.tolerance for c in self.candidates)


def design_routing(
    finger: Finger,
    shape: DesiredShape,
    pulls: Sequence[Pull],
    *,
    free: bool = False,
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
        candidates: How many routings to give at most.
        tolerance: Largest error of a disk [m] with which the shape counts as reached.

    Raises:
        InvalidValue: The shape does not fit the finger, the finger has obstacles, a pull is out of
            range, or is so large that no routing found has an equilibrium.
    """
    checks.integer("candidates", candidates, low=1, high=20)
    checks.real("tolerance", tolerance, above=0, unit="m")
    pulls = _checked_pulls(finger, pulls)
    _check_shape(finger, shape)
    if finger.obstacles:
        allowed = "none: a routing is designed for a finger in free space"
        raise InvalidValue("obstacles", [o.name for o in finger.obstacles], allowed)
    target = _target(finger, shape, pulls)
    if not (target.fractions + target.pulls).any():
        straight = ((1,) * (finger.segments + 1),) * len(pulls)
        one = _verified(finger, shape, pulls, _hole_angles(finger, straight), straight)
        note = "nothing is pulled: every routing leaves the finger in its rest shape"
        return RoutingDesign(shape, tuple(c for c in [one] if c), tolerance, note)
    model = SegmentModel(finger)
    count = max(finger.holes_per_disk, _FREE_HOLES) if free else finger.holes_per_disk
    holes = 2 * math.pi * np.arange(count) / count
    search = RoutingSearch(model, holes, target, _WIDTH[len(pulls)])
    found = search.run()
    made = (
        _free(finger, shape, pulls, search, found, candidates)
        if free
        else _snapped(finger, shape, pulls, search, found, candidates)
    )
    if not made:
        raise InvalidValue(
            "pulls",
            [p.value for p in pulls],
            "small enough for some routing to have an equilibrium without disks that meet",
        )
    made.sort(key=lambda c: c.cost)
    return RoutingDesign(shape, tuple(made), tolerance)


def _snapped(
    finger: Finger,
    shape: DesiredShape,
    pulls: Sequence[Pull],
    search: RoutingSearch,
    found: list[Found],
    count: int,
) -> list[RoutingCandidate]:
    made: list[RoutingCandidate] = []
    seen = set()
    for one in found:
        choices = search.choices[list(one.states)]  # (n+1, C)
        holes = tuple(tuple(int(h) + 1 for h in cable) for cable in choices.T)
        # Cables that are pulled alike may change places.
        key = tuple(sorted(holes)) if len(set(pulls)) == 1 else holes
        if key in seen or not math.isfinite(one.cost):
            continue
        seen.add(key)
        candidate = _verified(finger, shape, pulls, _hole_angles(finger, holes), holes)
        if candidate:
            made.append(candidate)
        if len(made) == count:
            break
    return made


def _free(
    finger: Finger,
    shape: DesiredShape,
    pulls: Sequence[Pull],
    search: RoutingSearch,
    found: list[Found],
    count: int,
) -> list[RoutingCandidate]:
    fits: list[Fit] = []
    for one in found[:_FREE_STARTS]:
        start = search.holes[search.choices[list(one.states)]]
        fit = fitted(search.model, search.target, start, one.tensions)
        if fit is None:
            continue
        turned = np.exp(1j * fit.angles)
        if not any(np.abs(turned - np.exp(1j * f.angles)).max() < _SAME_ANGLE for f in fits):
            fits.append(fit)
        if math.sqrt(fit.cost / len(shape.points)) * finger.length < _FREE_EXACT:
            break
    fits.sort(key=lambda f: f.cost)
    made = [
        _verified(finger, shape, pulls, np.mod(fit.angles.T, 2 * math.pi), None)
        for fit in fits[:count]
    ]
    return [c for c in made if c]


def _verified(
    finger: Finger,
    shape: DesiredShape,
    pulls: Sequence[Pull],
    angles: np.ndarray,
    holes: tuple[tuple[int, ...], ...] | None,
) -> RoutingCandidate | None:
    """Solve the finger with hole angles (C, n+1), from rest; None if it has no equilibrium."""
    names = _cable_names(finger, len(pulls))
    cables = tuple(Cable(name, a) for name, a in zip(names, angles, strict=True))
    solver = FingerSolver(replace(finger, cables=cables))
    metres = [
        p.value * rest if p.relative else p.value
        for p, rest in zip(pulls, solver.rest_lengths, strict=True)
    ]
    if any(m >= rest for m, rest in zip(metres, solver.rest_lengths, strict=True)):
        return None
    solution = solver.solve(metres)
    if not solution.certificate.converged:
        return None
    errors = shape.errors(solution.backbone)
    cost, turn = float(errors @ errors), None
    if shape.frames is not None:
        cosine = (np.einsum("kij,kij->k", solution.frames, shape.frames) - 1.0) / 2.0
        turns = np.arccos(np.clip(cosine, -1.0, 1.0))
        turn = float(turns.max())
        cost += float(turns @ turns) * finger.segment_length**2
    return RoutingCandidate(solution, holes, errors, turn, cost)


def _hole_angles(finger: Finger, holes: Sequence[Sequence[int]]) -> np.ndarray:
    return 2 * math.pi * (np.array(holes) - 1) / finger.holes_per_disk


def _cable_names(finger: Finger, count: int) -> tuple[str, ...]:
    if len(finger.cables) == count:
        return finger.cable_names
    return ("main",) if count == 1 else ("first", "second")


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
