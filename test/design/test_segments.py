# SPDX-License-Identifier: Apache-2.0
"""Segments of a finger: their derivatives, and the chain of them against the forward model."""

from __future__ import annotations

import numpy as np
import pytest
from model.fingers import helical_cable, make_finger, straight_cable

from ccr_ros.design.segments import SegmentModel
from ccr_ros.model import FingerSolver

RNG = np.random.default_rng(4)
STEP = 1e-6


def random_segments(model: SegmentModel, count: int, cables: int = 2):
    z = RNG.normal(scale=0.1, size=(count, model.size))
    start, end = RNG.uniform(0, 2 * np.pi, (2, count, cables))
    return z, start, end, RNG.uniform(0, 40, (count, cables))


@pytest.mark.parametrize("segments", [9, 30])  # of linear and of constant curvature
def test_derivatives_are_those_of_finite_differences(segments):
    model = SegmentModel(make_finger(straight_cable(disks=segments + 1), segments=segments))
    z, start, end, tensions = random_segments(model, 20)
    at = model.evaluate(z, start, end)
    hessian = model.hessian(at, tensions)
    for k, unit in enumerate(np.eye(model.size)):
        plus = model.evaluate(z + STEP * unit, start, end)
        minus = model.evaluate(z - STEP * unit, start, end)
        slope = (plus.lengths - minus.lengths) / (2 * STEP)
        assert slope == pytest.approx(at.gradient[:, :, k], abs=1e-9)
        moved = (plus.translation - minus.translation) / (2 * STEP)
        assert moved == pytest.approx(at.twists[:, 3:, k], abs=1e-9)
        bend = np.einsum("kc,kcs->ks", tensions, plus.gradient - minus.gradient) / (2 * STEP)
        exact = bend * model.scale[k] * model.scale + unit
        assert exact == pytest.approx(hessian[:, k], abs=1e-7)


@pytest.mark.parametrize("count", [1, 16, 17, 300])
def test_many_at_once_are_as_one_by_one(count):
    model = SegmentModel(make_finger())
    z, start, end, tensions = random_segments(model, count)
    together = model.evaluate(z, start, end)
    alone = [model.evaluate(z[i : i + 1], start[i : i + 1], end[i : i + 1]) for i in range(count)]
    assert together.lengths == pytest.approx(np.concatenate([a.lengths for a in alone]), abs=1e-14)
    rotations = np.concatenate([a.rotation for a in alone])
    assert together.rotation == pytest.approx(rotations, abs=1e-14)
    hessian = model.hessian(together, tensions)
    last = model.hessian(alone[-1], tensions[-1:])
    assert hessian[-1:] == pytest.approx(last, abs=1e-12)


@pytest.mark.parametrize("bent", [False, True])
@pytest.mark.parametrize("segments", [9, 30])
def test_a_chain_of_segments_is_the_finger(segments, bent):
    """Under the forward model's tensions the segments give its disks, to rounding."""
    cables = (
        straight_cable(disks=segments + 1),
        helical_cable() if segments == 9 else straight_cable(9, segments + 1, "other"),
    )
    rest = RNG.normal(scale=3.0, size=(segments, 3)) if bent else None
    finger = make_finger(*cables, segments=segments, rest_curvature=rest)
    solution = FingerSolver(finger).solve([0.003, 0.002])
    tensions = solution.tensions * finger.length**2 / finger.bending_stiffness
    assert (tensions > 0).all()
    model = SegmentModel(finger)
    angles = np.array([c.angles for c in finger.cables]).T
    spread = np.tile(tensions, (segments, 1))
    at, _, good = model.solve(model.rest, angles[:-1], angles[1:], spread)
    assert good.all()
    rotation, position = np.eye(3), np.zeros(3)
    for i in range(segments):
        position = position + rotation @ at.translation[i]
        rotation = rotation @ at.rotation[i]
        assert position * finger.length == pytest.approx(solution.backbone[i + 1], abs=1e-9)
    assert rotation == pytest.approx(solution.frames[-1], abs=1e-7)
    assert at.lengths.sum(axis=0) * finger.length == pytest.approx(
        FingerSolver(finger).rest_lengths - solution.pulls, abs=1e-9
    )


def test_what_a_tension_changes_is_that_of_finite_differences():
    model = SegmentModel(make_finger(rest_curvature=RNG.normal(scale=3.0, size=(9, 3))))
    _, start, end, tensions = random_segments(model, 9)
    at, hessian, good = model.solve(model.rest, start, end, tensions)
    assert good.all()
    change = model.per_tension(at, hessian)
    for c, unit in enumerate(np.eye(2)):
        plus, _, _ = model.solve(model.rest, start, end, tensions + 1e-4 * unit)
        minus, _, _ = model.solve(model.rest, start, end, tensions - 1e-4 * unit)
        assert (plus.z - minus.z) / 2e-4 == pytest.approx(change[:, :, c], abs=1e-8)


def test_a_tension_beyond_reason_is_not_called_an_equilibrium():
    model = SegmentModel(make_finger())
    _, start, end, _ = random_segments(model, 4)
    _, _, good = model.solve(model.rest[:4], start, end, np.full((4, 2), np.nan))
    assert not good.any()
