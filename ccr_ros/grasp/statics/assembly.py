# SPDX-License-Identifier: Apache-2.0
"""One problem of several fingers and the object between them.

In units of the first finger's length L and of EI / L, with y_f the fingers' coordinates
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

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ccr_ros.model.equilibrium import EquilibriumProblem
from ccr_ros.model.files import MountedFinger
from ccr_ros.model.rotation import Pose, cross, skew
from ccr_ros.model.settings import SolverSettings
from ccr_ros.model.sqp import KktPoint, derive

from .body import Body
from .friction import FrictionRows, Hold, friction_rows, pushes_in_base

_EYE = np.eye(3)


class Hand:
    """The fingers of a gripper as equilibrium problems, built once.

    Attributes:
        mounted: The fingers with their bases.
        problems: One per finger.
        weights: (F,) EI / L of each finger relative to the first one's.
        energy: EI / L of the first finger [J]; length: its length [m]: the units.
    """

    def __init__(
        self, fingers: Sequence[MountedFinger], settings: SolverSettings | None = None
    ) -> None:
        self.mounted = tuple(fingers)
        self.problems = [EquilibriumProblem(m.finger, settings) for m in fingers]
        first = self.mounted[0].finger
        self.length = first.length
        self.energy = first.bending_stiffness / first.length
        self.weights = np.array(
            [m.finger.bending_stiffness / m.finger.length / self.energy for m in fingers]
        )
        self._to_base = [m.base.inverse() for m in fingers]
        self._frames = []
        for mounted in self.mounted:
            frame, turn = np.zeros((6, 6)), mounted.base.rotation
            frame[:3, :3] = turn.T * (self.length / mounted.finger.length)
            frame[3:, 3:] = turn.T
            self._frames.append(frame)

    def in_base(self, index: int, pose: Pose) -> Pose:
        """Return a pose of the gripper's frame in the base frame of a finger."""
        return self._to_base[index] @ pose

    def frame(self, index: int) -> np.ndarray:
        """Return (6, 6) from a motion q to that in a finger's base frame and units."""
        return self._frames[index]


@dataclass(frozen=True, eq=False)
class FingerBlock:
    """One finger's part of the problem at a point; in the finger's own units.

    Attributes:
        point: The finger with the object as its last obstacle.
        touch: (k,) of the rows in ``point.rows``, which are contacts with the object.
        columns: (C + c, 6) of all rows with respect to q.
        border: (N, 6) of the Hessian, finger against q.
        corner: (6, 6) the finger's share of the Hessian of q.
        hold: What friction remembers, with the forces that it has here.
        friction: The contacts that have it.
        place: The object in the finger's base frame.
        unbalanced: (N,) generalised forces left over.
    """

    point: KktPoint
    touch: np.ndarray
    columns: np.ndarray
    border: np.ndarray
    corner: np.ndarray
    hold: Hold
    friction: FrictionRows
    place: Pose
    unbalanced: np.ndarray

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
    """

    pose: Pose
    blocks: tuple[FingerBlock, ...]
    load: np.ndarray
    unbalanced: np.ndarray
    residual: float


def block(
    hand: Hand,
    index: int,
    body: Body,
    pose: Pose,
    y: np.ndarray,
    tensions: np.ndarray,
    forces: np.ndarray,
    hold: Hold | None = None,
) -> FingerBlock:
    """Return one finger's part, at coordinates y (N,), with multipliers in its own units.

    Args:
        hand: The fingers.
        index: Which of them.
        body: The object.
        pose: Of the object in the gripper.
        y: The finger's coordinates.
        tensions: (C,) multipliers of its cable lengths.
        forces: (O, P) multipliers of its contacts; the last row is the object's.
        hold: What friction remembers of it, with its forces; None: nothing.
    """
    problem = hand.problems[index]
    local = hand.in_base(index, pose)
    own = problem.finger.obstacles
    problem.obstacles = (*own, body.shape.moved(local))
    hold = Hold.none(len(problem.points.labels)) if hold is None else hold
    pushes = pushes_in_base(hold, local.rotation, forces[-1]) if body.friction > 0 else None
    point = derive(problem, problem.evaluate(y), tensions, forces, pushes)
    lengths = len(point.tensions)
    touch = np.flatnonzero(point.pairs[:, 0] == len(own))
    columns = np.zeros((len(point.rows), 6))
    border, corner = np.zeros((problem.size, 6)), np.zeros((6, 6))
    frame = hand.frame(index)
    if len(touch):
        where = point.pairs[touch, 1]
        arms = point.at.points[where] - local.position / problem.finger.length
        normals = point.normals[touch]
        pushed = np.concatenate([normals, cross(arms, normals)], axis=1)
        columns[lengths + touch] = pushed @ frame
        pressed = np.flatnonzero(point.multipliers[lengths + touch] > 0)
        if len(pressed):
            force = point.multipliers[lengths + touch[pressed]]
            whole = force[:, None] * normals[pressed]
            if pushes is not None:
                whole = whole + pushes[where[pressed]]
            _second_order(
                point.first.points[where[pressed]], point.curvatures[touch[pressed]],
                arms[pressed], force, whole, border, corner,
            )  # fmt: skip
            border, corner = border @ frame, frame.T @ corner @ frame
    parts = (point, lengths + touch, columns, border, corner)
    return _with_friction(hand, index, body, parts, hold, local)


def held_anew(hand: Hand, index: int, body: Body, part: FingerBlock, hold: Hold) -> FingerBlock:
    """Return a finger's part where friction remembers something else and forces are the same."""
    parts = (part.point, part.touch, part.columns, part.border, part.corner)
    return _with_friction(hand, index, body, parts, hold, part.place)


