# SPDX-License-Identifier: Apache-2.0
"""Newton's step for several fingers and an object, by elimination of one finger after the other.

The matrix is block diagonal but for the object's border of six. With the active constraints'
augmentation (`ccr_ros.model.sqp`) in it, D_f a finger's block, B_f its border, E_f that of the
object (B_f' where nothing slips, see `surface`), Q the object's block, and for all constraints of a
finger the rows R_f, C_f in its coordinates and in q, of how they change, and the rows F_f, G_f of
how their forces act (the same where nothing slips),

    S = Q - sum E_f D_f^-1 B_f,     P_f = C_f - R_f D_f^-1 B_f,     O_f' = G_f' - E_f D_f^-1 F_f'
    W = blockdiag(R_f D_f^-1 F_f') + P S^-1 O'

maps the constraints' forces to their changes. A point that sticks has two rows more, its ways along
the surface, which must vanish. Of one that slips, the normal's force acts along normal + mu times
the direction of slip; across that direction it has one row more, with a compliance: the way's
direction turns as the force does (the linearised projection of `friction`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ccr_ros.model.qp import solve_multipliers
from ccr_ros.model.sqp import Bounds, definite

from .assembly import FingerBlock, GraspPoint, Hand
from .surface import Surface, surface_of

# Weights of the augmentation (as in ccr_ros.model.sqp), in turn until the matrix is definite; in
# a grasp it is the others' contacts that make a finger stable, which may take more than 10. A
# constraint that lets go is held back by its weight, so the first is low where some may.
_AUGMENT = (10.0, 1e3, 1e5)
_AUGMENT_HELD = (1e3, 1e5)
_PROX = 1e-9  # of the object's own block: a ball may turn freely, and shall not
_ROUNDING = 1e-12  # units of length
_YIELD = 1e-8  # relative compliance of points that stick, from force to force: twins share a load


@dataclass(frozen=True, eq=False)
class Step:
    """A step and the multipliers after it.

    Attributes:
        fingers: Per finger (N,).
        body: (6,) of q.
        multipliers: Per finger (C + c,), in the finger's own units.
        friction: Per finger (g, 2), of its `FrictionRows`, in the finger's own units.
    """

    fingers: list[np.ndarray]
    body: np.ndarray
    multipliers: list[np.ndarray]
    friction: list[np.ndarray]


def newton_step(
    hand: Hand,
    at: GraspPoint,
    bounds: Sequence[Bounds],
    free: bool = True,
    support: float = 0.0,
) -> Step | None:
    """Return the step from a point, or None where the quadratic problem has no solution.

    Args:
        hand: The fingers.
        at: Where.
        bounds: Per finger.
        free: Whether the object moves; else its support holds it where it is.
        support: Stiffness of a support that gives way, in units; its force is in the load.
    """
    task = _Task(
        hand, at, free, support,
        [part.point.slacks(bound) for part, bound in zip(at.blocks, bounds, strict=True)],
        [surface_of(part) for part in at.blocks],
    )  # fmt: skip
    # Mostly the constraints that carry force go on doing so, and no others come to.
    pressed = [np.flatnonzero(part.point.active) for part in at.blocks]
    guess = _attempt(task, pressed, _held)
    if guess is not None and _keeps_off(task, guess):
        return guess
    return _attempt(task, [np.arange(len(part.point.rows)) for part in at.blocks], None)


@dataclass(frozen=True, eq=False)
class _Task:
    """What a step is asked of: arguments of `newton_step`, all rooms, and what friction does."""

    hand: Hand
    at: GraspPoint
    free: bool
    support: float
    slacks: list[np.ndarray]
    surfaces: list[Surface]


def _attempt(
    task: _Task, chosen: list[np.ndarray], solve: Callable[..., np.ndarray | None] | None
) -> Step | None:
    """The step with some of each finger's lengths and normals; their forces by ``solve``."""
    for weight in _AUGMENT if solve is None else _AUGMENT_HELD:
        checked = definite if weight == _AUGMENT[-1] else _upright
        system = _eliminated(task, chosen, weight, checked)
        if system is not None:
            return _solved(task, chosen, system, solve or solve_multipliers)
    return None


def _keeps_off(task: _Task, step: Step) -> bool:
    """Whether a step violates none of the constraints that carry no force."""
    for part, slack, way, pushed in zip(
        task.at.blocks, task.slacks, step.fingers, step.multipliers, strict=True
    ):
        room = slack - part.point.rows @ way - part.columns @ step.body
        if float(np.where(pushed > 0, 0.0, room).min()) < -_ROUNDING:
            return False
    return True


