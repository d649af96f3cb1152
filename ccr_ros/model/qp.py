# SPDX-License-Identifier: Apache-2.0
"""The QP of one SQP step, by its few multipliers.

    min_d  1/2 d'Hd + g'd   subject to   A d <= r

A finger has many coordinates and few constraints, so what is handed on is the Gram matrix
S = A H^-1 A' and the residual t = r + A H^-1 g. If the constraints that were active still are, a
linear solve gives the multipliers; else CasADi's DAQP (a dual active-set method) finds which are,
as the least-distance problem   min 1/2 w'w  subject to  M w <= t,  M M' = S.
"""

from __future__ import annotations

from functools import lru_cache

import casadi as ca
import numpy as np

from .lemke import lemke

# T L^2 / EI; a straight finger pulled by 5 % has 25. Beyond this the shift below is what answers,
# because the constraints contradict each other.
_LARGEST = 1e8


def solve_multipliers(
    s: np.ndarray, t: np.ndarray, active: np.ndarray, symmetric: bool = True
) -> np.ndarray | None:
    """Return the multipliers m >= 0 with S m + t >= 0 and m'(S m + t) = 0, or None if infeasible.

    Args:
        s: (c, c) Gram matrix of the constraints, positive semidefinite.
        t: (c,) their residuals at the unconstrained minimum; negative where violated.
        active: (c,) bool, a guess at which multipliers are positive.
        symmetric: Whether S is; with sliding friction it is not, and there is no QP behind it.
    """
    count = len(t)
    if count == 0:
        return np.zeros(0)
    guess = _held(s, t, active)
    if guess is not None:
        return guess
    if not symmetric:
        found = _pivoted(s, t, active)
        found = lemke(s, t) if found is None else found
        if found is not None and float(found.max()) < _LARGEST:
            return found
        s = 0.5 * (s + s.T)  # near enough to go on from
    unit = 1.0 / np.sqrt(np.maximum(np.diag(s), 1e-300))
    # Twin or redundant points make S singular; the shift gives the least multipliers among equals.
    scaled = s * unit[:, None] * unit[None, :] + 1e-11 * np.eye(count)
    try:
        factor = np.linalg.cholesky(scaled)
    except np.linalg.LinAlgError:
        return None
    # In units of the largest violation: DAQP's tolerances are absolute.
    scale = float(np.max(-t * unit))
    if scale <= 0.0:
        return np.zeros(count)
    size = 1 << max(2, (count - 1).bit_length())
    rows, upper = np.zeros((size, size)), np.full(size, np.inf)
    rows[:count, :count], upper[:count] = factor, t * unit / scale
    solver = _daqp(size)
    result = solver(h=np.eye(size), a=rows, uba=upper, lba=-np.inf, lbx=-np.inf, ubx=np.inf)
    if not solver.stats()["success"]:
        return None
    found = np.maximum(np.asarray(result["lam_a"]).ravel()[:count] * unit * scale, 0.0)
    polished = _held(s, t, found > 0)
    best = found if polished is None else polished
    return best if float(best.max()) < _LARGEST else None


@lru_cache(maxsize=16)
def _daqp(size: int) -> ca.Function:
    dense = ca.Sparsity.dense(size, size)
    options = {"error_on_fail": False}
    return ca.conic(
        f"multipliers_{size}", "daqp", {"h": ca.Sparsity.diag(size), "a": dense}, options
    )


def _pivoted(s: np.ndarray, t: np.ndarray, active: np.ndarray) -> np.ndarray | None:
    """Multipliers by principal pivots from a guess, worst first; None where these go round."""
    count = len(t)
    inside, seen = active.copy(), set()
    tolerance = 1e-12 * max(1.0, float(np.abs(t).max()))
    diagonal = np.diag(s)
    shift, unit = 1e-12 * np.abs(diagonal), np.sqrt(np.maximum(diagonal, 1e-300))
    while (state := inside.tobytes()) not in seen:
        seen.add(state)
        index = np.flatnonzero(inside)
        multipliers = np.zeros(count)
        if len(index):
            block = s[index[:, None], index]
            block[np.arange(len(index)), np.arange(len(index))] += shift[index]
            try:
                multipliers[index] = np.linalg.solve(block, -t[index])
            except np.linalg.LinAlgError:
                return None
        slack = s @ multipliers + t
        wrong = np.where(inside, multipliers, slack)
        wrong[~inside & (slack > -tolerance)] = 0.0
        if wrong.min() >= 0:
            return multipliers
        change = int(np.argmin(np.where(inside, wrong * unit, wrong / unit)))  # alike in units
        inside[change] = not inside[change]
    return None


def _held(s: np.ndarray, t: np.ndarray, active: np.ndarray) -> np.ndarray | None:
    """The multipliers if exactly ``active`` are positive; None if that is not the solution."""
    index = np.flatnonzero(active)
    multipliers = np.zeros(len(t))
    if len(index) == 1:
        i = index[0]
        multipliers[i] = -t[i] / s[i, i] if s[i, i] > 0 else -1.0
    elif len(index):
        try:
            multipliers[index] = np.linalg.solve(s[index[:, None], index], -t[index])
        except np.linalg.LinAlgError:
            return None
    if multipliers.min() < 0:
        return None
    slack = s @ multipliers + t
    slack[index] = 0.0
    return multipliers if slack.min() >= -1e-12 * max(1.0, float(np.abs(t).max())) else None
