# SPDX-License-Identifier: Apache-2.0
"""The fingers' own part of Newton's step, eliminated for like fingers at once; see `newton`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ccr_ros.model.sqp import definite

from .assembly import FingerBlock, GraspPoint, Hand
from .shared import Shared
from .surface import Surface

_PROX = 1e-9  # of the object's own block: a ball may turn freely, and shall not

Check = Callable[[np.ndarray], np.ndarray | None]  # a matrix that is positive definite, or None


@dataclass(frozen=True, eq=False)
class Task:
    """What a step is asked of.

    Attributes:
        hand, at: The fingers, and where they are.
        free: Whether the object moves.
        support: Stiffness of a support that gives way, in units.
        slacks: Per finger (C + c,) room of its lengths and normals.
        surfaces: Per finger, what friction does.
        shared: Rows that fingers share, after each finger's own ones.
    """

    hand: Hand
    at: GraspPoint
    free: bool
    support: float
    slacks: list[np.ndarray]
    surfaces: list[Surface]
    shared: Shared


@dataclass(frozen=True, eq=False)
class Eliminated:
    """F like fingers after elimination: D^-1 on slope, border and forces, and their rows.

    Fingers with fewer rows than others have rows of zeros at the end.

    Attributes:
        members: (F,) which fingers.
        real: (m,) places of rows that are not just zeros, in the flattened (F R,).
        by_slope: (F, N); by_q: (F, N, 6); by_force: (F, N, R).
        left: (F, 6, N) E.
        rows: (F, R, N), columns: (F, R, 6): R and C; acting_q: (F, R, 6): G.
        values: (F, R) room of lengths and normals, or negative ways; 0 of shared rows.
    """

    members: tuple[int, ...]
    real: np.ndarray
    by_slope: np.ndarray
    by_q: np.ndarray
    by_force: np.ndarray
    left: np.ndarray
    rows: np.ndarray
    columns: np.ndarray
    acting_q: np.ndarray
    values: np.ndarray

    def gram(self) -> np.ndarray:
        """(m, m) R D^-1 F' of all rows: blocks, one per finger."""
        own = self.rows @ self.by_force
        count, rows = own.shape[:2]
        full = np.zeros((count, rows, count, rows))
        each = np.arange(count)
        full[each, :, each, :] = own
        return full.reshape(count * rows, count * rows)[self.real[:, None], self.real]

    def residual(self) -> np.ndarray:
        """(m,) values the rows have after a step without forces, where the object stays."""
        after = self.values + (self.rows @ self.by_slope[:, :, None])[:, :, 0]
        return after.ravel()[self.real]

    def reach(self) -> tuple[np.ndarray, np.ndarray]:
        """(m, 6) P and O' of the rows."""
        out = self.columns - self.rows @ self.by_q
        back = self.acting_q - (self.left @ self.by_force).swapaxes(1, 2)
        return out.reshape(-1, 6)[self.real], back.reshape(-1, 6)[self.real]

    def steps(self, forces: np.ndarray, body: np.ndarray) -> np.ndarray:
        """(F, N) steps under forces (m,) of the rows, and a motion (6,) of the object."""
        count, rows = self.values.shape
        table = np.zeros(count * rows)
        table[self.real] = forces
        pushed = self.by_force @ table.reshape(count, rows, 1)
        return -(self.by_slope + pushed[:, :, 0] + self.by_q @ body)


@dataclass(frozen=True, eq=False)
class System:
    """All fingers after elimination.

    Attributes:
        stacks: The like ones together.
        right: (6,) right-hand side for the object; inverse: (6, 6) of its own matrix S.
    """

    stacks: list[Eliminated]
    right: np.ndarray
    inverse: np.ndarray


def eliminated(
    task: Task, chosen: Sequence[np.ndarray], augment: float, checked: Check
) -> System | None:
    """Eliminate the fingers' coordinates; None where a matrix fails the check.

    Args:
        task: What is asked.
        chosen: Per finger, which of its lengths and normals count.
        augment: Weight of the augmentation by the active constraints.
        checked: See `Check`.
    """
    corner, right = np.eye(6) * (_PROX + task.support), -task.at.load
    stacks = []
    for members in task.hand.alike:
        found = _stack(task, members, chosen, augment, checked)
        if found is None:
            return None
        stack, own_corner, own_right = found
        stacks.append(stack)
        corner, right = corner + own_corner, right + own_right
    if not task.free:
        return System(stacks, np.zeros(6), np.zeros((6, 6)))
    body = corner - sum((s.left @ s.by_q).sum(axis=0) for s in stacks)
    even = 0.5 * (body + body.T)
    solid = checked(even)
    if solid is None:
        return None
    right = right - sum((s.left @ s.by_slope[:, :, None]).sum(axis=0)[:, 0] for s in stacks)
    return System(stacks, right, np.linalg.inv(solid + (body - even)))


