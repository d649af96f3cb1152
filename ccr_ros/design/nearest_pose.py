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
from .rest_statics import curvature_ends
from .target import DesiredShape

_ITERATIONS = 120
_BAND = 0.1  # of the length; points nearer to an obstacle enter a step
_MARGIN = 1e-7  # of the length; so far points stay clear, so that they do not press
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
    search = _Search(problem, shape, limits, smoothness)
    at = search.at(search.ends(smooth_guess(problem, shape)))
    damping, price = 1e-2, 1.0
    for _ in range(_ITERATIONS):
        residual, jacobian, rows, room = search.linearized(at)
        found = bounded_step(residual, jacobian, damping, rows, room)
        if found is None:  # the bounds, linearised, leave no way
            break
        step, largest = found
        price = max(price, 2.0 * largest)
        value = search.merit(at, price)
        if value < _EXACT:
            break
        longest = float(np.abs(step).max())
        step *= min(1.0, _LARGEST_STEP / max(longest, 1e-300))
        trial = search.at(search.ends(at.y) + search.spread(step))
        gained = value - search.merit(trial, price)
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


class _Search:
    """The least-squares problem in the bending at both ends of every arc, as turn per arc [rad]."""

    def __init__(
        self,
        problem: EquilibriumProblem,
        shape: DesiredShape,
        limits: np.ndarray,
        smoothness: float,
    ) -> None:
        self._problem = problem
        self._backbone = problem.points.backbone[1:]
        self._segments = shape.segments
        self._wanted = shape.points[1:] / problem.finger.length
        self._turn = problem.rod_step * problem.finger.length  # of an arc, per curvature
        self._limits = limits * self._turn
        self._scale = problem.coordinate_scale.reshape(2, 3)
        self._free = np.tile([True, True, False], 2 * problem.arcs)  # no twist
        to_y = np.zeros((2, 3, 2, 3))  # of mean and linear part, per start and end
        for axis in range(3):
            to_y[0, axis, :, axis], to_y[1, axis, :, axis] = 0.5, [-0.5, 0.5]
        to_y /= self._scale[:, :, None, None]
        self._to_y = np.kron(np.eye(problem.arcs), to_y.reshape(6, 6))
        # A segment turns by PIECES times as much as an arc.
        self._changes = smoothness * PIECES * _change_rows(problem.arcs)[:, self._free]

    def ends(self, y: np.ndarray) -> np.ndarray:
        """Turn (E, 2, 3) of the arcs at both ends, at y (N,)."""
        return curvature_ends(self._problem, y).reshape(-1, 2, 3) * self._turn

    def at(self, ends: np.ndarray) -> Evaluation:
        """The pose with this turn, pulled back into its bounds."""
        return self._problem.evaluate(self._to_y @ kept(ends, self._limits).ravel())

    def spread(self, step: np.ndarray) -> np.ndarray:
        """The change (E, 2, 3) of turn that a step in the unknowns makes."""
        change = np.zeros(self._free.size)
        change[self._free] = step
        return change.reshape(-1, 2, 3)

    def merit(self, at: Evaluation, price: float) -> float:
        """Squared residual, and the price of being inside obstacles."""
        inside = np.maximum(_MARGIN - at.distances[:, ~self._problem.fixed], 0.0).sum()
        return float(np.sum(self._residual(at) ** 2)) + price * float(inside)

    def linearized(self, at: Evaluation) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Residual, Jacobian, and rows and room of the bounds on bending and of the distances."""
        first = self._problem.linearize(at)
        columns = self._to_y[:, self._free]
        moved = first.points[self._backbone].reshape(-1, self._problem.size) @ columns
        jacobian = np.concatenate([moved * self._segments, self._changes])
        rows, room = curvature_bounds(self.ends(at.y).reshape(-1, 3), self._limits)
        rows = rows[:, self._free]
        near = at.distances < _BAND
        near[:, self._problem.fixed] = False
        if near.any():
            contact, _, _ = self._problem.contact_rows(at, first, np.argwhere(near))
            rows = np.concatenate([rows, contact @ columns])
            room = np.concatenate([room, at.distances[near] - _MARGIN])
        return self._residual(at), jacobian, rows, room

    def _residual(self, at: Evaluation) -> np.ndarray:
        """Disk errors in units of segments, and the weighted changes of bending."""
        away = (at.points[self._backbone] - self._wanted).ravel() * self._segments
        return np.concatenate([away, self._changes @ self.ends(at.y).ravel()[self._free]])


def _change_rows(arcs: int) -> np.ndarray:
    """Rows (., 6 arcs) of the ends' curvature: changes along arcs, and jumps between them."""
    ends = 2 * arcs
    steps = np.eye(ends)[1:] - np.eye(ends)[:-1]
    return np.kron(steps, np.eye(3))
