# SPDX-License-Identifier: Apache-2.0
"""Whether a grasp is stable: the Hessian of all its energy, reduced to what constraints leave free.

That the smallest eigenvalue is above a bound is told without it: by Debreu's lemma, H is positive
definite on the null space of the constraints' gradients A if and only if H + w A'A is for some w,
which Cholesky's factorisation says, finger by finger. The eigenvalue takes longer; where
it is positive Lanczos' method finds it with that matrix's inverse.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ccr_ros.model.result import row_space

from .assembly import FingerBlock, GraspPoint, Hand
from .body import Body
from .elimination import padded
from .lanczos import largest_pair

STABLE = 1e-6  # a grasp with a smaller eigenvalue is at a branch point, or past it
_AUGMENT = (1e3, 1e5)  # w, in turn, for gradients of unit length
_VAST = 1e30  # more than what is taken off it, of which nothing is kept
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
        try:
            if self._joined:
                rows = self._constraints
                size = np.einsum("ij,ij->i", rows, rows)
                whole = self._hessian + (rows.T * (augment / np.maximum(size, 1e-12))) @ rows
                whole.flat[:: len(whole) + 1] -= bound
                np.linalg.cholesky(whole)
                return True
            stacks, corner = self._augmented(augment, bound)
            for _, matrix, border in stacks:
                if self.supported:
                    np.linalg.cholesky(matrix)
                    continue
                # The factor of D with its border below: B' D^-1 B is the square of the last rows.
                size = matrix.shape[1]
                bordered = np.zeros((len(matrix), size + 6, size + 6))
                bordered[:, :size, :size] = matrix
                bordered[:, size:, :size] = border.swapaxes(1, 2)
                bordered[:, range(size, size + 6), range(size, size + 6)] = _VAST
                below = np.linalg.cholesky(bordered)[:, size:, :size]
                corner = corner - (below @ below.swapaxes(1, 2)).sum(axis=0)
            np.linalg.cholesky(corner)
        except np.linalg.LinAlgError:
            return False
        return True

    def _augmented(
        self, augment: float, bound: float = 0.0
    ) -> tuple[list[tuple[tuple[int, ...], np.ndarray, np.ndarray]], np.ndarray]:
        """H - bound + augment A'A: like fingers' blocks and borders, and the object's block."""
        held = self._held
        corner = augment * held.T @ held - bound * np.eye(6)
        stacks = []
        for members in self.hand.alike:
            parts = [self.at.blocks[i] for i in members]
            weights = self.hand.weights[list(members)][:, None, None]
            both = [_constraints(part) for part in parts]
            rows, columns = padded([r for r, _ in both]), padded([c for _, c in both])
            size = np.einsum("fri,fri->fr", rows, rows) + np.einsum("fri,fri->fr", columns, columns)
            raised = (augment / np.maximum(size, 1e-12))[:, :, None]
            by_row = (rows * raised).swapaxes(1, 2)
            matrix = weights * np.stack([p.point.hessian for p in parts]) + by_row @ rows
            matrix.reshape(len(parts), -1)[:, :: matrix.shape[1] + 1] -= bound
            border = weights * np.stack([p.border for p in parts]) + by_row @ columns
            stacks.append((members, matrix, border))
            own = weights * np.stack([p.corner for p in parts])
            own += (columns * raised).swapaxes(1, 2) @ columns
            corner = corner + own.sum(axis=0)
        return stacks, corner

    @cached_property
    def _softest(self) -> tuple[float, np.ndarray]:
        """The smallest eigenvalue and its vector (fingers, then q)."""
        basis = self._basis()
        for augment in () if self._joined else _AUGMENT:
            if self._definite(0.0, augment):
                found = self._by_inverse(basis, augment)
                if found is not None:
                    return found
        return self._by_decomposition(basis)

    @property
    def _joined(self) -> bool:
        """Whether fingers press on each other: there are no blocks then to go by."""
        return self.at.near_disks is not None and bool(self.at.near_disks.active.any())

    @cached_property
    def _constraints(self) -> np.ndarray:
        """(r, total) all that keeps its value, by the fingers' coordinates and q."""
        sizes = [problem.size for problem in self.hand.problems]
        total, first, rows = sum(sizes) + 6, 0, []
        for part, size in zip(self.at.blocks, sizes, strict=True):
            by_y, by_q = _constraints(part)
            full = np.zeros((len(by_y), total))
            full[:, first : first + size], full[:, -6:] = by_y, by_q
            rows.append(full)
            first += size
        idle = np.zeros((len(self._held), total))
        idle[:, -6:] = self._held
        rows.append(idle)
        near_disks = self.at.near_disks
        if near_disks is not None and self._joined:
            gaps = np.concatenate([row[near_disks.active] for row in near_disks.rows], axis=1)
            rows.append(np.concatenate([gaps, np.zeros((len(gaps), 6))], axis=1))
        return np.concatenate(rows)

    def _basis(self) -> np.ndarray:
        """Orthonormal basis (total, r) of the constraints' gradients."""
        rows = self._constraints
        return row_space(rows) if len(rows) else np.zeros((rows.shape[1], 0))

    def _by_inverse(self, basis: np.ndarray, augment: float) -> tuple[float, np.ndarray] | None:
        """The pair from the inverse of the reduced Hessian, of which it is the largest.

        With M = H + augment A'A and Q a basis of A' that is M^-1 - M^-1 Q (Q'M^-1 Q)^-1 Q'M^-1.
        """
        stacks, corner = self._augmented(augment)
        none = np.empty(0)
        inverses, reaches = [none] * len(self.at.blocks), [none] * len(self.at.blocks)
        for members, matrix, border in stacks:
            inverse = np.linalg.inv(matrix)
            reach = inverse @ border
            corner = corner - (border.swapaxes(1, 2) @ reach).sum(axis=0)
            for i, one, way in zip(members, inverse, reach, strict=True):
                inverses[i], reaches[i] = one, way
        ends = np.cumsum([len(inverse) for inverse in inverses])[:-1]
        by_q = np.linalg.inv(corner)

        def solved(x: np.ndarray) -> np.ndarray:
            parts = np.split(x[:-6], ends)
            pull = x[-6:] - sum(r.T @ p for r, p in zip(reaches, parts, strict=True))
            q = by_q @ pull
            along = [i @ p - r @ q for i, p, r in zip(inverses, parts, reaches, strict=True)]
            return np.concatenate([*along, q])

        held = solved(basis)
        back = held @ np.linalg.inv(basis.T @ held)
        found = largest_pair(lambda x: solved(x) - back @ (held.T @ x), len(basis))
        return None if found is None else (1.0 / found[0], found[1])

    @cached_property
    def _hessian(self) -> np.ndarray:
        """(total, total) of the fingers' coordinates and q, as it is."""
        total, first = sum(problem.size for problem in self.hand.problems) + 6, 0
        matrix = np.zeros((total, total))
        for weight, part in zip(self.hand.weights, self.at.blocks, strict=True):
            own = slice(first, first + len(part.border))
            matrix[own, own] = weight * part.point.hessian
            matrix[own, -6:] = weight * part.border
            matrix[-6:, own] = matrix[own, -6:].T
            matrix[-6:, -6:] += weight * part.corner
            first += len(part.border)
        if self.at.near_disks is not None and self._joined:
            ways = np.concatenate(self.at.near_disks.ways, axis=1)
            matrix[:-6, :-6] += (ways.T * self.at.near_disks.stiffness) @ ways
        return matrix

    def _by_decomposition(self, basis: np.ndarray) -> tuple[float, np.ndarray]:
        """The pair out of all of the reduced Hessian's, whatever their signs."""
        null = np.linalg.qr(basis, mode="complete")[0][:, basis.shape[1] :]
        values, vectors = np.linalg.eigh(null.T @ self._hessian @ null)
        return float(values[0]), null @ vectors[:, 0]


def _constraints(part: FingerBlock) -> tuple[np.ndarray, np.ndarray]:
    """Gradients, in the finger and in q, of what keeps its value: what presses, what sticks."""
    active, sticks = part.point.active, ~part.friction.slips
    size = part.point.rows.shape[1]
    rows = np.concatenate([part.point.rows[active], part.friction.rows[sticks].reshape(-1, size)])
    columns = np.concatenate([part.columns[active], part.friction.columns[sticks].reshape(-1, 6)])
    return rows, columns
