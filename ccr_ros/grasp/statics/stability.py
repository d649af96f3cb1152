# SPDX-License-Identifier: Apache-2.0
"""Whether a grasp is stable: the Hessian of all its energy, reduced to what constraints leave free.

That the smallest eigenvalue is above a bound is told without it: by Debreu's lemma, H is positive
definite on the null space of the constraints' gradients A if and only if H + w A'A is for some w,
which Cholesky's factorisation says, finger by finger (`newton`). The eigenvalue takes longer.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ccr_ros.model.result import row_space

from .assembly import FingerBlock, GraspPoint, Hand
from .body import Body

STABLE = 1e-6  # a grasp with a smaller eigenvalue is at a branch point, or past it
_AUGMENT = (1e3, 1e5)  # w, in turn, for gradients of unit length
_AXES = "xyz"


@dataclass(frozen=True, eq=False)
class Stability:
    """How stable fingers and object are at a point, found out when it is asked for.

    Attributes:
        hand: The fingers.
        at: Where they stand.
        body: The object; its pose does not count.
        supported: Whether something beside the fingers holds it where it is.
    """

    hand: Hand
    at: GraspPoint
    body: Body
    supported: bool

    def exceeds(self, bound: float) -> bool:
        """Whether the smallest eigenvalue is above a bound."""
        if any(self._definite(bound, augment) for augment in _AUGMENT):
            return True
        return self.smallest_eigenvalue > bound

    @property
    def smallest_eigenvalue(self) -> float:
        """Of the reduced Hessian; see `GraspSolution`."""
        return self._softest[0]

    @cached_property
    def softest(self) -> str:
        """Who moves most along the softest direction, and how."""
        direction = self._softest[1]
        first, shares = 0, []
        for problem, part, mounted in zip(
            self.hand.problems, self.at.blocks, self.hand.mounted, strict=True
        ):
            own = direction[first : first + problem.size]
            tip = part.point.first.points[problem.points.backbone[-1]] @ own
            shares.append((float(np.linalg.norm(tip)), f"the tip of {mounted.finger.name} moves"))
            first += problem.size
        if not self.supported:
            shift, turn = direction[-6:-3], direction[-3:]
            for way, word in ((shift, "moves along"), (turn, "turns about")):
                axis = int(np.argmax(np.abs(way)))
                shares.append((float(np.linalg.norm(way)), f"the object {word} {_AXES[axis]}"))
        return max(shares)[1]

    # -- inside ----------------------------------------------------------------------------

    @cached_property
    def _held(self) -> np.ndarray:
        """(k, 6) motions of the object that are no directions to fall in.

        They are what the support holds, or else what leaves the object's surface as it is.
        """
        if self.supported:
            return np.eye(6)
        both = np.zeros((6, 6))
        both[:3, :3] = both[3:, 3:] = self.at.pose.rotation
        return (both @ self.body.free_directions()).T

    def _definite(self, bound: float, augment: float) -> bool:
        """Whether H - bound + augment A'A is positive definite."""
        held = self._held
        corner = augment * held.T @ held - bound * np.eye(6)
        try:
            for weight, part in zip(self.hand.weights, self.at.blocks, strict=True):
                rows, columns = _constraints(part)
                size = np.einsum("ij,ij->i", rows, rows) + np.einsum("ij,ij->i", columns, columns)
                raised = rows.T * (augment / np.maximum(size, 1e-12))
                matrix = weight * part.point.hessian + raised @ rows
                matrix.flat[:: len(matrix) + 1] -= bound
                np.linalg.cholesky(matrix)
                if self.supported:
                    continue
                border = weight * part.border + raised @ columns
                corner += weight * part.corner
                corner += (columns.T * (augment / np.maximum(size, 1e-12))) @ columns
                corner -= border.T @ np.linalg.solve(matrix, border)
            np.linalg.cholesky(corner)
        except np.linalg.LinAlgError:
            return False
        return True

    @cached_property
    def _softest(self) -> tuple[float, np.ndarray]:
        """The smallest eigenvalue and its vector (fingers, then q)."""
        sizes = [problem.size for problem in self.hand.problems]
        total = sum(sizes) + 6
        matrix, rows = np.zeros((total, total)), []
        first = 0
        for weight, part, size in zip(self.hand.weights, self.at.blocks, sizes, strict=True):
            own = slice(first, first + size)
            matrix[own, own] = weight * part.point.hessian
            matrix[own, -6:] = weight * part.border
            matrix[-6:, own] = matrix[own, -6:].T
            matrix[-6:, -6:] += weight * part.corner
            by_y, by_q = _constraints(part)
            full = np.zeros((len(by_y), total))
            full[:, own], full[:, -6:] = by_y, by_q
            rows.append(full)
            first += size
        idle = np.zeros((len(self._held), total))
        idle[:, -6:] = self._held
        constraints = np.concatenate([*rows, idle])
        if not len(constraints):
            values, vectors = np.linalg.eigh(matrix)
            return float(values[0]), vectors[:, 0]
        basis = row_space(constraints)
        null = np.linalg.qr(basis, mode="complete")[0][:, basis.shape[1] :]
        values, vectors = np.linalg.eigh(null.T @ matrix @ null)
        return float(values[0]), null @ vectors[:, 0]


def _constraints(part: FingerBlock) -> tuple[np.ndarray, np.ndarray]:
    """Gradients, in the finger and in q, of what keeps its value: what presses, what sticks."""
    active, sticks = part.point.active, ~part.friction.slips
    size = part.point.rows.shape[1]
    rows = np.concatenate([part.point.rows[active], part.friction.rows[sticks].reshape(-1, size)])
    columns = np.concatenate([part.columns[active], part.friction.columns[sticks].reshape(-1, 6)])
    return rows, columns
