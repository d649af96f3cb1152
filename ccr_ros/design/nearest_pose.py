# SPDX-License-Identifier: Apache-2.0
"""The pose, clear of obstacles and not bent too tightly, whose disks are nearest to wanted places.

Where a pose of the finger cannot have the wanted shape, this one has the least sum of squared disk
errors; `rest_statics` then gives the rest shape of which the pulls bend the finger into it.
"""

from __future__ import annotations

import numpy as np

from ccr_ros.model.equilibrium import EquilibriumProblem, Evaluation

from .bounded_step import bounded_step, curvature_bounds, kept
from .pose_fit import PIECES, smooth_guess
from .target import DesiredShape

_ITERATIONS = 120
_BAND = 0.1  # of the length; points nearer to an obstacle enter a step
_MARGIN = 1e-9  # of the length; so far points stay clear, so that they do not press
_LARGEST_STEP = 0.1  # rad, that an end's turn per arc may change by
SMOOTH = 0.2  # of a segment's length: what a change of bending counts as; see `nearest_pose`
_FLAT = 1e-6  # relative decrease that a step is worth
_EXACT = 1e-24  # of the squared error, in units of segments' lengths


def nearest_pose(
    problem: EquilibriumProblem,
    shape: DesiredShape,
    limits: np.ndarray,
    smoothness: float = SMOOTH,
) -> np.ndarray:
    """Return coordinates (N,) of the pose, of a problem straight at rest in ``PIECES`` arcs each.

    Gauss-Newton in a trust region, from a pose that bends smoothly along the wanted tangents; the
    least error near that. Free of twist. Of the many ways to bend between disks a weak preference
    picks a smooth one: a change of bending by 1 rad per segment from one end of an arc to the next
    counts as much as a disk that is ``smoothness`` of a segment off.

    Args:
        problem: With its obstacles.
        shape: Where the disks shall be.
        limits: (2,) largest bending and twist of the pose [1/m].
        smoothness: See above. Without it, disks that are kept off a curve's inside are brought
            nearer by bending to and fro between them, as tightly as the limits allow.
    """
    length, n = problem.finger.length, shape.segments
    wanted = shape.points[1:] / length
    free = np.tile([True, True, False], problem.size // 3)
    scale = problem.coordinate_scale.reshape(2, 3)
    to_ends = problem.rod_step * length  # arc coordinates per curvature
    caps = limits * to_ends

    def ends(y: np.ndarray) -> np.ndarray:
        z = y.reshape(-1, 2, 3) * scale
        return np.stack([z[:, 0] - z[:, 1], z[:, 0] + z[:, 1]], axis=1)

    def from_ends(e: np.ndarray) -> np.ndarray:
        z = np.stack([(e[:, 0] + e[:, 1]) / 2, (e[:, 1] - e[:, 0]) / 2], axis=1)
        return (z / scale).ravel()

    # Columns of y per (x, y) of both ends of each arc: the unknowns of a step.
    unit = np.zeros((2, 3, 2, 3))
    for axis in range(3):
        unit[0, axis, :, axis], unit[1, axis, :, axis] = 0.5, [-0.5, 0.5]
    unit /= scale[:, :, None, None]
    columns = np.kron(np.eye(problem.arcs), unit.reshape(6, 6))[:, free]

    turn = smoothness * PIECES  # a segment turns by that many times as much as an arc
    changes = turn * _change_rows(problem.arcs) @ np.eye(6 * problem.arcs)[:, free]

    def gap(at: Evaluation) -> np.ndarray:
        away = (at.points[problem.points.backbone[1:]] - wanted).ravel() * n
        return np.concatenate([away, changes @ ends(at.y).ravel()[free]])

    def merit(at: Evaluation, price: float) -> float:
        inside = np.maximum(_MARGIN - at.distances[:, ~problem.fixed], 0.0).sum()
        return float(np.sum(gap(at) ** 2)) + price * float(inside)

    at = problem.evaluate(from_ends(kept(ends(smooth_guess(problem, shape)), caps)))
    damping, price = 1e-2, 1.0
    for _ in range(_ITERATIONS):
        residual = gap(at)
        first = problem.linearize(at)
        moved = first.points[problem.points.backbone[1:]].reshape(-1, problem.size)
        jacobian = np.concatenate([moved @ columns * n, changes])
        bends = ends(at.y)
        rows, room = curvature_bounds(bends.reshape(-1, 3), caps)
        rows = rows[:, np.tile([True, True, False], rows.shape[1] // 3)]
        near = at.distances < _BAND
        near[:, problem.fixed] = False
        if near.any():
            contact, _, _ = problem.contact_rows(at, first, np.argwhere(near))
            rows = np.concatenate([rows, contact @ columns])
            room = np.concatenate([room, at.distances[near] - _MARGIN])
        found = bounded_step(residual, jacobian, damping, rows, room)
        if found is None:  # the bounds, linearised, leave no way
            break
        step, largest = found
        price = max(price, 2.0 * largest)
        value = merit(at, price)
        if value < _EXACT:
            break
        longest = float(np.abs(step).max())
        step *= min(1.0, _LARGEST_STEP / max(longest, 1e-300))
        change = np.zeros(bends.size)
        change[free] = step
        trial = problem.evaluate(from_ends(kept(bends + change.reshape(bends.shape), caps)))
        gained = value - merit(trial, price)
        promise = value - float(np.sum((residual + jacobian @ step) ** 2))
        if gained > 0:
            at = trial
            if gained > 0.5 * promise and longest <= _LARGEST_STEP:
                damping = max(0.2 * damping, 1e-9)
            if gained < _FLAT * value and longest <= _LARGEST_STEP:
                break
        else:
            damping *= 5.0
            if damping > 1e6:
                break
    return at.y


def _change_rows(arcs: int) -> np.ndarray:
    """Rows (., 6 arcs) of the ends' curvature: changes along arcs, and jumps between them."""
    ends = 2 * arcs
    steps = np.eye(ends)[1:] - np.eye(ends)[:-1]
    return np.kron(steps, np.eye(3))
