# SPDX-License-Identifier: Apache-2.0
"""Like fingers evaluated at once, beside the object.

What is said of each finger and the object in `assembly` is computed here for several fingers in
one go: a grasp has few numbers and many operations, whose overhead is then paid once for all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ccr_ros.model.equilibrium import EquilibriumProblem, Evaluation, less_bent
from ccr_ros.model.files import MountedFinger
from ccr_ros.model.kinematics import Kinematics, Linearization, Placed
from ccr_ros.model.rod import RodState
from ccr_ros.model.rotation import Pose, cross, skew
from ccr_ros.model.sqp import ACTIVE, BAND, KktPoint

from .body import Body
from .friction import Hold, Touching

_EYE = np.eye(3)


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
class Derived:
    """A finger beside the object, with all derivatives but those of friction.

    Attributes:
        near: The finger and the object, for friction.
        columns: (C + c, 6) of all rows with respect to q.
        border: (N, 6) of the Hessian, finger against q.
        corner: (6, 6) the finger's share of the Hessian of q.
    """

    near: Touching
    columns: np.ndarray
    border: np.ndarray
    corner: np.ndarray


@dataclass(frozen=True, eq=False)
class _Contacts:
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


@dataclass(frozen=True, eq=False)
class _Seen:
    """The object as the fingers see it: (F, 3, 3) orientations and (F, 3) centres [L]."""

    turns: np.ndarray
    centres: np.ndarray


class Stack:
    """Fingers of one likeness (`Kinematics.likeness`).

    Args:
        problems: Theirs.
        mounted: The fingers with their bases.
        frames: Per finger (6, 6), from a motion q to that in its base frame and units.
    """

    def __init__(
        self,
        problems: Sequence[EquilibriumProblem],
        mounted: Sequence[MountedFinger],
        frames: Sequence[np.ndarray],
    ) -> None:
        self._problems = list(problems)
        self._kinematics = Kinematics.stacked(self._problems)
        self._lengths = np.array([m.finger.length for m in mounted])
        self._bases = np.stack([m.base.rotation for m in mounted])
        self._origins = np.stack([m.base.position for m in mounted])
        self._frames = np.stack(frames)
        self._free_points = ~self._kinematics.fixed

    def derive(self, body: Body, pose: Pose, guesses: Sequence[Guess]) -> list[Derived]:
        """Return each finger with its derivatives; the body is at ``pose`` in the gripper."""
        kinematics = self._kinematics
        at = kinematics.place(np.stack([g.y for g in guesses]))
        first = kinematics.linearize(at)
        centres = (pose.position - self._origins)[:, None, :] @ self._bases
        seen = _Seen(
            self._bases.swapaxes(1, 2) @ pose.rotation, centres[:, 0] / self._lengths[:, None]
        )
        distances, contacts = self._meet(body, at, seen, guesses)
        holds = [g.hold or Hold.none(at.points.shape[1]) for g in guesses]
        rubs = self._rubs(body, seen, holds, guesses)
        pushes = rubs.copy() if rubs is not None else np.zeros_like(at.points)
        pressed = np.flatnonzero(contacts.forces > 0)
        np.add.at(
            pushes,
            (contacts.finger[pressed], contacts.where[pressed]),
            contacts.forces[pressed, None] * contacts.normals[pressed],
        )
        tensions = np.stack([g.tensions for g in guesses])
        hessians = kinematics.curvature(at, first, tensions, pushes)
        balance = at.y + (tensions[:, None, :] @ first.lengths)[:, 0]
        jacobians = first.points[contacts.finger, contacts.where]
        rows = -(contacts.normals[:, None, :] @ jacobians)[:, 0]
        bent = contacts.forces[:, None, None] * contacts.bends
        outer = _Outer(contacts, at, seen, rubs, self._frames, self._problems)
        found = []
        for f, (guess, hold) in enumerate(zip(guesses, holds, strict=True)):
            own = slice(contacts.bounds[f], contacts.bounds[f + 1])
            pushing = contacts.forces[own] > 0
            jacobian = jacobians[own][pushing]
            if len(jacobian):
                less_bent(hessians[f], jacobian, bent[own][pushing])
                balance[f] += contacts.forces[own] @ rows[own]
            lengths = len(guess.tensions)
            point = KktPoint(
                at=_one(at, f, distances[f]),
                first=_one_linear(first, f),
                tensions=guess.tensions,
                forces=guess.forces,
                pairs=np.stack([contacts.obstacle[own], contacts.where[own]], axis=1),
                normals=contacts.normals[own],
                curvatures=contacts.bends[own],
                rows=np.concatenate([first.lengths[f], rows[own]]),
                values=np.concatenate(
                    [at.lengths[f], -distances[f][contacts.obstacle[own], contacts.where[own]]]
                ),
                multipliers=np.concatenate([guess.tensions, contacts.forces[own]]),
                hessian=hessians[f],
                unbalanced=balance[f],
                residual=float(np.abs(balance[f]).max() / max(1.0, np.abs(guess.y).max())),
            )
            last = len(self._problems[f].finger.obstacles)
            touch = lengths + np.flatnonzero(contacts.obstacle[own] == last)
            columns = np.zeros((len(point.rows), 6))
            columns[touch] = outer.columns[own][touch - lengths]
            found.append(
                Derived(
                    Touching(point, touch, hold, seen.centres[f], seen.turns[f], self._frames[f]),
                    columns,
                    outer.border(f, first.points[f]),
                    outer.corners[f],
                )
            )
        return found

    # -- inside ----------------------------------------------------------------------------

    def _meet(
        self, body: Body, at: Placed, seen: _Seen, guesses: Sequence[Guess]
    ) -> tuple[list[np.ndarray], _Contacts]:
        """Distances (O, P) of each finger's points, and all that are near something."""
        count, points = at.points.shape[:2]
        units = self._lengths[:, None, None]
        local = (at.points - seen.centres[:, None]) * units @ seen.turns
        away = body.shape.signed_distance(local.reshape(-1, 3)).reshape(count, points)
        away /= self._lengths[:, None]
        forces = np.stack([g.forces[-1] for g in guesses])
        finger, where = np.nonzero(((away < BAND) | (forces > 0)) & self._free_points)
        normals, bends = np.empty((0, 3)), np.empty((0, 3, 3))
        if len(finger):
            turns = seen.turns[finger]
            normals, bends = body.shape.derivatives(local[finger, where])
            normals = (turns @ normals[:, :, None])[:, :, 0]
            bends = turns @ bends @ turns.swapaxes(1, 2) * units[finger]
        pressing = forces[finger, where]
        if not any(p.finger.obstacles for p in self._problems):
            bounds = np.searchsorted(finger, np.arange(count + 1))
            contacts = _Contacts(
                finger, np.zeros_like(finger), where, normals, bends, pressing, bounds
            )
            return [row[None] for row in away], contacts
        distances, parts = [], []
        for f, problem in enumerate(self._problems):
            table, pairs, own_normals, own_bends = self._own(f, problem, at.points[f], guesses[f])
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
        joined = [np.concatenate(columns) for columns in zip(*parts, strict=True)]
        bounds = np.searchsorted(joined[0], np.arange(count + 1))
        return distances, _Contacts(*joined, bounds)  # type: ignore

    def _own(
        self, f: int, problem: EquilibriumProblem, points: np.ndarray, guess: Guess
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """A finger and the obstacles that are its own: distances, pairs, normals, Hessians."""
        obstacles, length = problem.finger.obstacles, self._lengths[f]
        table = np.empty((len(obstacles), len(points)))
        for distances, obstacle in zip(table, obstacles, strict=True):
            distances[:] = obstacle.signed_distance(points * length) / length
        near = ((table < BAND) | (guess.forces[:-1] > 0)) & self._free_points
        pairs = np.argwhere(near)
        normals, bends = np.empty((len(pairs), 3)), np.empty((len(pairs), 3, 3))
        for i, obstacle in enumerate(obstacles):
            of = pairs[:, 0] == i
            if of.any():
                normals[of], bends[of] = obstacle.derivatives(points[pairs[of, 1]] * length)
        return table, pairs, normals, bends * length

    def _rubs(
        self, body: Body, seen: _Seen, holds: Sequence[Hold], guesses: Sequence[Guess]
    ) -> np.ndarray | None:
        """Friction forces (F, P, 3) on the fingers in their base frames, of points that press."""
        if body.friction <= 0:
            return None
        pressed = np.stack(
            [h.anchored & (g.forces[-1] > ACTIVE) for h, g in zip(holds, guesses, strict=True)]
        )
        if not pressed.any():
            return None
        pushes = np.stack([h.pushes for h in holds]) @ seen.turns.swapaxes(1, 2)
        return np.where(pressed[:, :, None], pushes, 0.0)


class _Outer:
    """The part of the derivatives in which the object moves; see `assembly`.

    ``rubs`` (F, P, 3) are the friction forces on the points.
    """

    def __init__(
        self,
        contacts: _Contacts,
        at: Placed,
        seen: _Seen,
        rubs: np.ndarray | None,
        frames: np.ndarray,
        problems: Sequence[EquilibriumProblem],
    ) -> None:
        last = np.array([len(p.finger.obstacles) for p in problems])
        finger = contacts.finger
        arms = at.points[finger, contacts.where] - seen.centres[finger]
        by_motion = np.concatenate([contacts.normals, cross(arms, contacts.normals)], axis=1)
        #: (k, 6) of the rows with respect to q, right for contacts with the object
        self.columns = (by_motion[:, None, :] @ frames[finger])[:, 0]

        pressed = np.flatnonzero((contacts.obstacle == last[finger]) & (contacts.forces > 0))
        finger, where, arms = finger[pressed], contacts.where[pressed], arms[pressed]
        force = contacts.forces[pressed, None]
        whole = force * contacts.normals[pressed]
        if rubs is not None:
            whole = whole + rubs[finger, where]
        motion = np.empty((len(arms), 3, 6))  # of u by q
        motion[:, :, :3], motion[:, :, 3:] = -_EYE, skew(arms)
        bent = (contacts.bends[pressed] * force[:, :, None]) @ motion
        turned = skew(whole)
        by_point = bent.copy()
        by_point[:, :, 3:] -= turned
        self._finger, self._where, self._by_point, self._frames = finger, where, by_point, frames
        corners = -motion.swapaxes(1, 2) @ bent
        corners[:, :3, 3:] -= turned
        corners[:, 3:, :3] -= turned.swapaxes(1, 2)
        outer = whole[:, :, None] * arms[:, None, :]
        trace = np.einsum("ki,ki->k", whole, arms)
        corners[:, 3:, 3:] -= 0.5 * (outer + outer.swapaxes(1, 2)) - trace[:, None, None] * _EYE
        #: (F, 6, 6) of the Hessian of q
        self.corners = np.zeros((len(problems), 6, 6))
        np.add.at(self.corners, finger, corners)
        self.corners = frames.swapaxes(1, 2) @ self.corners @ frames

    def border(self, f: int, points: np.ndarray) -> np.ndarray:
        """(N, 6) of a finger's Hessian, its coordinates against q; ``points`` (P, 3, N)."""
        own = self._finger == f
        flat = points[self._where[own]].reshape(-1, points.shape[2])
        return -(flat.T @ self._by_point[own].reshape(-1, 6)) @ self._frames[f]


def _one(at: Placed, f: int, distances: np.ndarray) -> Evaluation:
    rod = RodState(at.rod.rotations[f], at.rod.positions[f], at.rod.twists[f])
    return Evaluation(
        at.y[f], at.z[f], rod, at.points[f], at.spans[f], at.span_lengths[f], at.lengths[f],
        distances,
    )  # fmt: skip


def _one_linear(first: Linearization, f: int) -> Linearization:
    return Linearization(
        first.twists[f], first.points[f], first.spans[f], first.stretch[f], first.lengths[f]
    )
