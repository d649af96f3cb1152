# SPDX-License-Identifier: Apache-2.0
"""The benchmarks: exact derivatives, baselines that agree, rows that tell what was measured."""

import argparse
import json
import subprocess
import sys
from dataclasses import fields, replace

import numpy as np
import pytest

from benchmarks.__main__ import main as bench_main
from benchmarks.baselines import BASELINES, Ipopt
from benchmarks.cartesian import LITERAL, CartesianProblem, Formulation
from benchmarks.cases import CONTACT, TABLE_I, load_case, rms
from benchmarks.measure import OwnSweeper, Plan, Row, measure
from benchmarks.routing import measure_search, searches
from benchmarks.suites import COMPARED, GROUPS, cartesian, memory_plans, own, plans
from benchmarks.table import table
from benchmarks.tracking import (
    CASES,
    SOLVERS,
    follower,
    measure_track,
    track_finger,
    track_path,
    tracks,
)
from ccr_ros.cli import bench
from ccr_ros.cli.main import main as ccr_main

FORMULATIONS = [
    Formulation(angles, tangents, cable_model)
    for angles in ("relative", "literal")
    for tangents in ("chord", "spline")
    for cable_model in ("proportional", "frictionless")
]


def swept(baseline, pull, steps):
    for k in range(1, steps + 1):
        assert baseline.step(pull * k / steps).converged
    return baseline.problem.backbone(baseline.w)


def differences(function, w, step=1e-6):
    columns = [
        (np.asarray(function(w + e)) - np.asarray(function(w - e))) / (2 * step)
        for e in step * np.eye(w.size)
    ]
    return np.array(columns).T


@pytest.mark.parametrize("formulation", FORMULATIONS, ids=str)
def test_derivatives_match_finite_differences(formulation):
    problem = CartesianProblem(load_case("contact_sphere", 4).finger, formulation)
    rng = np.random.default_rng(7)
    w = problem.rest + 0.02 * rng.normal(size=problem.rest.size)
    p = problem.parameters(0.02, problem.rest + 0.02 * rng.normal(size=w.size))

    for function in (problem.objective, problem.g, problem.h):
        value, jacobian = (x.full() for x in function(w, p))
        numeric = differences(lambda x, f=function: f(x, p)[0].full().ravel(), w)
        exact = jacobian.T if value.size == 1 and jacobian.shape[0] != 1 else jacobian
        assert numeric == pytest.approx(exact, abs=1e-7)

    v = rng.normal(size=problem.equalities + problem.inequalities)

    def gradient(x):
        (_, df), (_, dg), (_, dh) = (
            [o.full() for o in f(x, p)] for f in (problem.objective, problem.g, problem.h)
        )
        return 2.0 * df.ravel() + v @ np.vstack([dg, dh])

    hessian = problem.lagrangian_hessian(w, p, 2.0, v).full()
    assert hessian == pytest.approx(differences(gradient, w), abs=1e-6)
    parts = 2.0 * problem.f_hessian(w, p)
    parts += problem.g_hessian(w, p, v[: problem.equalities])
    parts += problem.h_hessian(w, p, v[problem.equalities :])
    assert hessian == pytest.approx(parts.full(), abs=1e-12)


@pytest.mark.parametrize("name", ["helical", "prebent_2_left", "contact_cylinder"])
@pytest.mark.parametrize("formulation", FORMULATIONS[::2], ids=str)
def test_rest_shape_is_feasible_and_free_of_energy(name, formulation):
    problem = CartesianProblem(load_case(name).finger, formulation)
    p = problem.parameters(0.0, problem.rest)
    value, gradient = problem.objective(problem.rest, p)
    assert float(value) == pytest.approx(0.0, abs=1e-24)
    assert gradient.full() == pytest.approx(0.0, abs=1e-12)
    assert problem.g(problem.rest, p)[0].full() == pytest.approx(0.0, abs=1e-12)
    if problem.inequalities:
        assert problem.h(problem.rest, p)[0].full().min() > 0


