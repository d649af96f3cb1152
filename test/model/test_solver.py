# SPDX-License-Identifier: Apache-2.0
"""The solver where it is hard: slack, contact that comes and goes, saddles, jumps, bad pulls."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ccr_ros.model import (
    Box,
    FingerSolver,
    InvalidValue,
    NotConverged,
    Plane,
    Solution,
    SolverSettings,
    Sphere,
    UnknownName,
    load_finger,
    solve,
)
from ccr_ros.model.qp import solve_multipliers
from ccr_ros.resources import find_config

from .fingers import helical_cable, make_finger, reference, reference_finger, rms, straight_cable


def test_rest_is_rest() -> None:
    solver = FingerSolver(make_finger())
    solution = solver.solve([0.0])
    assert solution.certificate.converged and solution.certificate.stable
    assert solution.certificate.smallest_eigenvalue == pytest.approx(1.0)
    assert solution.backbone[:, 2] == pytest.approx(np.linspace(0, 0.182, 10))
    assert solution.energy == 0.0 and solution.tensions.tolist() == [0.0]


def test_paid_out_cable_is_slack() -> None:
    solution = solve(make_finger(), [-0.01])
    assert solution.certificate.converged
    assert solution.slack.tolist() == [True]
    assert solution.backbone == pytest.approx(FingerSolver(make_finger()).rest.backbone)


def test_a_cable_pulls_and_never_pushes() -> None:
    """A cable at 120 degrees is slack while paid out; held short, it bends the finger."""
    finger = make_finger(straight_cable(1, name="near"), straight_cable(5, name="far"))
    solution = solve(finger, {"near": 0.006, "far": -0.02})
    assert solution.tensions[0] > 0 and solution.tensions[1] == 0
    alone = solve(make_finger(straight_cable(1, name="near")), [0.006])
    assert solution.backbone == pytest.approx(alone.backbone, abs=1e-10)
    held = solve(finger, {"near": 0.006, "far": -0.002})
    assert held.certificate.converged and held.certificate.stable
    assert held.tensions[1] > 0
    assert held.backbone[-1, 1] > 0.01  # towards the far cable, which the near one alone is not


def test_short_cable_leaves_the_rest_of_the_finger_straight() -> None:
    solution = solve(make_finger(straight_cable(1, 6)), [0.004])
    beyond = np.diff(solution.backbone[5:], axis=0)
    assert np.linalg.norm(np.cross(beyond[:-1], beyond[1:]), axis=1).max() < 1e-12
    assert len(solution.cables["straight"]) == 6


def test_pulls_by_name_or_in_order() -> None:
    finger = load_finger(find_config("two_cables"))
    by_name = solve(finger, {"helical": 0.003})
    in_order = solve(finger, (0.0, 0.003))
    assert by_name.backbone == pytest.approx(in_order.backbone)


@pytest.mark.parametrize(
    "pulls",
    [
        [math.nan], [math.inf], [-math.inf], [0.1, 0.1], [], ["0.1"], [None], [True], 0.01, "main",
        [[0.01]], [0.2], [-1.0], None, [10**400],
    ],
)  # fmt: skip
def test_bad_pulls_are_refused_and_move_nothing(pulls: object) -> None:
    solver = FingerSolver(make_finger())
    before = solver.solve([0.005])
    with pytest.raises(InvalidValue) as error:
        solver.solve(pulls)  # type: ignore[arg-type]
    assert error.value.place.startswith("pulls")
    after = solver.solve([0.005])
    assert after.certificate.iterations == 0
    assert np.array_equal(after.backbone, before.backbone)


def test_unknown_cable_lists_the_valid_ones() -> None:
    with pytest.raises(UnknownName, match="unknown cable 'tendon'; valid: helical"):
        solve(make_finger(), {"tendon": 0.001})


def test_unreachable_pulls_say_how_far_it_went_and_move_nothing() -> None:
    """In a square tube with half a millimetre to spare a finger cannot bend much."""
    tube = tuple(
        Plane(-0.0085 * np.array(n), np.array(n), name=f"wall_{i}")
        for i, n in enumerate([(1.0, 0, 0), (-1.0, 0, 0), (0, 1.0, 0), (0, -1.0, 0)])
    )
    finger = make_finger(straight_cable(1), obstacles=tube)
    solver = FingerSolver(finger)
    before = solver.solve([1e-5])
    assert before.certificate.converged
    solution = solver.solve([0.02])
    c = solution.certificate
    assert not c.converged
    assert "straight=" in c.message and "Pull less" in c.message
    with pytest.raises(NotConverged, match="% of the way"):
        solution.require_converged()
    # What is shown is a true equilibrium on the way, not beyond it.
    assert solution.energy >= before.energy
    assert c.cable_error < 1e-9 and c.kkt < 1e-8 and c.penetration < 1e-9
    again = solver.solve([1e-5])
    assert again.certificate.iterations == 0
    assert np.array_equal(again.backbone, before.backbone)


def test_what_is_shown_after_a_failed_leap_is_an_equilibrium() -> None:
    finger = make_finger(*(straight_cable(h, name=f"c{h}") for h in (1, 5, 9)))
    solver = FingerSolver(finger, SolverSettings(time_limit=30))
    c = solver.solve([0.0055] * 3).certificate
    assert c.kkt < 1e-8 and c.cable_error < 1e-9
    assert c.converged or "% of the way" in c.message


def test_walls_through_the_base_are_refused() -> None:
    """A finger that has no room at its base has no pose."""
    walls = tuple(
        Plane(np.array([x, 0, 0]), np.array([-np.sign(x), 0, 0]), name=f"wall_{i}")
        for i, x in enumerate((0.0079, -0.0079))
    )
    with pytest.raises(InvalidValue, match="base disk"):
        FingerSolver(make_finger(straight_cable(1), obstacles=walls))


def test_time_limit_ends_a_solve() -> None:
    solver = FingerSolver(make_finger(), SolverSettings(time_limit=1e-9))
    c = solver.solve([0.09]).certificate
    assert not c.converged and "time limit" in c.message


def test_antagonist_and_cable_of_opposite_holes_are_one_point() -> None:
    """Two cables in opposite holes: each one's antagonist is the other's point."""
    wall = Plane(np.array([0.03, 0, 0]), np.array([-1.0, 0, 0]))
    finger = make_finger(
        straight_cable(1, name="near"), straight_cable(7, name="far"), obstacles=(wall,)
    )
    solution = solve(finger, {"near": 0.005, "far": -0.01})
    assert solution.certificate.converged
    assert [(c.disk, c.point, c.cable) for c in solution.contacts] == [(9, "cable", "near")]
    assert solution.antagonists["near"] == pytest.approx(solution.cables["far"])


def test_head_on_contact_is_told_to_be_unstable() -> None:
    """In its plane a finger pressed onto a ball is a saddle: it would slip off to one side."""
    ball = Sphere(np.array([0, 0.09, 0.13]), 0.03)
    solver = FingerSolver(replace(load_finger(find_config("straight")), obstacles=(ball,)))
    free = solver.solve([0.005])
    assert free.certificate.stable and not free.contacts
    pressed = solver.solve([0.0085])
    assert pressed.certificate.converged and pressed.contacts
    assert not pressed.certificate.stable
    assert pressed.certificate.smallest_eigenvalue < 0
    assert "disturbance" in pressed.certificate.message


def test_slipping_off_a_ball_is_reported_as_a_jump() -> None:
    """Pulled over a ball, the finger presses harder on it until it snaps to another pose."""
    ball = Sphere(np.array([0, 0.04, 0.15]), 0.02)
    solver = FingerSolver(make_finger(straight_cable(), obstacles=(ball,)))
    poses = [solver.solve([p]) for p in np.linspace(0.001, 0.012, 23)]
    assert all(p.certificate.converged for p in poses)
    jumps = [p for p in poses if p.certificate.branch_jump]
    far = np.array([rms(a.backbone, b.backbone) for a, b in itertools.pairwise(poses)])
    assert len(jumps) == 1
    assert "snapped" in jumps[0].certificate.message
    assert jumps[0].certificate.stable
    assert int(np.argmax(far)) + 1 == poses.index(jumps[0])
    assert far.max() > 5 * np.median(far)
    # Before it snapped, the pose was told to be a saddle; and at the end the ball is left behind.
    assert not poses[poses.index(jumps[0]) - 1].certificate.stable
    assert not poses[-1].contacts


def test_object_appears_and_goes() -> None:
    solver = FingerSolver(load_finger(find_config("helical")))
    free = solver.solve([0.006])
    where = free.backbone[8] + np.array([0.008, 0.006, 0.0])
    solver.obstacles = (Sphere(where, 0.012, name="ball"),)
    with pytest.raises(InvalidValue, match="sensitivity"):
        solver.sensitivity()
    pushed = solver.solve([0.006])
    assert pushed.certificate.converged and not pushed.certificate.branch_jump
    assert pushed.contacts and all(c.obstacle == "ball" and c.force > 0 for c in pushed.contacts)
    assert pushed.certificate.penetration < 1e-9
    solver.obstacles = ()
    back = solver.solve([0.006])
    assert back.certificate.converged and not back.certificate.branch_jump
    assert back.backbone == pytest.approx(free.backbone, abs=1e-9)


def test_object_put_through_a_finger_does_not_jam_it() -> None:
    """Where the way out of an object is barred, the finger takes the one from rest, and says so."""
    finger = load_finger(find_config("contact_cylinder"))
    solver = FingerSolver(replace(finger, obstacles=()))
    pull = 0.03 * solver.rest_lengths
    solver.solve(pull)
    solver.obstacles = finger.obstacles  # beyond the rod by now
    solution = solver.solve(pull)
    assert solution.certificate.converged and solution.certificate.branch_jump
    assert solution.energy == pytest.approx(solve(finger, pull).energy, rel=1e-8)
    back = solver.solve([0.0])
    assert back.certificate.converged and not back.certificate.branch_jump
    assert back.backbone == pytest.approx(solver.rest.backbone, abs=1e-9)


def test_obstacle_moved_bit_by_bit_is_one_put_there() -> None:
    finger = load_finger(find_config("helical"))
    solver, box = FingerSolver(finger), np.array([0.03, 0.03, 0.03])
    solver.solve([0.006])
    for x in np.linspace(-0.06, -0.032, 15):
        solver.obstacles = (Box(np.array([x, -0.03, 0.15]), box),)
        moved = solver.solve([0.006])
    assert moved.contacts and moved.certificate.converged
    direct = solve(replace(finger, obstacles=solver.obstacles), [0.006])
    assert moved.energy == pytest.approx(direct.energy, rel=1e-8)


def test_obstacle_over_the_base_is_refused_and_the_old_ones_stay() -> None:
    ball = Sphere(np.array([0.1, 0, 0.1]), 0.01)
    solver = FingerSolver(make_finger(obstacles=(ball,)))
    with pytest.raises(InvalidValue, match="clear of the base disk"):
        solver.obstacles = (Sphere(np.zeros(3), 0.02, name="bad"),)
    assert solver.obstacles == (ball,)


def test_smallest_eigenvalue_is_that_of_the_reduced_hessian() -> None:
    """Against the null space's basis written out: stable, and at a saddle with contact."""
    ball = Sphere(np.array([0, 0.09, 0.13]), 0.03)
    finger = make_finger(straight_cable(), straight_cable(1, name="side"), obstacles=(ball,))
    solver = FingerSolver(finger)
    for pulls in ([0.004, -0.01], [0.004, 0.002], [0.0085, -0.01]):
        solution = solver.solve(pulls)
        point = solver._point
        rows = point.rows[point.active]
        _, _, basis = np.linalg.svd(rows)
        null = basis[len(rows) :].T
        wanted = np.linalg.eigvalsh(null.T @ point.hessian @ null)[0]
        assert solution.certificate.smallest_eigenvalue == pytest.approx(wanted, abs=1e-9)
    assert solution.contacts and wanted < 0


