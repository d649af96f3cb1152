# SPDX-License-Identifier: Apache-2.0
"""Pairs of disks of a hand: which are near, derivatives by the coordinates, and going through."""

from dataclasses import replace

import numpy as np
import pytest
from friction_cases import LONG, around

from ccr_ros.grasp.clearance import disk_clearance
from ccr_ros.grasp.statics import DiskShape, GraspSolver, sphere_body
from ccr_ros.grasp.statics.assembly import Hand
from ccr_ros.grasp.statics.disks import DiskRoom, pair_in_words
from ccr_ros.grasp.statics.shared import shared_rows
from ccr_ros.model import (
    InvalidValue,
    MountedFinger,
    Pose,
    SolverSettings,
    Sphere,
    load_gripper,
    solve,
)
from ccr_ros.model.solver import FingerSolver
from ccr_ros.model.sqp import derive
from ccr_ros.resources import find_config

FAR = sphere_body(0.01, pose=Pose(np.array([0.0, 0.0, 0.5])))


@pytest.fixture(scope="module")
def hand():
    return Hand(load_gripper(find_config("gripper_sphere")).fingers)


@pytest.fixture(scope="module")
def room(hand):
    return DiskRoom(hand, DiskShape(rim=0.0015))


def points(hand, ys):
    found = []
    for problem, y in zip(hand.problems, ys, strict=True):
        at = problem.evaluate(y)
        none = np.zeros((len(problem.obstacles), len(problem.points.labels)))
        found.append(derive(problem, at, np.zeros(len(at.lengths)), none))
    return found


def posed(hand, share, spread=0.0):
    """Coordinates of all fingers at a pull, as a share of the length, and a random change."""
    rng = np.random.default_rng(0)
    found = []
    for mounted in hand.mounted:
        solver = FingerSolver(mounted.finger)
        solver.solve([share * mounted.finger.length])
        y = solver.point.at.y
        found.append(y + spread * rng.normal(size=len(y)))
    return found


def test_nothing_is_near_in_an_open_hand(hand, room):
    found = room.near_disks(points(hand, posed(hand, 0.0)))
    assert len(found) == 0 and found.violation() == 0.0 and not found.active.any()
    assert len(shared_rows(found, [p.size for p in hand.problems], np.arange(0))) == 0


def test_the_nearest_pair_is_what_clearance_tells(hand, room):
    fingers = hand.mounted
    for percent in (4.3, 4.42):
        ys = posed(hand, percent / 100)
        found = room.near_disks(points(hand, ys))
        solutions = [solve(m.finger, [percent / 100 * m.finger.length]) for m in fingers]
        clear = disk_clearance(solutions, [m.base for m in fingers], rim=0.0005)
        gap = found.near.gaps.min() * hand.length
        best = int(found.pairs[found.near.gaps.argmin()])
        assert room.names(best)[1] == clear.disks
        # flat disks of the cores' radius, less what is round
        assert gap == pytest.approx(clear.gap - 0.002, abs=2e-5)


def test_first_and_second_derivatives_by_the_coordinates(hand, room):
    ys = posed(hand, 0.043, 0.02)
    start = room.near_disks(points(hand, ys))
    force = np.random.default_rng(1).uniform(0.1, 3.0, len(start))
    assert len(start) >= 3 and not start.near.cut.any()
    here = room.near_disks(points(hand, ys), start, force)
    rng = np.random.default_rng(2)
    ways = [rng.normal(size=len(y)) for y in ys]

    def at(size):
        moved = [y + size * way for y, way in zip(ys, ways, strict=True)]
        found = room.near_disks(points(hand, moved), here)
        assert np.array_equal(found.pairs, here.pairs)
        slope = np.concatenate([force @ row for row in found.rows])
        return -force @ found.near.gaps, slope

    size = 1e-6
    (ahead, slope_ahead), (back, slope_back) = at(size), at(-size)
    way = np.concatenate(ways)
    assert (ahead - back) / (2 * size) == pytest.approx(at(0.0)[1] @ way, rel=1e-7)
    rows = np.concatenate(here.ways, axis=1)
    product = rows.T @ (here.stiffness * (rows @ way))
    product += np.concatenate(
        [w * bend @ one for w, bend, one in zip(hand.weights, here.bends, ways, strict=True)]
    )
    expected = (slope_ahead - slope_back) / (2 * size)
    assert np.abs(product - expected).max() < 1e-6 * np.abs(expected).max()
    assert len(here.stiffness) <= 5 * len(here)