def _with_friction(
    hand: Hand,
    index: int,
    body: Body,
    parts: tuple[KktPoint, np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    hold: Hold,
    place: Pose,
) -> FingerBlock:
    point, touch = parts[:2]
    centre = place.position / hand.problems[index].finger.length
    rows = friction_rows(
        point, touch, hold, body.friction, centre, place.rotation, hand.frame(index)
    )
    unbalanced = point.unbalanced
    if len(rows):
        along = rows.rows.reshape(-1, len(unbalanced))
        unbalanced = unbalanced + rows.forces.ravel() @ along
    return FingerBlock(*parts, hold, rows, place, unbalanced)


def _second_order(
    jacobian: np.ndarray,
    curvatures: np.ndarray,
    arms: np.ndarray,
    force: np.ndarray,
    whole: np.ndarray,
    border: np.ndarray,
    corner: np.ndarray,
) -> None:
    """Add the second derivatives of -force x distance to border and corner, base frame.

    ``whole`` (k, 3) are the contacts' forces on the finger, friction included.
    """
    hessians = curvatures * force[:, None, None]
    motion = np.empty((len(arms), 3, 6))  # of u by q
    motion[:, :, :3], motion[:, :, 3:] = -_EYE, skew(arms)
    bent = hessians @ motion
    by_point = bent.copy()
    by_point[:, :, 3:] -= skew(whole)
    border -= jacobian.reshape(-1, jacobian.shape[2]).T @ by_point.reshape(-1, 6)
    corner -= motion.reshape(-1, 6).T @ bent.reshape(-1, 6)
    turned = skew(whole.sum(axis=0))
    corner[:3, 3:] -= turned
    corner[3:, :3] -= turned.T
    outer = whole.T @ arms
    corner[3:, 3:] -= 0.5 * (outer + outer.T) - np.trace(outer) * _EYE


def gather(
    hand: Hand, pose: Pose, blocks: Sequence[FingerBlock], load: np.ndarray, free: bool = True
) -> GraspPoint:
    """Put the blocks together and say how far from equilibrium all is.

    Args:
        hand: The fingers.
        pose: Of the object in the gripper.
        blocks: One per finger.
        load: (6,) on the object, in units.
        free: Whether the object is; else its support balances it.
    """
    unbalanced = -load
    worst, largest = 0.0, 1.0
    for weight, part in zip(hand.weights, blocks, strict=True):
        unbalanced = unbalanced + weight * part.on_object()
        worst = max(worst, float(np.abs(part.unbalanced).max()), part.friction.error())
        largest = max(largest, float(np.abs(part.point.at.y).max()))
    if free:
        worst = max(worst, float(np.abs(unbalanced).max()))
    return GraspPoint(pose, tuple(blocks), load, unbalanced, worst / largest)
