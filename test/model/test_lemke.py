# SPDX-License-Identifier: Apache-2.0
"""Linear complementarity problems that are not symmetric: solved where they have a solution."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ccr_ros.model.lemke import lemke
from ccr_ros.model.qp import _pivoted, solve_multipliers

SEEDS = st.integers(0, 2**32 - 1)


def is_solution(s, t, m, tolerance=1e-9):
    slack = s @ m + t
    size = max(1.0, float(np.abs(m).max()), float(np.abs(s).max() * np.abs(m).max()))
    return (
        m.min() >= 0
        and slack.min() > -tolerance * size
        and np.abs(m * slack).max() < (tolerance * size * size)
    )


@settings(max_examples=60, deadline=None)
@given(seed=SEEDS, count=st.integers(1, 12))
def test_what_has_a_solution_for_sure_is_solved(seed, count):
    """With no negative entry and a positive diagonal S is strictly copositive."""
    rng = np.random.default_rng(seed)
    s = rng.random((count, count)) * (rng.random((count, count)) < 0.6)
    s += np.diag(0.05 + rng.random(count))
    t = rng.standard_normal(count)
    found = lemke(s, t)
    assert found is not None and is_solution(s, t, found)


@settings(max_examples=60, deadline=None)
@given(seed=SEEDS, count=st.integers(1, 8))
def test_where_there_is_but_one_it_is_that(seed, count):
    """The symmetric part of S is positive definite: there is one solution; all sets are tried."""
    rng = np.random.default_rng(seed)
    half = rng.standard_normal((count, count))
    turn = rng.standard_normal((count, count))
    s = half @ half.T + 0.1 * np.eye(count) + turn - turn.T
    t = rng.standard_normal(count)
    wanted = None
    for size in range(count + 1):
        for chosen in combinations(range(count), size):
            m = np.zeros(count)
            index = np.array(chosen, dtype=int)
            m[index] = np.linalg.solve(s[np.ix_(index, index)], -t[index])
            if (m >= 0).all() and (s @ m + t > -1e-10).all():
                wanted = m
    assert np.allclose(lemke(s, t), wanted, atol=1e-7 * max(1.0, np.abs(wanted).max()))
    assert np.allclose(
        solve_multipliers(s, t, t < 0, symmetric=False),
        wanted,
        atol=1e-7 * max(1.0, np.abs(wanted).max()),
    )


def test_scales_do_not_count():
    rng = np.random.default_rng(3)
    half = rng.standard_normal((5, 5))
    s, t = half @ half.T + np.triu(np.ones((5, 5))), rng.standard_normal(5)
    unit = np.array([1e-6, 1.0, 1e4, 1e-3, 1e2])
    plain, scaled = lemke(s, t), lemke(s * unit * unit[:, None], t * unit)
    assert np.allclose(scaled * unit, plain, rtol=1e-8)


def test_pivots_that_go_round_are_no_end():
    s = np.array([[2.0, -1.0, 3.0], [-2.0, 2.0, 3.0], [1.0, 3.0, 2.0]])
    t = np.array([-1.0, -3.0, -2.0])
    guess = np.ones(3, dtype=bool)
    assert _pivoted(s, t, guess) is None
    found = solve_multipliers(s, t, guess, symmetric=False)
    assert np.allclose(found, [2.5, 4.0, 0.0]) and is_solution(s, t, found)


def test_what_has_no_solution_ends():
    assert lemke(np.array([[-1.0, 0.0], [0.0, 1.0]]), np.array([-1.0, 1.0])) is None
    assert lemke(np.zeros((2, 2)), np.array([-1.0, 1.0])) is None


@pytest.mark.parametrize("t", [[0.0, 2.0], []])
def test_what_is_not_violated_needs_no_force(t):
    found = lemke(np.eye(len(t)), np.array(t))
    assert found.shape == (len(t),) and not found.any()
