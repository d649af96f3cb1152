# SPDX-License-Identifier: Apache-2.0
"""Newton's step for several fingers and an object, by elimination of one finger after the other.

The matrix is block diagonal but for the object's border of six. With the active constraints'
augmentation (`ccr_ros.model.sqp`) in it, D_f a finger's block, B_f its border, Q the object's, and
for all constraints of a finger the rows R_f, C_f in its coordinates and in q, of how they change,
and the rows F_f, G_f of how their forces act (the same without friction),

    S = Q - sum B_f' D_f^-1 B_f,     P_f = C_f - R_f D_f^-1 B_f,     O_f = G_f - F_f D_f^-1 B_f
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
from .friction import RHO

# Weights of the augmentation (as in ccr_ros.model.sqp), in turn until the matrix is definite; in
# a grasp it is the others' contacts that make a finger stable, which may take more than 10.
_AUGMENT = (10.0, 1e3, 1e5)
_PROX = 1e-9  # of the object's own block: a ball may turn freely, and shall not
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


@dataclass(frozen=True, eq=False)
class _Surface:
    """A finger's friction in a step: rows beside those of its lengths and normals.

    Attributes:
        rows: (s, N) and columns: (s, 6) ways along the surface that are constrained.
        axes: (s, g, 2) what forces they stand for, on the contacts' tangents.
        ways: (s,) the rows' values; forces: (s,) that they have now.
        yields: (s,) their compliances, in the finger's own units.
        sticks: (s,) whether the way must vanish.
        drag: (g, 2) mu times the direction of a slipping contact's force; 0 where it sticks.
    """

    rows: np.ndarray
    columns: np.ndarray
    axes: np.ndarray
    ways: np.ndarray
    forces: np.ndarray
    yields: np.ndarray
    sticks: np.ndarray
    drag: np.ndarray


def _surface(part: FingerBlock) -> _Surface:
    friction = part.friction
    count = len(friction)
    drag = np.zeros((count, 2))
    axes, yields, sticks = [], [], []
    for k in range(count):
        if not friction.slips[k]:
            for i in range(2):
                axis = np.zeros((count, 2))
                axis[k, i] = 1.0
                axes.append(axis)
                yields.append(0.0)
                sticks.append(True)
            continue
        trial = friction.forces[k] + RHO * friction.ways[k]
        size = float(np.linalg.norm(trial))
        way = trial / size
        share = min(1.0, float(friction.limits[k]) / size)
        drag[k] = way * float(friction.limits[k] / part.point.multipliers[friction.index[k]])
        axis = np.zeros((count, 2))
        axis[k] = -way[1], way[0]
        axes.append(axis)
        yields.append((1.0 - share) / max(share * RHO, 1e-9))
        sticks.append(False)
    which = np.array(axes).reshape(len(axes), count, 2)
    return _Surface(
        rows=np.einsum("sgi,gin->sn", which, friction.rows),
        columns=np.einsum("sgi,gij->sj", which, friction.columns),
        axes=which,
        ways=np.einsum("sgi,gi->s", which, friction.ways),
        forces=np.einsum("sgi,gi->s", which, friction.forces),
        yields=np.array(yields),
        sticks=np.array(sticks, dtype=bool),
        drag=drag,
    )


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
    surfaces = [_surface(part) for part in at.blocks]
    for weight in _AUGMENT:
        last = weight == _AUGMENT[-1]
        checked = definite if last else _upright
        system = _eliminated(hand, at, bounds, surfaces, free, support, weight, checked)
        if system is not None:
            return _solved(hand, at, surfaces, system, free)
    return None


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
        border: (N, 6).
        rows: (r, N), columns: (r, 6): R and C; acting_q: (r, 6): G.
        values: (r,) room of lengths and normals, or negative ways; active: (r,).
        yields, kept: (r,) compliances, and forces that they count from.
    """

    by_slope: np.ndarray
    by_q: np.ndarray
    by_force: np.ndarray
    border: np.ndarray
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
    hand: Hand,
    at: GraspPoint,
    bounds: Sequence[Bounds],
    surfaces: list[_Surface],
    free: bool,
    support: float,
    augment: float,
    checked: Callable[[np.ndarray], np.ndarray | None],
) -> _System | None:
    corner, right = np.eye(6) * (_PROX + support), -at.load
    fingers = []
    for weight, part, bound, surface in zip(hand.weights, at.blocks, bounds, surfaces, strict=True):
        point = part.point
        slacks, pressed = point.slacks(bound), point.active
        slope, matrix, border = weight * point.at.y, weight * point.hessian, weight * part.border
        corner = corner + weight * part.corner
        stuck = surface.sticks
        rows = np.concatenate([point.rows[pressed], surface.rows[stuck]])
        columns = np.concatenate([part.columns[pressed], surface.columns[stuck]])
        if len(rows):
            target = np.concatenate([slacks[pressed], -surface.ways[stuck]])
            size = np.einsum("ij,ij->i", rows, rows)
            if free:
                size = size + np.einsum("ij,ij->i", columns, columns)
            raised = weight * augment / np.maximum(size, 1e-12)
            matrix = matrix + (rows.T * raised) @ rows
            border = border + (rows.T * raised) @ columns
            corner = corner + (columns.T * raised) @ columns
            slope = slope - rows.T @ (raised * target)
            right = right - columns.T @ (raised * target)
        solid = checked(matrix)
        if solid is None:
            return None
        changed = np.concatenate([point.rows, surface.rows])
        changed_q = np.concatenate([part.columns, surface.columns])
        acting, acting_q = changed, changed_q
        if len(part.friction):
            drag, index = surface.drag, part.friction.index
            acting, acting_q = changed.copy(), changed_q.copy()
            acting[index] += np.einsum("gi,gin->gn", drag, part.friction.rows)
            acting_q[index] += np.einsum("gi,gij->gj", drag, part.friction.columns)
        known = np.concatenate([slope[None], border.T, acting]).T
        solved = np.linalg.solve(solid, known)
        fingers.append(
            _Eliminated(
                by_slope=solved[:, 0],
                by_q=solved[:, 1:7],
                by_force=solved[:, 7:],
                border=border,
                rows=changed,
                columns=changed_q,
                acting_q=acting_q,
                values=np.concatenate([slacks, -surface.ways]),
                active=np.concatenate([pressed, np.ones(len(surface.ways), dtype=bool)]),
                yields=surface.yields / weight,
                kept=surface.forces * weight,
            )
        )
    if not free:
        return _System(fingers, np.zeros(6), np.zeros((6, 6)))
    body = checked(corner - sum(f.border.T @ f.by_q for f in fingers))
    if body is None:
        return None
    inverse = np.linalg.inv(body)
    right = right - sum(f.border.T @ f.by_slope for f in fingers)
    return _System(fingers, right, 0.5 * (inverse + inverse.T))


