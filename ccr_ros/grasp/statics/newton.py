# SPDX-License-Identifier: Apache-2.0
"""Newton's step for several fingers and an object, by elimination of one finger after the other.

The matrix is block diagonal but for the object's border of six. With the active constraints'
augmentation (`ccr_ros.model.sqp`) in it, D_f a finger's block, B_f its border, Q the object's, A_f
and C_f the constraint rows in the finger's coordinates and in q,

    S = Q - sum B_f' D_f^-1 B_f,      P_f = C_f - A_f D_f^-1 B_f
    Gram matrix of the constraints = blockdiag(A_f D_f^-1 A_f') + P S^-1 P'
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ccr_ros.model.qp import solve_multipliers
from ccr_ros.model.sqp import Bounds, definite

from .assembly import GraspPoint, Hand

_AUGMENT = 10.0  # as in ccr_ros.model.sqp
_PROX = 1e-9  # of the object's own block: a ball may turn freely, and shall not


@dataclass(frozen=True, eq=False)
class Step:
    """A step and the multipliers after it.

    Attributes:
        fingers: Per finger (N,).
        body: (6,) of q.
        multipliers: Per finger (C + c,), in the finger's own units.
    """

    fingers: list[np.ndarray]
    body: np.ndarray
    multipliers: list[np.ndarray]


def newton_step(hand: Hand, at: GraspPoint, bounds: Sequence[Bounds]) -> Step | None:
    """Return the step from a point, or None where the quadratic problem has no solution.

    Args:
        hand: The fingers.
        at: Where.
        bounds: Per finger.
    """
    corner, right = np.eye(6) * _PROX, -at.load
    fingers = []
    for weight, part, bound in zip(hand.weights, at.blocks, bounds, strict=True):
        point = part.point
        slacks, active = point.slacks(bound), point.active
        slope, matrix, border = weight * point.at.y, weight * point.hessian, weight * part.border
        corner = corner + weight * part.corner
        if active.any():
            rows, columns = point.rows[active], part.columns[active]
            size = np.einsum("ij,ij->i", rows, rows) + np.einsum("ij,ij->i", columns, columns)
            raised = weight * _AUGMENT / np.maximum(size, 1e-12)
            matrix = matrix + (rows.T * raised) @ rows
            border = border + (rows.T * raised) @ columns
            corner = corner + (columns.T * raised) @ columns
            slope = slope - rows.T @ (raised * slacks[active])
            right = right - columns.T @ (raised * slacks[active])
        solid = definite(matrix)
        if solid is None:
            return None
        known = np.concatenate([slope[None], border.T, point.rows]).T
        solved = np.linalg.solve(solid, known)
        fingers.append((solved[:, 0], solved[:, 1:7], solved[:, 7:], border, slacks))

    body = definite(corner - sum(b.T @ by_q for _, by_q, _, b, _ in fingers))
    if body is None:
        return None
    right = right - sum(b.T @ by_g for by_g, _, _, b, _ in fingers)
    reach = [  # P_f
        part.columns - part.point.rows @ by_q
        for part, (_, by_q, _, _, _) in zip(at.blocks, fingers, strict=True)
    ]
    inverse = np.linalg.inv(body)
    inverse = 0.5 * (inverse + inverse.T)
    stacked = np.concatenate(reach)
    by_slope = inverse @ right
    gram = stacked @ inverse @ stacked.T
    residual, first = [], 0
    for part, (by_g, _, by_rows, _, slacks) in zip(at.blocks, fingers, strict=True):
        rows = part.point.rows
        last = first + len(rows)
        own = rows @ by_rows
        gram[first:last, first:last] += 0.5 * (own + own.T)
        residual.append(slacks + rows @ by_g + stacked[first:last] @ by_slope)
        first = last
    active = np.concatenate([part.point.active for part in at.blocks])
    found = solve_multipliers(gram, np.concatenate(residual), active)
    if found is None or not np.isfinite(found).all():
        return None
    body_step = -(by_slope + inverse @ (stacked.T @ found))
    steps, multipliers, first = [], [], 0
    for weight, (by_g, by_q, by_rows, _, _) in zip(hand.weights, fingers, strict=True):
        own = found[first : first + by_rows.shape[1]]
        first += len(own)
        steps.append(-(by_g + by_rows @ own + by_q @ body_step))
        multipliers.append(own / weight)
    if not all(np.isfinite(step).all() for step in [*steps, body_step]):
        return None
    return Step(steps, body_step, multipliers)