def test_torsion_and_bending_are_told_apart():
    # Turn the tip disk of a straight finger about its backbone: pure twist of the last segment.
    finger = load_case("straight").finger
    problem = CartesianProblem(finger, Formulation(tangents="chord"))
    angle, w = 0.1, problem.rest.copy()
    arm = w[-3:] - w[-6:-3]
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    w[-3:] = w[-6:-3] + turn @ arm
    energy = float(problem.objective(w, problem.parameters(0.0, w))[0])
    assert energy == pytest.approx(angle**2 / 2 / (1 + finger.poisson_ratio), rel=1e-12)


@pytest.mark.parametrize("name", TABLE_I)
def test_cartesian_baseline_agrees_with_the_reference(name):
    case = load_case(name)
    backbone = swept(Ipopt(CartesianProblem(case.finger, COMPARED)), case.pull_fraction[0], 5)
    assert rms(backbone, case.truth) < 0.7e-3  # what nine spline segments are good for


@pytest.mark.parametrize("name", CONTACT)
def test_cartesian_baseline_agrees_with_the_reference_in_contact(name):
    case = load_case(name)
    baseline = Ipopt(CartesianProblem(case.finger, COMPARED))
    backbone = swept(baseline, case.pull_fraction[0], 10)
    assert rms(backbone, case.truth) < 0.3e-3
    distances = baseline.problem.h(baseline.w, case.pull_fraction)[0].full()
    assert np.count_nonzero(np.abs(distances) < 1e-6) == 1


@pytest.mark.parametrize("method", [m for m in BASELINES if m != "ipopt"])
@pytest.mark.parametrize("name", ["general_1", "contact_cylinder"])
def test_baselines_find_the_same_pose(method, name):
    case = load_case(name)
    poses = []
    for which in ("ipopt", method):
        baseline = BASELINES[which](CartesianProblem(case.finger, COMPARED))
        # Before the obstacle is met, where trust-constr takes its time.
        poses.append(swept(baseline, case.pull_fraction[0] / 4, 1))
    assert poses[0] == pytest.approx(poses[1], abs=1e-5)  # trust-constr's own accuracy


def test_literal_equation_4_is_far_off_where_relative_angles_are_not():
    case = load_case("general_1")
    pull = case.pull_fraction[0]
    literal = swept(Ipopt(CartesianProblem(case.finger, LITERAL)), pull, 10)
    relative = swept(Ipopt(CartesianProblem(case.finger, Formulation())), pull, 10)
    assert rms(literal, case.truth) > 19e-3
    assert rms(relative, case.truth) < 0.7e-3


def test_one_cable_to_the_tip_is_needed():
    with pytest.raises(ValueError, match="one cable, base to tip"):
        CartesianProblem(load_case("two_cables").finger)


