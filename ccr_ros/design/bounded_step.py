# SPDX-License-Identifier: Apache-2.0
"""Least-squares steps under linear inequalities, and the bounds on curvature as such."""

from __future__ import annotations

import numpy as np

from ccr_ros.model.qp import solve_multipliers

_NEAR = 0.3  # of a bound; curvature beyond has its bound in the step


def bounded_step(
    residual: np.ndarray,
    jacobian: np.ndarray,
    damping: float,
    rows: np.ndarray,
    room: np.ndarray,
) -> tuple[np.ndarray, float] | None:
    """Return the d of least |r + J d|^2 + damping |d|^2 with rows d <= room; None if there is none.

    With it comes the largest multiplier of the bounds, in units of |.|^2.

    Args:
        residual: (k,) r; jacobian: (k, c) J.
        damping: > 0.
        rows: (b, c); room: (b,).
    """
    hessian = jacobian.T @ jacobian
    hessian.flat[:: len(hessian) + 1] += damping
    gradient = jacobian.T @ residual
    solved = np.linalg.solve(hessian, np.column_stack([gradient, rows.T]))
    gram = rows @ solved
    multipliers = solve_multipliers(
        0.5 * (gram[:, 1:] + gram[:, 1:].T), room + gram[:, 0], np.zeros(len(room), dtype=bool)
    )
    if multipliers is None:
        return None
    step = -(solved[:, 0] + solved[:, 1:] @ multipliers)
    return step, 2.0 * float(multipliers.max(initial=0.0))


def curvature_bounds(curvature: np.ndarray, limits: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return rows (b, 3 e) and room (b,) that keep curvature (e, 3) in its bounds.

    Bending's bound, a disc, is linearised where it is nearest; `kept` takes the rest back.

    Args:
        curvature: Bending x, y and twist of each end of a piece.
        limits: (2,) largest bending and twist, in the same unit.
    """
    bending = np.hypot(curvature[:, 0], curvature[:, 1])
    bent = np.flatnonzero(bending > _NEAR * limits[0])
    twisted = np.flatnonzero(np.abs(curvature[:, 2]) > _NEAR * limits[1])
    rows = np.zeros((len(bent) + len(twisted), *curvature.shape))
    rows[np.arange(len(bent)), bent, :2] = curvature[bent, :2] / bending[bent, None]
    rows[len(bent) + np.arange(len(twisted)), twisted, 2] = np.sign(curvature[twisted, 2])
    room = [limits[0] - bending[bent], limits[1] - np.abs(curvature[twisted, 2])]
    return rows.reshape(len(rows), curvature.size), np.concatenate(room)


def kept(curvature: np.ndarray, limits: np.ndarray) -> np.ndarray:
    """Return curvature (..., 3) pulled back into its bounds."""
    inside = curvature.copy()
    bending = np.hypot(inside[..., 0], inside[..., 1])
    inside[..., :2] *= np.minimum(1.0, limits[0] / np.maximum(bending, 1e-300))[..., None]
    inside[..., 2] = np.clip(inside[..., 2], -limits[1], limits[1])
    return inside
