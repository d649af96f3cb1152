# SPDX-License-Identifier: Apache-2.0
"""One problem of several fingers and the object between them.

In units of the fingers' mean length L and mean EI / L, with y_f the fingers' coordinates
(`ccr_ros.model.equilibrium`) and q = (translation, rotation vector) a small motion of the object
from where it is:

    min   sum_f w_f 1/2 y_f.y_f - W.q      w_f = (EI / L)_f / (EI / L),  W: weight and other loads
    s.t.  cable lengths of each finger <= their bounds                             (tensions)
          -distance(points of finger f, object moved by q) <= 0                    (contact forces)

With r the way from the object's centre to a point, n the outward normal and H the distance's
Hessian there, a motion v of the point against the centre and a turn w of the object change the
distance to second order by

    n.(v - w x r) - n.(w x v) + 1/2 n.(w x (w x r)) + 1/2 u'H u,      u = v - w x r

which gives rows and Hessian blocks below: each contact joins one finger and the object, so the
matrix is block diagonal but for the object's border. Friction adds forces on the same points along
the surface (`friction`), to which the same formulas apply with H = 0.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ccr_ros.model.equilibrium import EquilibriumProblem
from ccr_ros.model.files import MountedFinger
from ccr_ros.model.rotation import Pose
from ccr_ros.model.settings import SolverSettings
from ccr_ros.model.sqp import KktPoint

from .body import Body
from .friction import FrictionRows, Hold, Touching, friction_rows
from .meeting import Guess
from .stack import Derived, Stack

if TYPE_CHECKING:
    from .disks import NearDisks


class Hand:
    """The fingers of a gripper as equilibrium problems, built once.

    Attributes:
        mounted: The fingers with their bases.
        problems: One per finger.
        weights: (F,) EI / L of each finger relative to their mean.
        energy: Mean EI / L of the fingers [J]; length: their mean length [m]: the units.
        alike: Indices of fingers that are evaluated at once; stacks: what does it.
    """

    def __init__(
        self, fingers: Sequence[MountedFinger], settings: SolverSettings | None = None
    ) -> None:
        self.mounted = tuple(fingers)
        self.problems = [EquilibriumProblem(m.finger, settings) for m in fingers]
        lengths = np.array([m.finger.length for m in fingers])
        energies = np.array([m.finger.bending_stiffness for m in fingers]) / lengths
        # Of all fingers alike: in whose units a support fades decides where the object comes to
        # rest, which must not hang on which finger is named first.
        self.length = float(lengths.mean())
        self.energy = float(energies.mean())
        self.weights = np.array(
            [m.finger.bending_stiffness / m.finger.length / self.energy for m in fingers]
        )
        self._to_base = [m.base.inverse() for m in fingers]
        like: dict[Hashable, list[int]] = {}
        for index, problem in enumerate(self.problems):
            like.setdefault(problem.likeness, []).append(index)
        self.alike = tuple(tuple(members) for members in like.values())
        self.stacks = tuple(
            Stack(
                [self.problems[i] for i in members],
                [self.mounted[i] for i in members],
                [self._frame(self.mounted[i]) for i in members],
            )
            for members in self.alike
        )

    def in_base(self, index: int, pose: Pose) -> Pose:
        """Return a pose of the gripper's frame in the base frame of a finger."""
        return self._to_base[index] @ pose

    def _frame(self, mounted: MountedFinger) -> np.ndarray:
        """(6, 6) from a motion q to that in a finger's base frame and units."""
        frame, turn = np.zeros((6, 6)), mounted.base.rotation
        frame[:3, :3] = turn.T * (self.length / mounted.finger.length)
        frame[3:, 3:] = turn.T
        return frame