@pytest.mark.parametrize("n", [30, 90])
def test_more_disks_keep_routing_and_rest_shape(n):
    old, new = load_case("general_1").finger, load_case("general_1", n).finger
    before = np.unwrap(old.cables[0].angles)
    every = n // 9 * 9 == n
    after = new.cables[0].angles
    assert after[[0, -1]] == pytest.approx(before[[0, -1]], abs=1e-12)
    assert np.abs(np.diff(after)).max() <= np.abs(np.diff(before)).max()
    if every:
        assert after[:: n // 9] == pytest.approx(before, abs=1e-12)
    old, new = load_case("prebent_1_left").finger, load_case("prebent_1_left", n).finger
    assert new.rest_curvature.mean(axis=0) == pytest.approx(old.rest_curvature.mean(axis=0))


def test_stopped_sweep_says_so_and_claims_no_error():
    case = load_case("straight")
    none = measure(
        Plan("sweep", "slsqp", case, cartesian(case, "slsqp"), "ipopt", steps=3, cap=0.0)
    )
    assert (none.steps, none.p50_ms, none.rms_mm) == (0, None, None)
    assert none.note == "0 steps of 3, stopped at 0 s"
    assert none.stopped_after_s == 0.0

    class Stalls(OwnSweeper):
        def step(self, pull, deadline):
            return super().step(pull, -np.inf if pull > 0.04 else deadline)

    some = measure(Plan("sweep", "x", case, lambda: Stalls(case.finger), "ipopt", 5, 4, cap=9.0))
    assert (some.steps, some.samples, some.rms_mm) == (4, 4, None)
    assert some.note == "4 steps of 5, stopped at 9 s"


def test_row_that_did_not_converge_says_so():
    case = load_case("straight")

    class Fails(OwnSweeper):
        def step(self, pull, deadline):
            step = super().step(pull, deadline)
            return replace(step, converged=pull < 0.03)

    row = measure(Plan("sweep", "x", case, lambda: Fails(case.finger), "ipopt", 5))
    assert (row.samples, row.converged) == (5, 2)
    assert "3 of 5 steps not converged" in row.note


def test_every_repeat_is_timed():
    case = load_case("straight")
    row = measure(Plan("sweep", "ccr_ros", case, own(case), "ipopt", 3, 4, repeat_seconds=60.0))
    assert (row.steps, row.samples, row.converged) == (3, 12, 12)
    assert 0 < row.p50_ms <= row.p99_ms
    assert row.rms_percent < 0.1


def test_full_plan_covers_what_is_promised():
    ids = {plan.id for plan in plans(quick=False)}
    for name in TABLE_I + CONTACT:
        for n in (9, 30, 90):
            assert {f"sweep/{name}/n{n}/ccr_ros", f"sweep/{name}/n{n}/ipopt"} <= ids
        assert {f"sweep/{name}/n9/trust-constr", f"sweep/{name}/n9/slsqp"} <= ids
    others = {"memory", "transport", "pulls", "routing", "grasp"}
    assert {plan.group for plan in plans(quick=False)} | others == set(GROUPS)
    assert len(ids) == len(list(plans(quick=False)))
    assert len(set(memory_plans(quick=False))) == len(memory_plans(quick=False))
    for quick in (False, True):
        listed = [
            (p.group, p.case.name, p.case.finger.segments, p.name, p.baseline) for p in plans(quick)
        ]
        names = {row[:4] for row in listed}
        assert all((*row[:3], row[4]) in names for row in listed)


def run_bench(*flags):
    command = [sys.executable, "-m", "ccr_ros.cli", "bench", *flags]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=bench.CHECKOUT)


@pytest.mark.long
@pytest.mark.timeout(600)
def test_quick_bench_end_to_end():
    done = run_bench("--quick", "--json")
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert result["mode"] == "quick"
    assert result["threads"] == "1"
    rows = [Row(**row) for row in result["rows"]]
    assert set(result["rows"][0]) == {f.name for f in fields(Row)} - {"backbone"}
    assert {row.group for row in rows} == set(GROUPS)
    by_id = {row.id: row for row in rows}
    assert len(by_id) == len(rows)
    for row in rows:
        if row.group == "memory":
            assert row.memory_mb > 0
        elif row.group == "transport":
            assert row.p99_ms >= row.p50_ms > 0
            assert row.cpu_ms > 0
        elif row.group in ("pulls", "grasp"):
            assert row.steps == row.converged == row.steps_wanted
            assert row.p99_ms >= row.p50_ms > 0
        elif row.group == "routing":
            assert row.p99_ms >= row.p50_ms > 0
            assert f"{row.converged} of {row.samples} found" in row.note
        elif row.steps < row.steps_wanted:
            assert row.note.startswith(f"{row.steps} steps of {row.steps_wanted}, stopped at")
        else:
            assert row.p99_ms >= row.p50_ms > 0
            assert row.rms_mm is not None or row.n != 9
        if row.name == row.baseline:
            assert row.ratio == 1.0
        if row.group == "sweep" and row.name == "ccr_ros" and row.n == 9:
            assert row.rms_percent < 0.1
            assert row.converged == row.samples
    assert by_id["sweep/contact_cylinder/n9/ccr_ros"].contact
    assert by_id["sweep/straight/n30/ipopt"].rms_against == "ccr_ros"
    frictionless, proportional = (
        by_id[f"cable-model/general_1/n9/ccr_ros, {model}"]
        for model in ("frictionless", "proportional")
    )
    assert proportional.rms_mm > 0.25 > frictionless.rms_mm
    text = table(rows)
    for row in rows:
        assert row.name in text
        assert row.note in text