def _solved(
    hand: Hand, at: GraspPoint, surfaces: list[_Surface], system: _System, free: bool
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
    if free:
        reach = np.concatenate([f.columns - f.rows @ f.by_q for f in system.fingers])
        out = np.concatenate([f.acting_q - f.by_force.T @ f.border for f in system.fingers])
        gram += reach @ system.inverse @ out.T
        residual += reach @ by_slope
    # Which rows are inequalities (lengths, normals), which are ways along the surface.
    along = np.concatenate(
        [np.arange(n) >= n - len(s.ways) for n, s in zip(counts, surfaces, strict=True)]
    )
    found = _forces(system, surfaces, gram, residual, along)
    if found is None or not np.isfinite(found).all():
        return None
    body_step = -(by_slope + system.inverse @ (out.T @ found))
    steps, multipliers, friction, first = [], [], [], 0
    for weight, part, surface, f, count in zip(
        hand.weights, at.blocks, surfaces, system.fingers, counts, strict=True
    ):
        pushed = found[first : first + count]
        first += count
        steps.append(-(f.by_slope + f.by_force @ pushed + f.by_q @ body_step))
        pushed = pushed / weight
        normal, tangential = pushed[: len(part.point.rows)], pushed[len(part.point.rows) :]
        multipliers.append(normal)
        index = part.friction.index
        across = np.einsum("s,sgi->gi", tangential, surface.axes)
        friction.append(across + normal[index, None] * surface.drag)
    if not all(np.isfinite(step).all() for step in [*steps, body_step]):
        return None
    return Step(steps, body_step, multipliers, friction)


def _forces(
    system: _System,
    surfaces: list[_Surface],
    gram: np.ndarray,
    residual: np.ndarray,
    along: np.ndarray,
) -> np.ndarray | None:
    """Forces of rows: those along the surface by elimination, the others by complementarity."""
    active = np.concatenate([f.active for f in system.fingers])
    if not along.any():
        return solve_multipliers(0.5 * (gram + gram.T), residual, active)
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
    pushing = solve_multipliers(left, value, active[bound], symmetric)
    if pushing is None:
        return None
    found = np.zeros(len(residual))
    found[bound] = pushing
    found[way] = -(solved[:, 0] + solved[:, 1:] @ pushing)
    return found