def test_reset_starts_from_rest() -> None:
    solver = FingerSolver(make_finger())
    a = solver.solve([0.006])
    solver.reset()
    b = solver.solve([0.006])
    assert b.certificate.iterations > 0
    assert b.backbone == pytest.approx(a.backbone, abs=1e-10)


def test_certificate_is_honest() -> None:
    """Cable error, penetration and contact agree with what the pose itself shows."""
    finger = load_finger(find_config("contact_cylinder"))
    solver = FingerSolver(finger)
    solution = solver.solve([0.0036])
    points = solution.cables["main"]
    length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    assert length == pytest.approx(solver.rest_lengths[0] - 0.0036, abs=1e-10)
    assert solution.certificate.cable_error < 1e-10
    (contact,) = solution.contacts
    assert finger.obstacles[0].signed_distance(contact.position[None])[0] == pytest.approx(
        0, abs=1e-10
    )
    for kind in (solution.cables, solution.antagonists):
        assert finger.obstacles[0].signed_distance(kind["main"]).min() > -1e-9
    assert np.linalg.norm(contact.normal) == pytest.approx(1)
    assert solution.antagonists["main"] == pytest.approx(2 * solution.backbone - points)
    assert 0 < solution.certificate.solve_time < 10


def test_proportional_lengths_are_the_papers() -> None:
    """Each span shortens in proportion; on General 1 that is 0.3 mm off the frictionless pose."""
    finger = load_finger(find_config("general_1"))
    solver = FingerSolver(finger, SolverSettings(cable_model="proportional"))
    pull = 0.037 * solver.rest_lengths
    solution = solver.solve(pull)
    spans = np.linalg.norm(np.diff(solution.cables["main"], axis=0), axis=1)
    rest = np.linalg.norm(np.diff(solver.rest.cables["main"], axis=0), axis=1)
    assert spans == pytest.approx(rest * (1 - 0.037), abs=1e-9)
    off = rms(solution.backbone, solve(finger, pull).backbone)
    assert 0.2e-3 < off < 0.5e-3