def test_a_force_brings_all_its_pairs_along(hand, room):
    near = room.near_disks(points(hand, posed(hand, 0.044)))
    force = np.linspace(1.0, 2.0, len(near))
    apart = room.near_disks(points(hand, posed(hand, 0.0)), near, force)
    assert np.array_equal(apart.pairs, near.pairs) and np.array_equal(apart.forces, force)
    assert apart.violation() > 0.05  # they carry force and are far from each other


def test_what_goes_through_is_found_and_what_slides_is_not(hand, room):
    open_, meet = (room.near_disks(points(hand, posed(hand, share))) for share in (0.042, 0.0438))
    beyond = room.near_disks(points(hand, posed(hand, 0.055)))
    assert room.passed(open_, meet) is None and room.passed(open_, open_) is None
    pair = room.passed(open_, beyond)
    assert pair is not None and "finger" in room.in_words(pair)
    assert room.passed(beyond, open_) is not None


def test_words():
    assert pair_in_words(("a", "b"), (3, 4)) == "disk 3 of a and disk 4 of b"
    assert pair_in_words(("a", "a"), (0, 4)) == "disks 0 and 4 of a"


TWO = around(2, 0.03)


def solver_of(shape):
    return GraspSolver(TWO, FAR, LONG, disks=shape)


def test_where_a_solver_stands_goes_to_one_of_the_same_disks():
    shape = DiskShape(thickness=0.004)
    one, other = solver_of(shape), solver_of(shape)
    pulls = {"finger_1": [0.0042], "finger_2": [0.0036]}
    first = one.solve(pulls).require_converged()
    other.resume(one.standing)
    again = other.solve({}).require_converged()
    assert again.disk_contacts[0].force == pytest.approx(first.disk_contacts[0].force, rel=1e-9)
    for shape in (None, DiskShape()):
        with pytest.raises(InvalidValue, match="standing"):
            solver_of(shape).resume(one.standing)


def test_contacts_stay_when_the_object_is_supported_and_put_elsewhere():
    solver = solver_of(DiskShape(thickness=0.004))
    pulls = {"finger_1": [0.0042], "finger_2": [0.0036]}
    first = solver.solve(pulls).require_converged().disk_contacts
    solver.support()
    assert solver.solve({}).disk_contacts[0].force == pytest.approx(first[0].force, rel=1e-9)
    # From nothing, fingers would stand in each other: they are closed anew.
    solver.support(Pose(np.array([0.0, 0.0, 0.6])))
    anew = solver.solve({}).require_converged().disk_contacts
    assert anew[0].force == pytest.approx(first[0].force, rel=1e-6)


def test_a_solve_that_fails_names_the_disks_and_stays_where_it_was():
    fingers = load_gripper(find_config("gripper_sphere")).fingers
    length = fingers[0].finger.length
    settings = SolverSettings(time_limit=20.0)
    solver = GraspSolver(fingers, FAR, settings, disks=DiskShape(rim=0.0015))
    shares = dict(zip(solver.names, (1.0, 0.9, 0.7), strict=True))
    for share in (0.04, 0.048, 0.05):
        pulls = {n: [share * s * length] for n, s in shares.items()}
        good = solver.solve(pulls).require_converged()
    assert good.disk_contacts
    bad = solver.solve({n: [0.08 * s * length] for n, s in shares.items()})
    assert not bad.converged and "disk 9 of finger_1 and disk" in bad.message
    assert solver.pulls["finger_1"] == pytest.approx([0.05 * length])


def test_obstacles_and_disks_at_once():
    """A ball behind finger_2 takes up part of what finger_1 presses it with."""
    fingers = around(2, 0.03)
    pulls = {"finger_1": [0.0074], "finger_2": [0.0]}
    alone = GraspSolver(fingers, FAR, LONG, disks=DiskShape(thickness=0.004)).solve(pulls)
    back = fingers[1].base.points(alone.require_converged().fingers[1].backbone[6])
    ball = Sphere(
        fingers[1].base.inverse().points(back - np.array([0.0185, 0.0, 0.0])), 0.011, name="stop"
    )
    fingers[1] = MountedFinger(replace(fingers[1].finger, obstacles=(ball,)), fingers[1].base)
    backed = GraspSolver(fingers, FAR, LONG, disks=DiskShape(thickness=0.004)).solve(pulls)
    assert backed.require_converged().fingers[1].contacts
    assert backed.disk_contacts[0].force > alone.disk_contacts[0].force
