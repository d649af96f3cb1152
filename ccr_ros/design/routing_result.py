# SPDX-License-Identifier: Apache-2.0
"""What a search for routings gives, each solved by the forward model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..model.finger import Cable, Finger
from ..model.solution import Solution
from ..model.solver import FingerSolver
from .pull import Pull
from .target import DesiredShape


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


def verified(
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


def _cable_names(finger: Finger, count: int) -> tuple[str, ...]:
    if len(finger.cables) == count:
        return finger.cable_names
    return ("main",) if count == 1 else ("first", "second")
