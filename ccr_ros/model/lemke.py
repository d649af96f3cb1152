# SPDX-License-Identifier: Apache-2.0
"""Lemke's method for linear complementarity problems, which need not be symmetric.

    m >= 0,   S m + t >= 0,   m'(S m + t) = 0

A variable z0 that lifts all of S m + t + z0 out of the negative is driven to zero: of each pair of
a multiplier and its slack one is in the basis, and as one leaves, its partner enters. With sliding
friction principal pivots may go round for ever; Lemke's path does not come back (Cottle, Pang,
Stone: The Linear Complementarity Problem, section 4.4).
"""

from __future__ import annotations

import numpy as np

_PIVOT = 1e-11  # smallest entry of a scaled column that may be divided by
_TIED = 1e-12  # relative; ratios as near as this are the same
_PER_ROW = 10  # pivots for each row, before it is given up


def lemke(s: np.ndarray, t: np.ndarray) -> np.ndarray | None:
    """Return multipliers (c,), or None where the path ends in a ray or is too long.

    Args:
        s: (c, c), finite.
        t: (c,) with it.
    """
    count = len(t)
    if not count or t.min() >= 0.0:
        return np.zeros(count)
    unit = 1.0 / np.sqrt(np.maximum(np.abs(np.diag(s)), 1e-300))
    scale = float((-t * unit).max())
    # Columns: slacks, multipliers, z0, right-hand side; rows: the basis.
    last = 2 * count
    table = np.empty((count, last + 2))
    table[:, :count], table[:, count:last] = np.eye(count), -s * unit * unit[:, None]
    table[:, last], table[:, -1] = -1.0, t * unit / scale
    basis = np.arange(count)
    row, enters = int(table[:, -1].argmin()), last
    for _ in range(_PER_ROW * count + 2):
        leaves, basis[row] = int(basis[row]), enters
        table[row] /= table[row, enters]
        factors = table[:, enters].copy()
        factors[row] = 0.0
        table -= factors[:, None] * table[row]
        if leaves == last:
            found = np.zeros(2 * count)
            found[basis] = np.maximum(table[:, -1], 0.0)
            return found[count:] * unit * scale
        enters = leaves + count if leaves < count else leaves - count
        column = table[:, enters]
        able = np.flatnonzero(column > _PIVOT)
        if not len(able):
            return None
        ratios = table[able, -1] / column[able]
        tied = able[ratios <= ratios.min() + _TIED * max(1.0, abs(float(ratios.min())))]
        ends = tied[basis[tied] == last]
        row = int(ends[0]) if len(ends) else int(tied[column[tied].argmax()])
    return None
