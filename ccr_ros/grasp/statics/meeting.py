# SPDX-License-Identifier: Apache-2.0
"""Which points of like fingers are near the object or other obstacles, and how these lie there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ccr_ros.model.equilibrium import EquilibriumProblem
from ccr_ros.model.kinematics import Placed
from ccr_ros.model.sqp import BAND

from .body import Body
from .friction import Hold


@dataclass(frozen=True, eq=False)
class Guess:
    """What is tried for a finger, in its own units.

    Attributes:
        y: (N,) coordinates.
        tensions: (C,) multipliers of its cable lengths.
        forces: (O, P) multipliers of its contacts; the last row is the object's.
        hold: What friction remembers of it, with its forces; None: nothing.
    """

    y: np.ndarray
    tensions: np.ndarray
    forces: np.ndarray
    hold: Hold | None = None


@dataclass(frozen=True, eq=False)
class Contacts:
    """Points near an obstacle, all fingers' in one list, sorted by finger and obstacle.

    Attributes:
        finger, obstacle, where: (k,) indices; ``where`` is that of the point.
        normals: (k, 3) in base frames; bends: (k, 3, 3) Hessians of the distances [1/L].
        forces: (k,) multipliers.
        bounds: (F + 1,) where each finger's begin and end.
    """

    finger: np.ndarray
    obstacle: np.ndarray
    where: np.ndarray
    normals: np.ndarray
    bends: np.ndarray
    forces: np.ndarray
    bounds: np.ndarray

    def of(self, f: int) -> Contacts:
        """Those of one finger."""
        own = slice(self.bounds[f], self.bounds[f + 1])
        return Contacts(
            self.finger[own], self.obstacle[own], self.where[own], self.normals[own],
            self.bends[own], self.forces[own], self.bounds,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Seen:
    """The object as the fingers see it: (F, 3, 3) orientations and (F, 3) centres [L]."""

    turns: np.ndarray
    centres: np.ndarray


def meet(
    problems: Sequence[EquilibriumProblem],
    body: Body,
    at: Placed,
    seen: Seen,
    guesses: Sequence[Guess],
) -> tuple[list[np.ndarray], Contacts]:
    """Return the distances (O, P) of each finger's points, and all that are near something.

    Args:
        problems: Of the like fingers.
        body: The object.
        at: The fingers.
        seen: Where the object is.
        guesses: One per finger; points that press count as near.
    """
    count, points = at.points.shape[:2]
    lengths = np.array([p.finger.length for p in problems])
    units = lengths[:, None, None]
    local = (at.points - seen.centres[:, None]) * units @ seen.turns
    away = body.shape.signed_distance(local.reshape(-1, 3)).reshape(count, points)
    away /= lengths[:, None]
    forces = np.stack([g.forces[-1] for g in guesses])
    finger, where = np.nonzero(((away < BAND) | (forces > 0)) & ~problems[0].fixed)
    normals, bends = np.empty((0, 3)), np.empty((0, 3, 3))
    if len(finger):
        turns = seen.turns[finger]
        normals, bends = body.shape.derivatives(local[finger, where])
        normals = (turns @ normals[:, :, None])[:, :, 0]
        bends = turns @ bends @ turns.swapaxes(1, 2) * units[finger]
    pressing = forces[finger, where]
    if not any(p.finger.obstacles for p in problems):
        bounds = np.searchsorted(finger, np.arange(count + 1))
        contacts = Contacts(finger, np.zeros_like(finger), where, normals, bends, pressing, bounds)
        return [row[None] for row in away], contacts
    distances, parts = [], []
    for f, problem in enumerate(problems):
        table, pairs, own_normals, own_bends = _own(problem, at.points[f], guesses[f])
        of = finger == f
        last = np.full(int(of.sum()), len(table))
        parts.append(
            (
                np.full(len(pairs) + len(last), f),
                np.concatenate([pairs[:, 0], last]),
                np.concatenate([pairs[:, 1], where[of]]),
                np.concatenate([own_normals, normals[of]]),
                np.concatenate([own_bends, bends[of]]),
                np.concatenate([guesses[f].forces[pairs[:, 0], pairs[:, 1]], pressing[of]]),
            )
        )
        distances.append(np.concatenate([table, away[f][None]]))
    finger, obstacle, where, normals, bends, pressing = (
        np.concatenate(columns) for columns in zip(*parts, strict=True)
    )
    bounds = np.searchsorted(finger, np.arange(count + 1))
    return distances, Contacts(finger, obstacle, where, normals, bends, pressing, bounds)


def _own(
    problem: EquilibriumProblem, points: np.ndarray, guess: Guess
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """A finger and the obstacles that are its own: distances, pairs, normals, Hessians."""
    obstacles, length = problem.finger.obstacles, problem.finger.length
    table = np.empty((len(obstacles), len(points)))
    for distances, obstacle in zip(table, obstacles, strict=True):
        distances[:] = obstacle.signed_distance(points * length) / length
    near = ((table < BAND) | (guess.forces[:-1] > 0)) & ~problem.fixed
    pairs = np.argwhere(near)
    normals, bends = np.empty((len(pairs), 3)), np.empty((len(pairs), 3, 3))
    for i, obstacle in enumerate(obstacles):
        of = pairs[:, 0] == i
        if of.any():
            normals[of], bends[of] = obstacle.derivatives(points[pairs[of, 1]] * length)
    return table, pairs, normals, bends * length
