# SPDX-License-Identifier: Apache-2.0
"""The largest eigenvalue of a symmetric operator, by Lanczos' method."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

_STEPS = 60
_ENOUGH = 1e-8  # of the eigenvalue: residual of the pair, which bounds the error even among twins
_EVERY = 3  # steps from one look at the residual to the next


def largest_pair(
    operator: Callable[[np.ndarray], np.ndarray], size: int
) -> tuple[float, np.ndarray] | None:
    """Return the largest eigenvalue of a positive semidefinite operator, and its unit vector.

    With full orthogonalisation (Parlett, The Symmetric Eigenvalue Problem, 13.1), as few vectors
    are needed for an operator whose largest eigenvalues stand apart, such as an elastic body's
    compliance.

    Args:
        operator: From (size,) to (size,), symmetric.
        size: Of its vectors.

    Returns:
        None where it has not converged, or where the operator is none.
    """
    steps = min(_STEPS, size)
    vectors = np.zeros((size, steps + 1))
    # From the operator's own range, and the same each time: what is left out of it stays out.
    start = operator(np.random.default_rng(0).standard_normal(size))
    if not float(np.linalg.norm(start)) > 0:
        return None
    vectors[:, 0] = start / np.linalg.norm(start)
    inner = np.zeros((steps, steps))
    for k in range(steps):
        known = vectors[:, : k + 1]
        found = operator(vectors[:, k])
        shares = known.T @ found
        found = found - known @ shares
        found = found - known @ (known.T @ found)
        inner[: k + 1, k] = inner[k, : k + 1] = shares
        left = float(np.linalg.norm(found))
        ended = left <= _ENOUGH * inner[0, 0]  # the vectors span a space that is closed
        if ended or k % _EVERY == 0:
            values, ways = np.linalg.eigh(inner[: k + 1, : k + 1])
            if ended or left * abs(ways[k, -1]) <= _ENOUGH * values[-1]:
                vector = known @ ways[:, -1]
                return float(values[-1]), vector / np.linalg.norm(vector)
        vectors[:, k + 1] = found / left
    return None