@dataclass(frozen=True, eq=False)
class FingerBlock:
    """One finger's part of the problem at a point; in the finger's own units.

    Attributes:
        derived: The finger, with the object as its last obstacle, but for friction.
        hold: What friction remembers, with the forces that it has here.
        friction: The contacts that have it.
        unbalanced: (N,) generalised forces left over.
    """

    derived: Derived
    hold: Hold
    friction: FrictionRows
    unbalanced: np.ndarray

    @property
    def point(self) -> KktPoint:
        """The finger with the object as its last obstacle."""
        return self.derived.near.point

    @property
    def touch(self) -> np.ndarray:
        """(k,) of the rows in ``point.rows``, which are contacts with the object."""
        return self.derived.near.touch

    @property
    def columns(self) -> np.ndarray:
        """(C + c, 6) of all rows with respect to q."""
        return self.derived.columns

    @property
    def border(self) -> np.ndarray:
        """(N, 6) of the Hessian, finger against q."""
        return self.derived.border

    @property
    def corner(self) -> np.ndarray:
        """(6, 6) the finger's share of the Hessian of q."""
        return self.derived.corner

    @property
    def turn(self) -> np.ndarray:
        """(3, 3) the object's orientation in the finger's base frame."""
        return self.derived.near.turn

    @property
    def centre(self) -> np.ndarray:
        """(3,) the object's centre in the finger's base frame and units."""
        return self.derived.near.centre

    def on_object(self) -> np.ndarray:
        """(6,) force and moment that the finger leaves over on the object, in its own units."""
        total = self.point.multipliers @ self.columns
        if len(self.friction):
            total = total + self.friction.forces.ravel() @ self.friction.columns.reshape(-1, 6)
        return total


@dataclass(frozen=True, eq=False)
class GraspPoint:
    """All fingers and the object at one pose, with multipliers and derivatives.

    Attributes:
        pose: Of the object in the gripper.
        blocks: One per finger.
        load: (6,) force and moment on the object about its centre, in units.
        unbalanced: (6,) what load and contacts leave over.
        residual: Largest unbalanced generalised force relative to the largest elastic one or 1.
        near_disks: Disks near each other; None where they do not count. Their forces are in the
            blocks.
    """

    pose: Pose
    blocks: tuple[FingerBlock, ...]
    load: np.ndarray
    unbalanced: np.ndarray
    residual: float
    near_disks: NearDisks | None = None


def derive(hand: Hand, body: Body, pose: Pose, guesses: Sequence[Guess]) -> list[FingerBlock]:
    """Return each finger's part of the problem.

    Args:
        hand: The fingers.
        body: The object.
        pose: Of the object in the gripper.
        guesses: One per finger.
    """
    found: list[Derived | None] = [None] * len(guesses)
    for members, stack in zip(hand.alike, hand.stacks, strict=True):
        for index, one in zip(
            members, stack.derive(body, pose, [guesses[i] for i in members]), strict=True
        ):
            found[index] = one
    derived = [one for one in found if one is not None]
    return _with_friction(derived, [one.near for one in derived], body)


def held_anew(body: Body, parts: Sequence[FingerBlock], holds: Sequence[Hold]) -> list[FingerBlock]:
    """Return the fingers where friction remembers something else and all forces are the same."""
    near = [replace(p.derived.near, hold=hold) for p, hold in zip(parts, holds, strict=True)]
    return _with_friction([p.derived for p in parts], near, body)


def _with_friction(
    derived: Sequence[Derived], near: Sequence[Touching], body: Body
) -> list[FingerBlock]:
    parts = []
    for one, touching, rows in zip(derived, near, friction_rows(near, body.friction), strict=True):
        unbalanced = touching.point.unbalanced
        if len(rows):
            along = rows.rows.reshape(-1, len(unbalanced))
            unbalanced = unbalanced + rows.forces.ravel() @ along
        parts.append(FingerBlock(one, touching.hold, rows, unbalanced))
    return parts


def gather(
    hand: Hand,
    pose: Pose,
    blocks: Sequence[FingerBlock],
    load: np.ndarray,
    free: bool = True,
    near_disks: NearDisks | None = None,
) -> GraspPoint:
    """Put the blocks together and say how far from equilibrium all is.

    Args:
        hand: The fingers.
        pose: Of the object in the gripper.
        blocks: One per finger.
        load: (6,) on the object, in units.
        free: Whether the object is; else its support balances it.
        near_disks: Disks near each other, whose forces the blocks have (`disks.press`).
    """
    unbalanced = -load
    worst, largest = 0.0, 1.0
    for weight, part in zip(hand.weights, blocks, strict=True):
        unbalanced = unbalanced + weight * part.on_object()
        worst = max(worst, float(np.abs(part.unbalanced).max()), part.friction.error())
        largest = max(largest, float(np.abs(part.point.at.y).max()))
    if free:
        worst = max(worst, float(np.abs(unbalanced).max()))
    return GraspPoint(pose, tuple(blocks), load, unbalanced, worst / largest, near_disks)
