# SPDX-License-Identifier: Apache-2.0
"""Lanczos' method finds what a whole decomposition does."""

import numpy as np
import pytest

from ccr_ros.grasp.statics.lanczos import largest_pair


def symmetric(values, seed=2):
    rng = np.random.default_rng(seed)
    basis = np.linalg.qr(rng.standard_normal((len(values), len(values))))[0]
    return (basis * values) @ basis.T


@pytest.mark.parametrize(
    "values",
    [
        np.linspace(0.0, 1.0, 40) ** 4,
        np.append(np.ones(80), 3.0),
        np.array([2.0, 2.0, 2.0, 1.0, 0.0]),
        np.array([0.0, 0.0, 0.0, 7.0]),
        np.array([5.0]),
    ],
    ids=["spread", "many alike", "largest thrice", "rank one", "a number"],
)
def test_the_pair_is_the_decompositions(values):
    matrix = symmetric(values)
    value, vector = largest_pair(lambda x: matrix @ x, len(values))
    assert value == pytest.approx(max(values), rel=1e-9)
    assert np.linalg.norm(vector) == pytest.approx(1.0)
    assert np.linalg.norm(matrix @ vector - value * vector) <= 2e-5 * value


def test_what_has_not_converged_or_is_nothing_is_none():
    assert largest_pair(np.zeros_like, 4) is None
    crowded = np.linspace(0.0, 1.0, 100_000)
    assert largest_pair(lambda x: crowded * x, len(crowded)) is None
