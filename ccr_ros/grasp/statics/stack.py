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
from ccr_ros.model.sqp import ACTIVE, KktPoint

from .body import Body
from .friction import Hold, Touching
from .meeting import Contacts, Guess, Seen, meet

_EYE = np.eye(3)


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

    def derive(self, body: Body, pose: Pose, guesses: Sequence[Guess]) -> list[Derived]:
        """Return each finger with its derivatives; the body is at ``pose`` in the gripper."""
        kinematics = self._kinematics
        at = kinematics.place(np.stack([g.y for g in guesses]))
        first = kinematics.linearize(at)
        centres = (pose.position - self._origins)[:, None, :] @ self._bases
        seen = Seen(
            self._bases.swapaxes(1, 2) @ pose.rotation, centres[:, 0] / self._lengths[:, None]
        )
        distances, contacts = meet(self._problems, body, at, seen, guesses)
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
            if pushing.any():
                less_bent(hessians[f], jacobians[own][pushing], bent[own][pushing])
                balance[f] += contacts.forces[own] @ rows[own]
            point = _point(
                guess,
                _one(at, f, distances[f]),
                _one_linear(first, f),
                contacts.of(f),
                rows[own],
                hessians[f],
                balance[f],
            )
            lengths, last = len(guess.tensions), len(self._problems[f].finger.obstacles)
            touch = lengths + np.flatnonzero(contacts.obstacle[own] == last)
            columns = np.zeros((len(point.rows), 6))
            columns[touch] = outer.columns[own][touch - lengths]
            near = Touching(point, touch, hold, seen.centres[f], seen.turns[f], self._frames[f])
            border = outer.border(f, first.points[f])
            found.append(Derived(near, columns, border, outer.corners[f]))
        return found

    # -- inside ----------------------------------------------------------------------------

    def _rubs(
        self, body: Body, seen: Seen, holds: Sequence[Hold], guesses: Sequence[Guess]
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
        contacts: Contacts,
        at: Placed,
        seen: Seen,
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


def _point(
    guess: Guess,
    at: Evaluation,
    first: Linearization,
    contacts: Contacts,
    rows: np.ndarray,
    hessian: np.ndarray,
    balance: np.ndarray,
) -> KktPoint:
    """One finger, with its contacts and their rows (c, N)."""
    pairs = contacts.obstacle, contacts.where
    return KktPoint(
        at=at,
        first=first,
        tensions=guess.tensions,
        forces=guess.forces,
        pairs=np.stack(pairs, axis=1),
        normals=contacts.normals,
        curvatures=contacts.bends,
        rows=np.concatenate([first.lengths, rows]),
        values=np.concatenate([at.lengths, -at.distances[pairs]]),
        multipliers=np.concatenate([guess.tensions, contacts.forces]),
        hessian=hessian,
        unbalanced=balance,
        residual=float(np.abs(balance).max() / max(1.0, np.abs(guess.y).max())),
    )


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