def _stack(
    task: Task,
    members: tuple[int, ...],
    chosen: Sequence[np.ndarray],
    augment: float,
    checked: Check,
) -> tuple[Eliminated, np.ndarray, np.ndarray] | None:
    """Like fingers eliminated, with their parts of corner and right-hand side."""
    parts = [task.at.blocks[i] for i in members]
    surfaces = [task.surfaces[i] for i in members]
    weights = task.hand.weights[list(members)]
    rows, columns, values, fixed, real = _rows(task, members, chosen)
    slope = weights[:, None] * np.stack([p.point.at.y for p in parts])
    matrix = weights[:, None, None] * np.stack([p.point.hessian for p in parts])
    border = weights[:, None, None] * np.stack([p.border for p in parts])
    corner = np.tensordot(weights, np.stack([p.corner for p in parts]), axes=1)
    right = np.zeros(6)
    if fixed.any():
        size = np.einsum("frn,frn->fr", rows, rows)
        if task.free:
            size = size + np.einsum("frn,frn->fr", columns, columns)
        raised = np.where(fixed, augment / np.maximum(size, 1e-12), 0.0) * weights[:, None]
        by_row = (rows * raised[:, :, None]).swapaxes(1, 2)
        by_column = (columns * raised[:, :, None]).swapaxes(1, 2)
        matrix += by_row @ rows
        border += by_row @ columns
        corner = corner + (by_column @ columns).sum(axis=0)
        slope -= (by_row @ values[:, :, None])[:, :, 0]
        right -= (by_column @ values[:, :, None]).sum(axis=0)[:, 0]
    solid = checked(matrix)
    if solid is None:
        return None
    left, acting, acting_q = border.swapaxes(1, 2), rows, columns
    if any(len(s.slips) for s in surfaces):
        left, solid = left.copy(), solid.copy()
        acting, acting_q = rows.copy(), columns.copy()
        for f, (part, surface) in enumerate(zip(parts, surfaces, strict=True)):
            _drag(part, surface, chosen[members[f]], acting[f], acting_q[f])
            if surface.turning is not None:
                size_f, turning = matrix.shape[1], weights[f] * surface.turning
                solid[f] += turning[:size_f, :size_f]
                border[f] += turning[:size_f, size_f:]
                left[f] += turning[size_f:, :size_f]
                corner = corner + turning[size_f:, size_f:]
    sides = np.concatenate([slope[:, :, None], border, acting.swapaxes(1, 2)], axis=2)
    solved = np.linalg.solve(solid, sides)
    done = Eliminated(
        members=members,
        real=real,
        by_slope=solved[:, :, 0],
        by_q=solved[:, :, 1:7],
        by_force=solved[:, :, 7:],
        left=left,
        rows=rows,
        columns=columns,
        acting_q=acting_q,
        values=values,
    )
    return done, corner, right


def _rows(
    task: Task, members: tuple[int, ...], chosen: Sequence[np.ndarray]
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Rows, columns and values; which are augmented, as they hold; and which are not padding."""
    rows, columns, values, fixed = [], [], [], []
    for i in members:
        index, surface, part = chosen[i], task.surfaces[i], task.at.blocks[i]
        shared, none = task.shared.rows[i], np.zeros(len(task.shared))
        rows.append(np.concatenate([part.point.rows[index], surface.rows, shared]))
        columns.append(
            np.concatenate([part.columns[index], surface.columns, np.zeros((len(none), 6))])
        )
        values.append(np.concatenate([task.slacks[i][index], -surface.ways, none]))
        fixed.append(np.concatenate([part.point.active[index], surface.sticks, none > 0]))
    counts = np.array([len(v) for v in values])
    real = np.flatnonzero(np.arange(counts.max()) < counts[:, None])
    return padded(rows), padded(columns), padded(values), padded(fixed), real


def padded(tables: Sequence[np.ndarray]) -> np.ndarray:
    """Stack tables of unlike lengths, with zeros at the end of shorter ones."""
    longest = max(len(table) for table in tables)
    stack = np.zeros((len(tables), longest, *tables[0].shape[1:]), dtype=tables[0].dtype)
    for place, table in zip(stack, tables, strict=True):
        place[: len(table)] = table
    return stack


def _drag(
    part: FingerBlock, surface: Surface, index: np.ndarray, rows: np.ndarray, columns: np.ndarray
) -> None:
    """Make of R and C the rows F and G of how forces act: slipping contacts drag along."""
    slips = surface.slips
    if len(slips):
        to = np.searchsorted(index, part.friction.index[slips])
        drag = surface.drag[slips, None, :]
        rows[to] += (drag @ part.friction.rows[slips])[:, 0]
        columns[to] += (drag @ part.friction.columns[slips])[:, 0]


def upright(matrix: np.ndarray) -> np.ndarray | None:
    """The matrix, or matrices, if positive definite."""
    try:
        np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        return None
    return matrix


def made_definite(matrix: np.ndarray) -> np.ndarray | None:
    """The matrix, or matrices, with negative eigenvalues turned positive; None if not finite."""
    if upright(matrix) is not None:
        return matrix
    if matrix.ndim == 2:
        return definite(matrix)
    found = [definite(one) for one in matrix]
    solid = [one for one in found if one is not None]
    return np.stack(solid) if len(solid) == len(found) else None
