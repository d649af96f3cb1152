# SPDX-License-Identifier: Apache-2.0
"""Routings through holes anywhere on the circle: Gauss-Newton on the hole angles.

For given angles the finger is a chain of segments (`segments`) whose common tensions follow from
the pulls. Its derivatives follow from the implicit function theorem, first segment by segment,

    H dy = -scale * (sum_c T_c d(gradient_c) + sum_c gradient_c dT_c),

then for the tensions, from the cables' total lengths.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..model.rotation import cross
from .routing_chain import Target
from .segments import SegmentModel, Segments

_ROUNDS = 12  # of Newton on the tensions
_CLOSED = 1e-13  # of a cable's length, units of L
_ITERATIONS = 60
_CONVERGED = 1e-12  # of an angle's step [rad]
_LONGEST_STEP = 0.5  # of an angle [rad]
_EXACT = 1e-24  # sum of squared errors, units of L^2


@dataclass(frozen=True, eq=False)
class Balance:
    """A finger in equilibrium: hole angles (n+1, C), tensions (C,), segments and Hessians."""

    angles: np.ndarray
    tensions: np.ndarray
    at: Segments
    hessian: np.ndarray


def balanced(
    model: SegmentModel, target: Target, angles: np.ndarray, tensions: np.ndarray
) -> Balance | None:
    """Return the equilibrium of hole angles (n+1, C) under the target's pulls, or None.

    Args:
        tensions: (C,) where Newton's method begins.
    """
    start, end = angles[:-1], angles[1:]
    slack = model.evaluate(model.rest, start, end).lengths.sum(axis=0)
    wanted = slack * (1.0 - target.fractions) - target.pulls
    guess = None
    for _ in range(_ROUNDS):
        spread = np.broadcast_to(tensions, start.shape)
        at, hessian, good = model.solve(model.rest, start, end, spread, guess)
        if not good.all():
            return None
        gap = wanted - at.lengths.sum(axis=0)
        if np.abs(gap).max() < _CLOSED:
            return Balance(angles, tensions, at, hessian)
        change = model.per_tension(at, hessian)
        stretch = (at.gradient @ change).sum(axis=0)
        step = np.linalg.lstsq(stretch, gap, rcond=None)[0]
        step = np.maximum(step, -0.7 * tensions)  # tensions stay positive
        tensions = tensions + step
        guess = at.z + change @ step
    return None


@dataclass(frozen=True, eq=False)
class Fit:
    """What hole angles give.

    Attributes:
        angles: (n+1, C) [rad].
        tensions: (C,) T L^2 / EI.
        frames, points: (n+1, 3, 3) and (n+1, 3) of the disks, units of L.
        cost: Sum of squared errors, units of L^2.
    """

    angles: np.ndarray
    tensions: np.ndarray
    frames: np.ndarray
    points: np.ndarray
    cost: float


def fitted(
    model: SegmentModel, target: Target, angles: np.ndarray, tensions: np.ndarray
) -> Fit | None:
    """Return the hole angles nearest to (n+1, C) that bring the disks nearest to the target.

    Levenberg's method; ``None`` where there is no equilibrium to begin at.
    """
    here = balanced(model, target, angles, tensions)
    if here is None:
        return None
    damping = 1e-3
    error, jacobian = _linearized(model, target, here)
    cost = float(error @ error)
    for _ in range(_ITERATIONS):
        if cost < _EXACT:
            break
        normal, slope = jacobian.T @ jacobian, jacobian.T @ error
        size = float(np.diag(normal).max())
        step = -np.linalg.solve(normal + damping * size * np.eye(len(slope)), slope)
        if np.abs(step).max() < _CONVERGED:
            break
        step *= min(1.0, _LONGEST_STEP / float(np.abs(step).max()))
        there = balanced(model, target, here.angles + step.reshape(angles.shape), here.tensions)
        if there is not None:
            new_error, new_jacobian = _linearized(model, target, there)
            new_cost = float(new_error @ new_error)
            if new_cost < cost:
                here, error, jacobian, cost = there, new_error, new_jacobian, new_cost
                damping = max(damping * 0.1, 1e-15)
                continue
        damping *= 10.0
        if damping > 1e6:
            break
    return Fit(here.angles, here.tensions, *here.at.poses(), cost)


def _linearized(
    model: SegmentModel, target: Target, here: Balance
) -> tuple[np.ndarray, np.ndarray]:
    """Errors (m,) of disks from the target, and their Jacobian (m, (n+1) C) in the hole angles."""
    at, turned = here.at, _turned(model, target, here)
    frames, points = at.poses()
    columns = turned.shape[2]
    turn, drift = np.zeros((columns, 3)), np.zeros((columns, 3))
    errors, rows = [], []
    for i in range(len(at.z)):
        disk, before, frame = i + 1, frames[i].T, frames[i + 1][None]
        drift = drift + cross(turn, points[disk] - points[i]) + turned[i, 3:].T @ before
        turn = turn + turned[i, :3].T @ before
        errors.append(target.errors(disk, frame, points[disk][None])[0])
        rows.append(target.slopes(disk, frame, turn[None], drift[None])[0].T)
    return np.concatenate(errors), np.concatenate(rows)


def _turned(model: SegmentModel, target: Target, here: Balance) -> np.ndarray:
    """Twists (n, 6, (n+1) C) of every segment's end, in its start's frame, per hole angle."""
    at, (disks, cables) = here.at, here.angles.shape
    n, size = at.z.shape
    start, end = _tangents(model, here.angles[:-1]), _tangents(model, here.angles[1:])
    end = end @ at.rotation.transpose(0, 2, 1)
    forces = np.zeros((n, size, disks * cables))
    direct, slack = np.zeros((2, cables, disks * cables))
    rest = model.evaluate(model.rest, here.angles[:-1], here.angles[1:])
    rest_end = _tangents(model, here.angles[1:]) @ rest.rotation.transpose(0, 2, 1)
    segment = np.arange(n)
    for c in range(cables):
        span = at.spans[:, c]
        moved, spin = model.end_points(at, c), at.twists[:, :3]
        for tangent, disk, sign in ((start[:, c], segment, -1.0), (end[:, c], segment + 1, 1.0)):
            along = (tangent * span).sum(axis=1)
            across = sign * (tangent - along[:, None] * span) / at.lengths[:, c, None]
            slope = (across[:, None] @ moved)[:, 0]
            if sign > 0:
                slope += (cross(tangent, span)[:, None] @ spin)[:, 0]
            column = disk * cables + c
            forces[segment, :, column] = here.tensions[c] * slope
            np.add.at(direct[c], column, sign * along)
        for tangent, disk, sign in (
            (start[:, c], segment, -1.0),
            (rest_end[:, c], segment + 1, 1.0),
        ):
            np.add.at(slack[c], disk * cables + c, sign * (tangent * rest.spans[:, c]).sum(axis=1))
    bent = model.response(here.hessian, forces)
    change = model.per_tension(at, here.hessian)
    stretch = (at.gradient @ change).sum(axis=0)
    lengths = (at.gradient @ bent).sum(axis=0) + direct
    wanted = slack * (1.0 - target.fractions)[:, None]
    bent += change @ np.linalg.lstsq(stretch, wanted - lengths, rcond=None)[0]
    return at.twists @ bent


def _tangents(model: SegmentModel, angles: np.ndarray) -> np.ndarray:
    """Derivatives (..., 3) of `SegmentModel.holes`."""
    return model.holes(angles + np.pi / 2)
