# SPDX-License-Identifier: Apache-2.0
"""Calibration: what made the data is found again with honest intervals, and what is not in it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from model.fingers import helical_cable, make_finger, straight_cable

from ccr_ros.design.calibration import calibrate
from ccr_ros.design.calibration_model import Measurement, RowModel
from ccr_ros.design.calibration_result import student
from ccr_ros.model import Finger, FingerSolver, InvalidValue, NotConverged, Solution, UnknownName

TWO = make_finger(straight_cable(), helical_cable())
ONE = make_finger(straight_cable())
PULLS = ((0.002, 0.001), (0.006, 0.002), (0.003, 0.007), (0.008, 0.0), (0.001, 0.008))
EI, NU, STRETCH = 6e-3, 0.3, 2e-4
NOISE = (5e-4, 0.05)  # m, N


@cache
def poses(finger: Finger, nu: float, stretch: tuple[float, ...]) -> list[Solution]:
    """What the finger shows for the pulls; the pulls inside, q = p - k T, by plain iteration."""
    truth = replace(finger, poisson_ratio=nu, youngs_modulus=EI / finger.second_moment)
    found = []
    for pulls in PULLS:
        given = np.array(pulls[: len(finger.cables)])
        solver, inside = FingerSolver(truth), given
        for _ in range(12 if any(stretch) else 1):
            solution = solver.solve(inside)
            inside = given - np.array(stretch) * solution.tensions
        found.append(solution)
    return found


def measured(
    finger: Finger = TWO,
    nu: float = NU,
    stretch: float | tuple[float, float] = STRETCH,
    disks: Sequence[int] = (3, 6, 9),
    loads: bool = True,
    noise: tuple[float, float] = (0.0, 0.0),
    seed: int = 0,
) -> list[Measurement]:
    """Rows from the forward model, with noise of these standard deviations [m, N]."""
    rng = np.random.default_rng(seed)
    names = finger.cable_names
    each = stretch if isinstance(stretch, tuple) else (stretch,) * len(names)
    rows = []
    for number, (pulls, pose) in enumerate(zip(PULLS, poses(finger, nu, each), strict=True)):
        points = {d: pose.backbone[d] + noise[0] * rng.normal(size=3) for d in disks}
        tensions = zip(names, pose.tensions, strict=True)
        found = {n: float(t + noise[1] * rng.normal()) for n, t in tensions if t > 0.2}
        given = dict(zip(names, pulls, strict=False))
        rows.append(Measurement(finger, given, points, found if loads else {}, f"row {number}"))
    return rows


def test_exact_data_give_everything_back() -> None:
    found = calibrate(measured(), ("EI", "nu", "stretch"))
    assert not found.unknown
    values = {name: e.value for name, e in found.estimates.items()}
    assert values["EI"] == pytest.approx(EI, rel=1e-6)
    assert values["nu"] == pytest.approx(NU, abs=1e-5)
    assert values["stretch"] == pytest.approx(STRETCH, rel=1e-5)
    for e in found.estimates.values():
        assert e.low <= e.value <= e.high and not e.at_bound


def test_each_cable_has_a_stretch_of_its_own() -> None:
    rows = measured(stretch=(1e-4, 3e-4), nu=0.39)
    found = calibrate(rows, ("EI", "stretch_straight", "stretch_helical")).estimates
    assert found["stretch_straight"].value == pytest.approx(1e-4, rel=1e-4)
    assert found["stretch_helical"].value == pytest.approx(3e-4, rel=1e-4)


@pytest.mark.long
def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    """Of 12 noisy sets, 95 % intervals miss the truth 0.6 times on average; 4 have p = 0.002."""
    truth = {"EI": EI, "stretch": STRETCH}
    misses = dict.fromkeys(truth, 0)
    widths = []
    for seed in range(12):
        rows = measured(disks=(9,), nu=0.39, noise=NOISE, seed=seed)
        found = calibrate(rows, ("EI", "stretch"))
        for name, value in truth.items():
            e = found.estimates[name]
            misses[name] += not e.low <= value <= e.high
            widths.append((e.high - e.low) / value)
        assert found.position_scatter == pytest.approx(NOISE[0], rel=0.6)
        assert found.load_scatter == pytest.approx(NOISE[1], rel=0.7)
    assert max(misses.values()) <= 3, misses
    assert max(widths) < 0.6  # and they are not so wide that they say nothing


def test_noise_leaves_nu_uncertain_and_says_so() -> None:
    found = calibrate(measured(noise=NOISE), ("EI", "nu", "stretch")).estimates
    assert found["EI"].low < EI < found["EI"].high
    assert found["nu"].low < NU < found["nu"].high
    assert found["nu"].high - found["nu"].low > 0.2


def test_without_loads_only_the_product_of_stretch_and_stiffness_is_known() -> None:
    rows = measured(loads=False)
    found = calibrate(rows, ("EI", "nu", "stretch"))
    assert set(found.unknown) == {"EI", "stretch"} and "no load" in found.unknown["EI"]
    assert found.products["stretch"] == pytest.approx(EI * STRETCH, rel=1e-4)
    assert found.estimates["nu"].value == pytest.approx(NU, abs=1e-4)
    known = calibrate(rows, ("nu", "stretch"), stiffness=EI)
    assert known.estimates["stretch"].value == pytest.approx(STRETCH, rel=1e-4)
    assert not known.unknown


def test_planar_data_do_not_tell_nu() -> None:
    found = calibrate(measured(finger=ONE), ("EI", "nu", "stretch"))
    assert set(found.unknown) == {"nu"}
    assert found.estimates["EI"].value == pytest.approx(EI, rel=1e-5)
    assert found.estimates["stretch"].value == pytest.approx(STRETCH, rel=1e-4)


def test_one_load_for_two_parameters_is_not_enough() -> None:
    (row, *_) = measured(finger=ONE, disks=())
    found = calibrate([row], ("EI", "stretch"))
    assert set(found.unknown) == {"EI"} or set(found.unknown) == {"stretch"}
    alone = calibrate([row], ("EI",), load_scatter=0.1).estimates["EI"]
    assert alone.low < alone.value < alone.high  # the scatter is given, so there is an interval


def test_more_stretch_than_none_cannot_be_explained_by_less() -> None:
    """Pulls that are larger inside than at the far end: stretch ends at its bound, and says so."""
    rows = [
        replace(row, pulls={n: 0.8 * p for n, p in row.pulls.items()})
        for row in measured(finger=ONE, stretch=0.0)
    ]
    found = calibrate(rows, ("EI", "stretch"))
    assert found.estimates["stretch"].value == 0.0 and found.estimates["stretch"].at_bound


@pytest.mark.parametrize("stretch", [0.0, 3e-7])
def test_derivatives_of_what_a_row_shows(stretch: float) -> None:
    (row, *_) = measured(disks=(4, 9))
    model, step = RowModel(row), 1e-3
    s = np.array([stretch, 2 * stretch])
    middle = model.shown(s, 0.3)
    high, low = (model.shown(s, 0.3 + sign * step) for sign in (1, -1))
    nu = (high.points - low.points) / (2 * step)
    assert middle.points_by_nu == pytest.approx(nu, abs=1e-7) and np.abs(nu).max() > 1e-5
    assert middle.tensions_by_nu == pytest.approx(
        (high.tensions - low.tensions) / (2 * step), rel=1e-3, abs=1e-2
    )
    for cable in range(2):
        change = np.zeros(2)
        change[cable] = 1e-9
        more = model.shown(s + change, 0.3)
        assert middle.points_by_stretch[:, :, cable] == pytest.approx(
            (more.points - middle.points) / 1e-9, rel=1e-2, abs=2.0
        )
        assert middle.tensions_by_stretch[:, cable] == pytest.approx(
            (more.tensions - middle.tensions) / 1e-9, rel=1e-2, abs=1e6
        )


def test_quantiles_of_student() -> None:
    table = {1: 12.706, 5: 2.571, 10: 2.228, 11: 2.201, 20: 2.086, 60: 2.000, 1000: 1.962}
    for freedom, value in table.items():
        assert student(freedom) == pytest.approx(value, abs=1e-3)


@pytest.mark.parametrize(
    ("fit", "options", "word"),
    [
        ((), {}, "fit"),
        (("E",), {}, "'E'"),
        (("EI", "EI"), {}, "fit"),
        (("stretch", "stretch_helical"), {}, "one stretch for all"),
        (("stretch_main",), {}, "stretch_main"),
        (("EI",), {"load_scatter": 0.0}, "load_scatter"),
        (("EI",), {"position_scatter": math.nan}, "position_scatter"),
        (("EI",), {"stiffness": -1.0}, "stiffness"),
    ],
)
def test_bad_requests_are_refused(fit, options, word) -> None:
    rows = [Measurement(TWO, {}, {9: [0, 0, 0.182]}, {})]
    with pytest.raises(InvalidValue, match=word):
        calibrate(rows, fit, **options)
    with pytest.raises(InvalidValue, match="rows"):
        calibrate([])


@pytest.mark.parametrize(
    ("pulls", "positions", "loads", "word"),
    [
        ({}, {}, {}, "a position or a load"),
        ({"main": 0.1}, {}, {"straight": 1.0}, "main"),
        ({"straight": math.nan}, {}, {"straight": 1.0}, "row 7.pulls.straight"),
        ({}, {0: [0, 0, 0]}, {}, "disk"),
        ({}, {10: [0, 0, 0]}, {}, "disk"),
        ({}, {3: [0, 0]}, {}, r"positions\[3\]"),
        ({}, {}, {"main": 1.0}, "main"),
        ({}, {}, {"straight": -1.0}, "loads.straight"),
    ],
)
def test_bad_rows_are_refused(pulls, positions, loads, word) -> None:
    with pytest.raises((InvalidValue, UnknownName), match=word):
        Measurement(TWO, pulls, positions, loads, "row 7")


def test_pulls_that_no_pose_has_are_told_with_their_row() -> None:
    row = Measurement(TWO, {"straight": 0.17, "helical": 0.17}, {}, {"straight": 1.0}, "row 7")
    with pytest.raises(NotConverged, match="row 7"):
        calibrate([row])