def test_table_shows_selected_rows(capsys):
    assert bench_main(["--quick", "--rows", "sweep/straight/n9/*t*"]) == 0
    text = capsys.readouterr().out
    assert "trust-constr" in text
    assert "ccr_ros  " not in text
    assert "straight, n = 9\n" in text
    assert "Lower is better" in text


def test_no_matching_row_is_an_error(capsys):
    assert bench_main(["--rows", "no-such-row"]) == 2
    assert "no row matches 'no-such-row'" in capsys.readouterr().err


@pytest.mark.parametrize("missing", ["benchmarks", "scipy"])
def test_what_is_missing_is_said_in_one_line(missing, monkeypatch, tmp_path, capsys):
    if missing == "benchmarks":
        monkeypatch.setattr(bench, "CHECKOUT", tmp_path)
    else:
        monkeypatch.setattr(bench.importlib.util, "find_spec", lambda name: None)
    assert ccr_main(["bench", "--quick"]) == 2
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1
    assert "checkout" in captured.err if missing == "benchmarks" else "SciPy" in captured.err


def test_flags_reach_the_benchmarks(monkeypatch):
    seen = {}

    def fake(command, env, check):
        seen.update(command=command, env=env)
        return subprocess.CompletedProcess(command, 1)

    monkeypatch.setattr(bench.subprocess, "run", fake)
    parser = argparse.ArgumentParser()
    bench.add_arguments(parser)
    assert bench.run(parser.parse_args(["--quick", "--rows", "eq4"])) == 1
    assert seen["command"][2:] == ["benchmarks", "--quick", "--rows", "eq4"]
    assert seen["env"]["OMP_NUM_THREADS"] == "1"


@pytest.mark.parametrize("case", CASES)
def test_trackers_bring_the_tip_to_the_same_points(case):
    path = track_path(case, 60)[:4]
    assert np.linalg.norm(np.diff(path, axis=0), axis=1).min() > 1e-4
    for solver in SOLVERS[: 3 if case == "two_cables" else 1]:
        follow = follower(solver, track_finger(case))
        for point in path:
            tip, count = follow(point)
            assert tip == pytest.approx(point, abs=2e-7) and count < 100


def test_a_tracked_row_tells_points_a_second():
    row = next(t for t in tracks(quick=True) if t.solver == "ccr_ros").row()
    measure_track(row, quick=True)
    assert (row.steps, row.converged, row.samples) == (24, 24, 24)
    assert row.p50_ms > 0 and row.cpu_ms > 0 and 1 <= row.iterations <= 3
    assert "points a second" in row.note and row.id == "pulls/two_cables/n9/ccr_ros"


def test_a_row_of_searched_routings_tells_how_many_are_found():
    plans = {(s.case, s.solver): s for s in searches(quick=False)}
    assert {case for case, _ in plans} == {"table_i", "random"}
    row = plans["table_i", "ccr_ros"].row()
    measure_search(row, quick=True)
    assert (row.steps, row.converged, row.samples) == (3, 3, 3)
    assert row.p50_ms > 0 and row.cpu_ms > 0 and "3 of 3 found" in row.note


@pytest.mark.parametrize("solver", [s.solver for s in searches(quick=True)][1:])
def test_nested_searches_of_routings_end_at_their_cap(solver, monkeypatch):
    monkeypatch.setattr("benchmarks.routing._QUICK_CAP", 0.1)
    row = next(s for s in searches(quick=True) if s.solver == solver).row()
    measure_search(row, quick=True)
    assert row.samples == 3 and 0 <= row.converged <= 3 and row.iterations >= 2
    assert "stopped at 0.1 s" in row.note