@pytest.mark.parametrize("segments", [2, 3, 25])
def test_any_number_of_segments(segments: int) -> None:
    finger = make_finger(straight_cable(1, segments + 1), segments=segments)
    solution = solve(finger, [0.006])
    assert solution.certificate.converged and solution.certificate.stable
    assert solution.backbone.shape == (segments + 1, 3)


@given(pull=st.floats(-0.02, 0.03), hole=st.integers(1, 12), nu=st.floats(-0.5, 0.5))
def test_plain_pulls_always_converge(pull: float, hole: int, nu: float) -> None:
    solution = solve(
        make_finger(straight_cable(hole), helical_cable(), poisson_ratio=nu), [pull, 0]
    )
    c = solution.certificate
    assert c.converged and c.stable and not c.branch_jump
    assert np.all(solution.tensions >= 0)


def test_a_stream_takes_few_iterations() -> None:
    solver = FingerSolver(load_finger(find_config("helical")))
    counts = [solver.solve([p]).certificate.iterations for p in np.linspace(0.001, 0.007, 100)]
    assert np.mean(counts[1:]) <= 3


@given(seed=st.integers(0, 10**6), count=st.integers(1, 6))
def test_multipliers_against_enumeration(seed: int, count: int) -> None:
    """The QP's multipliers against trying every active set."""
    rng = np.random.default_rng(seed)
    a = rng.normal(size=(count, 8))
    s, t = a @ a.T, rng.normal(size=count)
    found = solve_multipliers(s, t, rng.random(count) < 0.5)
    assert found is not None
    best = None
    for mask in range(2**count):
        index = [i for i in range(count) if mask >> i & 1]
        m = np.zeros(count)
        if index:
            m[index] = np.linalg.solve(s[np.ix_(index, index)], -t[index])
        if m.min() >= -1e-12 and (s @ m + t).min() >= -1e-9:
            best = m
    assert best is not None
    assert found == pytest.approx(best, abs=1e-6)


