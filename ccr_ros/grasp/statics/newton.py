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

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ccr_ros.model.qp import solve_multipliers
from ccr_ros.model.sqp import Bounds, definite

from .assembly import FingerBlock, GraspPoint, Hand
from .friction import RHO

_AUGMENT = 10.0  # as in ccr_ros.model.sqp
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
    hand: Hand, at: GraspPoint, bounds: Sequence[Bounds], free: bool = True
) -> Step | None:
    """Return the step from a point, or None where the quadratic problem has no solution.

    Args:
        hand: The fingers.
        at: Where.
        bounds: Per finger.
        free: Whether the object moves; else its support holds it where it is.
    """
    corner, right = np.eye(6) * _PROX, -at.load
    fingers, values, active, yields, kept = [], [], [], [], []
    surfaces = [_surface(part) for part in at.blocks]
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
            raised = weight * _AUGMENT / np.maximum(size, 1e-12)
            matrix = matrix + (rows.T * raised) @ rows
            border = border + (rows.T * raised) @ columns
            corner = corner + (columns.T * raised) @ columns
            slope = slope - rows.T @ (raised * target)
            right = right - columns.T @ (raised * target)
        solid = definite(matrix)
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
        fingers.append((solved[:, 0], solved[:, 1:7], solved[:, 7:], border, changed, changed_q,
                        acting_q))  # fmt: skip
        values.append(np.concatenate([slacks, -surface.ways]))
        active.append(np.concatenate([pressed, np.ones(len(surface.ways), dtype=bool)]))
        yields.append(surface.yields / weight)
        kept.append(surface.forces * weight)

    forces = _constraint_forces(
        fingers, values, active, yields, kept, surfaces, corner, right, free
    )
    if forces is None:
        return None
    found, body_step = forces
    steps, multipliers, friction, first = [], [], [], 0
    for weight, part, surface, (by_g, by_q, by_rows, *_) in zip(
        hand.weights, at.blocks, surfaces, fingers, strict=True
    ):
        own = found[first : first + by_rows.shape[1]]
        first += len(own)
        steps.append(-(by_g + by_rows @ own + by_q @ body_step))
        own = own / weight
        normal, along = own[: len(part.point.rows)], own[len(part.point.rows) :]
        multipliers.append(normal)
        index = part.friction.index
        friction.append(
            np.einsum("s,sgi->gi", along, surface.axes) + normal[index, None] * surface.drag
        )
    if not all(np.isfinite(step).all() for step in [*steps, body_step]):
        return None
    return Step(steps, body_step, multipliers, friction)


def _constraint_forces(
    fingers: list,
    values: list[np.ndarray],
    active: list[np.ndarray],
    yields: list[np.ndarray],
    kept: list[np.ndarray],
    surfaces: list[_Surface],
    corner: np.ndarray,
    right: np.ndarray,
    free: bool,
) -> tuple[np.ndarray, np.ndarray] | None:
    """The forces of all rows, and the object's step."""
    counts = [len(v) for v in values]
    total = sum(counts)
    gram, residual = np.zeros((total, total)), np.concatenate(values)
    first = 0
    for by_g, _, by_rows, _, changed, _, _ in fingers:
        last = first + len(changed)
        gram[first:last, first:last] = changed @ by_rows
        residual[first:last] += changed @ by_g
        first = last
    by_slope, inverse, out = np.zeros(6), np.zeros((6, 6)), np.zeros((total, 6))
    if free:
        body = definite(corner - sum(b.T @ by_q for _, by_q, _, b, *_ in fingers))
        if body is None:
            return None
        right = right - sum(b.T @ by_g for by_g, _, _, b, *_ in fingers)
        inverse = np.linalg.inv(body)
        inverse = 0.5 * (inverse + inverse.T)
        reach = np.concatenate([c_q - c @ by_q for _, by_q, _, _, c, c_q, _ in fingers])
        out = np.concatenate([a_q - by_r.T @ b for _, _, by_r, b, _, _, a_q in fingers])
        by_slope = inverse @ right
        gram += reach @ inverse @ out.T
        residual += reach @ by_slope
    # Which rows are inequalities (lengths, normals), which are ways along the surface.
    along = np.concatenate(
        [np.arange(n) >= n - len(s.ways) for n, s in zip(counts, surfaces, strict=True)]
    )
    found = _solve(gram, residual, np.concatenate(active), along,
                   np.concatenate(yields), np.concatenate(kept), surfaces)  # fmt: skip
    if found is None or not np.isfinite(found).all():
        return None
    return found, -(by_slope + inverse @ (out.T @ found)) if free else np.zeros(6)


def _solve(
    gram: np.ndarray,
    residual: np.ndarray,
    active: np.ndarray,
    along: np.ndarray,
    yields: np.ndarray,
    kept: np.ndarray,
    surfaces: list[_Surface],
) -> np.ndarray | None:
    """Forces of rows: those along the surface by elimination, the others by complementarity."""
    if not along.any():
        return solve_multipliers(0.5 * (gram + gram.T), residual, active)
    bound, way = np.flatnonzero(~along), np.flatnonzero(along)
    inner = gram[way[:, None], way]
    sticks = np.concatenate([s.sticks for s in surfaces])
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
    pushing = solve_multipliers(left, value, active[bound], symmetric=not _slipping(surfaces))
    if pushing is None:
        return None
    found = np.zeros(len(residual))
    found[bound] = pushing
    found[way] = -(solved[:, 0] + solved[:, 1:] @ pushing)
    return found


def _slipping(surfaces: list[_Surface]) -> bool:
    return any(not s.sticks.all() for s in surfaces)
