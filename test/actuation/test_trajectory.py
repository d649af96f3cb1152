# SPDX-License-Identifier: Apache-2.0
"""Setpoints keep their limits, never go beyond a target they can stop at, and arrive."""

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ccr_ros.actuation.trajectory import Trajectory

rates = st.floats(1e-4, 1.0)
accelerations = st.floats(1e-3, 10.0)
places = st.integers(-(10**6), 10**6).map(lambda n: 1e-7 * n)
steps = st.lists(st.floats(0.0, 0.1), min_size=1, max_size=60)


def follow(trajectory, times):
    """Step along and return the positions and velocities, the start among them."""
    positions, velocities = [trajectory.position], [trajectory.velocity]
    for dt in times:
        positions.append(trajectory.step(dt))
        velocities.append(trajectory.velocity)
    return positions, velocities


@given(rates, accelerations, places, st.lists(st.tuples(places, steps), min_size=1, max_size=5))
def test_limits_hold_whatever_is_asked_for(rate, acceleration, start, orders):
    trajectory = Trajectory(rate, acceleration, start)
    for target, times in orders:
        trajectory.target = target
        positions, velocities = follow(trajectory, times)
        for i, dt in enumerate(times):
            moved, gained = positions[i + 1] - positions[i], velocities[i + 1] - velocities[i]
            assert abs(velocities[i + 1]) <= rate * (1 + 1e-9)
            assert abs(moved) <= rate * dt * (1 + 1e-9) + 1e-12
            assert abs(gained) <= acceleration * dt * (1 + 1e-6) + 1e-9
            # Between two samples it is where a bounded acceleration can have taken it.
            slack = 0.5 * acceleration * dt * dt
            mean = 0.5 * (velocities[i] + velocities[i + 1]) * dt
            assert abs(moved - mean) <= slack * (1 + 1e-6) + 1e-12


@given(rates, accelerations, places, places, steps)
def test_a_target_is_never_overshot_from_rest(rate, acceleration, start, target, times):
    trajectory = Trajectory(rate, acceleration, start)
    trajectory.target = target
    positions, _ = follow(trajectory, times)
    way = math.copysign(1.0, target - start)
    for before, after in pairwise(positions):
        assert way * (after - before) >= -1e-12
        assert way * (target - after) >= -1e-12


@given(rates, accelerations, places, places)
def test_it_arrives_exactly_and_in_the_shortest_time(rate, acceleration, start, target):
    trajectory = Trajectory(rate, acceleration, start)
    trajectory.target = target
    way = abs(target - start)
    if way >= rate**2 / acceleration:
        shortest = way / rate + rate / acceleration
    else:
        shortest = 2 * math.sqrt(way / acceleration)
    count = 1000
    for _ in range(count - 2):
        trajectory.step(shortest / count)
    assert trajectory.done == (way == 0.0)
    for _ in range(4):
        trajectory.step(shortest / count)
    assert trajectory.done
    assert trajectory.position == target
    assert trajectory.velocity == 0.0


@given(rates, accelerations, places, st.floats(0.001, 1.0), st.floats(1e-3, 0.05))
def test_braking_ends_where_it_must(rate, acceleration, target, after, dt):
    trajectory = Trajectory(rate, acceleration)
    trajectory.target = target
    trajectory.step(after)
    start, speed = trajectory.position, trajectory.velocity
    for _ in range(100_000):
        trajectory.brake()  # anew in every step, as while commands are stale
        trajectory.step(dt)
        if trajectory.velocity == 0.0:
            break
    distance = speed * abs(speed) / (2 * acceleration)
    assert trajectory.position - start == pytest.approx(distance, abs=1e-9)


def test_uneven_steps_make_the_same_way():
    whole, parts = Trajectory(0.02, 0.1), Trajectory(0.02, 0.1)
    whole.target = parts.target = 0.01
    for dt in (0.05, 0.001, 0.12, 0.3):
        for share in (0.1, 0.4, 0.5):
            parts.step(share * dt)
        assert whole.step(dt) == pytest.approx(parts.position, abs=1e-12)
        assert whole.velocity == pytest.approx(parts.velocity, abs=1e-12)


def test_a_target_behind_is_reached_by_way_of_a_stop():
    trajectory = Trajectory(0.02, 0.1)
    trajectory.target = 0.01
    trajectory.step(0.3)
    trajectory.target = 0.0
    farthest = max(follow(trajectory, [0.01] * 200)[0])
    assert farthest == pytest.approx(0.004 + 0.02**2 / 0.2, abs=1e-6)
    assert trajectory.done and trajectory.position == 0.0