def test_multipliers_of_constraints_that_cannot_be_met() -> None:
    """x <= -1 and -x <= -1 at once: no multipliers."""
    s = np.array([[1.0, -1.0], [-1.0, 1.0]])
    assert solve_multipliers(s, np.array([-1.0, -1.0]), np.array([False, False])) is None


def test_multipliers_of_twin_constraints_are_finite() -> None:
    found = solve_multipliers(np.ones((2, 2)), np.array([-1.0, -1.0]), np.array([False, False]))
    assert found is not None and found.sum() == pytest.approx(1.0, abs=1e-6)


def test_two_cables_in_one_hole_share_the_load() -> None:
    twins = make_finger(straight_cable(4, name="a"), straight_cable(4, name="b"))
    solution = solve(twins, [0.005, 0.005])
    alone = solve(make_finger(straight_cable(4)), [0.005])
    assert solution.certificate.converged
    assert solution.tensions.sum() == pytest.approx(alone.tensions[0], rel=1e-6)
    eigenvalue = alone.certificate.smallest_eigenvalue
    assert solution.certificate.smallest_eigenvalue == pytest.approx(eigenvalue, rel=1e-6)


def test_solution_as_json() -> None:
    data = reference("contact_sphere")
    solver = FingerSolver(reference_finger(data))
    solution: Solution = solver.solve(np.array(data["states"][0]["pull"]) * solver.rest_lengths)
    plain = solution.to_dict()
    assert np.array(plain["frames"]).shape == (10, 4)
    assert plain["contacts"][0]["point"] == "antagonist"
    assert plain["certificate"]["converged"] is True
    assert solution.tip.position == pytest.approx(plain["backbone"][-1])