def _held(
    s: np.ndarray, t: np.ndarray, active: np.ndarray, symmetric: bool = True
) -> np.ndarray | None:
    """The forces with which all constraints are kept; None where one would pull."""
    if not len(t):
        return t
    try:
        forces = np.linalg.solve(s, -t)
    except np.linalg.LinAlgError:
        return None
    return forces if forces.min() >= 0 else None


def _upright(matrix: np.ndarray) -> np.ndarray | None:
    """The matrix if it is positive definite."""
    try:
        np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        return None
    return matrix


@dataclass(frozen=True, eq=False)
class _Eliminated:
    """A finger after elimination: D^-1 on slope, border and forces, and its rows.

    Attributes:
        by_slope: (N,); by_q: (N, 6); by_force: (N, r).
        left: (6, N) E.
        rows: (r, N), columns: (r, 6): R and C; acting_q: (r, 6): G.
        values: (r,) room of lengths and normals, or negative ways; active: (r,).
        yields, kept: (s,) compliances, and forces that they count from.
    """

    by_slope: np.ndarray
    by_q: np.ndarray
    by_force: np.ndarray
    left: np.ndarray
    rows: np.ndarray
    columns: np.ndarray
    acting_q: np.ndarray
    values: np.ndarray
    active: np.ndarray
    yields: np.ndarray
    kept: np.ndarray


@dataclass(frozen=True, eq=False)
class _System:
    """All fingers after elimination, and the inverse of the object's own matrix S."""

    fingers: list[_Eliminated]
    right: np.ndarray
    inverse: np.ndarray


def _eliminated(
    task: _Task,
    chosen: list[np.ndarray],
    augment: float,
    checked: Callable[[np.ndarray], np.ndarray | None],
) -> _System | None:
    corner, right = np.eye(6) * (_PROX + task.support), -task.at.load
    fingers = []
    for weight, part, index, room, surface in zip(
        task.hand.weights, task.at.blocks, chosen, task.slacks, task.surfaces, strict=True
    ):
        point, values = part.point, np.concatenate([room[index], -surface.ways])
        active = np.concatenate([point.active[index], np.ones(len(surface.ways), dtype=bool)])
        changed = np.concatenate([point.rows[index], surface.rows])
        changed_q = np.concatenate([part.columns[index], surface.columns])
        slope, matrix, border = weight * point.at.y, weight * point.hessian, weight * part.border
        corner = corner + weight * part.corner
        fixed = active.copy()
        fixed[len(index) :] = surface.sticks
        rows, columns, target = changed[fixed], changed_q[fixed], values[fixed]
        if len(rows):
            size = np.einsum("ij,ij->i", rows, rows)
            if task.free:
                size = size + np.einsum("ij,ij->i", columns, columns)
            raised = weight * augment / np.maximum(size, 1e-12)
            by_row, by_column = rows.T * raised, columns.T * raised
            matrix = matrix + by_row @ rows
            border = border + by_row @ columns
            corner = corner + by_column @ columns
            slope = slope - by_row @ target
            right = right - by_column @ target
        solid = checked(matrix)
        if solid is None:
            return None
        left = border.T
        if surface.turning is not None:
            size, turning = len(matrix), weight * surface.turning
            solid = solid + turning[:size, :size]
            border, left = border + turning[:size, size:], left + turning[size:, :size]
            corner = corner + turning[size:, size:]
        acting, acting_q = _acting(part, index, surface, changed, changed_q)
        solved = np.linalg.solve(solid, np.concatenate([slope[None], border.T, acting]).T)
        fingers.append(
            _Eliminated(
                by_slope=solved[:, 0],
                by_q=solved[:, 1:7],
                by_force=solved[:, 7:],
                left=left,
                rows=changed,
                columns=changed_q,
                acting_q=acting_q,
                values=values,
                active=active,
                yields=surface.yields / weight,
                kept=surface.forces * weight,
            )
        )
    if not task.free:
        return _System(fingers, np.zeros(6), np.zeros((6, 6)))
    body = corner - sum(f.left @ f.by_q for f in fingers)
    even = 0.5 * (body + body.T)
    solid = checked(even)
    if solid is None:
        return None
    right = right - sum(f.left @ f.by_slope for f in fingers)
    return _System(fingers, right, np.linalg.inv(solid + (body - even)))


