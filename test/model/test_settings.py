# SPDX-License-Identifier: Apache-2.0
import dataclasses
import math

import numpy as np
import pytest

from ccr_ros.model import InvalidValue, SolverSettings


@pytest.mark.parametrize(
    ("key", "good", "bad"),
    [
        ("arcs_per_segment", [1, 64, np.int64(2)], [0, -1, 65, 1.0, True, "1", None]),
        ("curvature_order", [0, 1], [-1, 2, 0.5, False]),
        ("cable_model", ["frictionless", "proportional"], ["", "Frictionless", None, 3]),
        ("max_pull_step", [1e-6, 1], [0, -1, 1.1, math.nan, "0.1"]),
        ("max_iterations", [1, 10_000], [0, -5, 2.5, None]),
        ("tolerance", [1e-14, 1e-3], [0, -1e-9, 1e-2, math.inf, math.nan]),
        ("time_limit", [1e-3, 3600], [0, -1, math.inf, math.nan, True]),
    ],
)
def test_bounds(key, good, bad):
    for value in good:
        assert getattr(SolverSettings(**{key: value}), key) == value
    for value in bad:
        with pytest.raises(InvalidValue) as caught:
            SolverSettings(**{key: value})
        assert (caught.value.place, str(caught.value.value)) == (key, str(value))


def test_settings_do_not_change_and_compare_by_value():
    with pytest.raises(dataclasses.FrozenInstanceError):
        SolverSettings().tolerance = 1.0
    assert SolverSettings(arcs_per_segment=2) == SolverSettings(arcs_per_segment=2)
    assert SolverSettings() != SolverSettings(arcs_per_segment=2)
