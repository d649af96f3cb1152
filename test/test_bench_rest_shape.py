# SPDX-License-Identifier: Apache-2.0
"""The benchmark of rest shapes: both ways end at the wanted shape, or say that they did not."""

import time

import numpy as np
import pytest

from benchmarks.measure import OWN, Plan, measure
from benchmarks.rest_shape import CURVES, EquilibriumSweeper, NestedSweeper, rest_case
from benchmarks.suites import plans


def small():
    """A finger of three segments, and an arc for it."""
    case, shape = rest_case("short")
    return case.finger, shape


@pytest.mark.parametrize("name", CURVES)
def test_our_row_reaches_the_wanted_shape(name):
    case, shape = rest_case(name)
    row = measure(
        Plan("rest-shape", OWN, case, lambda: EquilibriumSweeper(case.finger, shape), OWN, 2)
    )
    assert (row.steps, row.samples, row.converged) == (2, 2, 2)
    assert row.rms_mm < 1e-8 and row.rms_against == "reference"
    assert np.array_equal(case.truth, shape.points)


def test_nested_optimisation_ends_at_the_same_shape():
    finger, shape = small()
    nested = NestedSweeper(finger, shape, "least_squares")
    step = nested.step(0.03, time.perf_counter() + 600)
    assert step.finished and step.converged
    assert step.iterations > 12  # a gradient by differences, and more
    assert shape.squared_error(nested.backbone()) <= 1e-16


def test_a_deadline_ends_the_search():
    finger, shape = small()
    past = time.perf_counter() - 1
    assert not NestedSweeper(finger, shape, "slsqp").step(0.03, past).finished
    assert not EquilibriumSweeper(finger, shape).step(0.03, past).finished


def test_the_rows_that_are_planned():
    for quick, count in ((True, 2), (False, 9)):
        rows = [plan for plan in plans(quick) if plan.group == "rest-shape"]
        assert len(rows) == count and {plan.name for plan in rows} >= {OWN, rows[0].baseline}