def _acting(
    part: FingerBlock,
    index: np.ndarray,
    surface: Surface,
    changed: np.ndarray,
    changed_q: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Rows F and G of how forces act, from R and C: a slipping contact drags along its way."""
    slips = surface.slips
    if not len(slips):
        return changed, changed_q
    acting, acting_q = changed.copy(), changed_q.copy()
    to = np.searchsorted(index, part.friction.index[slips])
    drag = surface.drag[slips, None, :]
    acting[to] += (drag @ part.friction.rows[slips])[:, 0]
    acting_q[to] += (drag @ part.friction.columns[slips])[:, 0]
    return acting, acting_q


def _solved(
    task: _Task,
    chosen: list[np.ndarray],
    system: _System,
    solve: Callable[..., np.ndarray | None],
) -> Step | None:
    """The step and the constraints' forces."""
    counts = [len(f.values) for f in system.fingers]
    total = sum(counts)
    gram = np.zeros((total, total))
    residual = np.concatenate([f.values for f in system.fingers])
    first = 0
    for f, count in zip(system.fingers, counts, strict=True):
        own = slice(first, first + count)
        gram[own, own] = f.rows @ f.by_force
        residual[own] += f.rows @ f.by_slope
        first += count
    out, by_slope = np.zeros((total, 6)), system.inverse @ system.right
    if task.free:
        reach = np.concatenate([f.columns - f.rows @ f.by_q for f in system.fingers])
        out = np.concatenate([f.acting_q - (f.left @ f.by_force).T for f in system.fingers])
        gram += reach @ system.inverse @ out.T
        residual += reach @ by_slope
    # Which rows are inequalities (lengths, normals), which are ways along the surface.
    along = np.concatenate([np.arange(n) >= len(i) for n, i in zip(counts, chosen, strict=True)])
    found = _forces(system, task.surfaces, gram, residual, along, solve)
    if found is None or not np.isfinite(found).all():
        return None
    body_step = -(by_slope + system.inverse @ (out.T @ found))
    steps, multipliers, friction, first = [], [], [], 0
    for weight, part, index, surface, f, count in zip(
        task.hand.weights, task.at.blocks, chosen, task.surfaces, system.fingers, counts,
        strict=True,
    ):  # fmt: skip
        pushed = found[first : first + count]
        first += count
        steps.append(-(f.by_slope + f.by_force @ pushed + f.by_q @ body_step))
        pushed = pushed / weight
        normal = np.zeros(len(part.point.rows))
        normal[index] = pushed[: len(index)]
        multipliers.append(normal)
        across = np.einsum("s,sgi->gi", pushed[len(index) :], surface.axes)
        friction.append(across + normal[part.friction.index, None] * surface.drag)
    if not all(np.isfinite(step).all() for step in [*steps, body_step]):
        return None
    return Step(steps, body_step, multipliers, friction)


def _forces(
    system: _System,
    surfaces: list[Surface],
    gram: np.ndarray,
    residual: np.ndarray,
    along: np.ndarray,
    solve: Callable[..., np.ndarray | None],
) -> np.ndarray | None:
    """Forces of rows: those along the surface by elimination, the others by complementarity."""
    active = np.concatenate([f.active for f in system.fingers])
    if not along.any():
        return solve(0.5 * (gram + gram.T), residual, active)
    bound, way = np.flatnonzero(~along), np.flatnonzero(along)
    inner = gram[way[:, None], way]
    sticks = np.concatenate([s.sticks for s in surfaces])
    yields = np.concatenate([f.yields for f in system.fingers])
    kept = np.concatenate([f.kept for f in system.fingers])
    soft = np.where(sticks, _YIELD * np.maximum(np.diag(inner), 1e-12), yields)
    inner = inner + np.diag(soft)
    # residual + W m + soft (m - kept) = 0 for rows that stick; kept does not count in slip
    rest = residual[way] - np.where(sticks, soft * kept, 0.0)
    try:
        solved = np.linalg.solve(inner, np.column_stack([rest, gram[way[:, None], bound]]))
    except np.linalg.LinAlgError:
        return None
    across = gram[bound[:, None], way]
    left = gram[bound[:, None], bound] - across @ solved[:, 1:]
    value = residual[bound] - across @ solved[:, 0]
    symmetric = all(s.sticks.all() for s in surfaces)
    pushing = solve(left, value, active[bound], symmetric)
    if pushing is None:
        return None
    found = np.zeros(len(residual))
    found[bound] = pushing
    found[way] = -(solved[:, 0] + solved[:, 1:] @ pushing)
    return found
