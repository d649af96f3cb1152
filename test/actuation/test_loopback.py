# SPDX-License-Identifier: Apache-2.0
"""Simulated servos: what they do by themselves, and what can be done to them."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from racks import rack

from ccr_ros.actuation.driver import BusLost
from ccr_ros.actuation.drivers.loopback import LoopbackDriver, LoopbackSettings
from ccr_ros.model import InvalidFile, InvalidValue

PAIR = rack()


def driver(seed=0, state_file=None, true_zeros=None, **settings):
    made = LoopbackDriver(PAIR, LoopbackSettings(**settings), seed, true_zeros, state_file)
    made.open()
    made.read(0.0)
    return made


def test_a_servo_approaches_as_first_order():
    servos = driver(time_constant=0.1, max_speed=1e3)
    servos.write([1.0, -2.0])
    for t in (0.05, 0.1, 0.25):
        np.testing.assert_allclose(servos.read(t).angles, np.array([1, -2]) * -math.expm1(-t / 0.1))


@given(st.floats(0.1, 20.0), st.floats(-5.0, 5.0), st.lists(st.floats(0.001, 0.2), max_size=30))
def test_its_speed_is_limited(most, goal, steps):
    servos = driver(max_speed=most)
    servos.write([goal, 0.0])
    now, angle = 0.0, 0.0
    for dt in steps:
        now += dt
        reading = servos.read(now)
        assert abs(reading.angles[0] - angle) <= most * dt * (1 + 1e-9)
        assert abs(reading.velocities[0]) <= most * (1 + 1e-9)
        assert abs(reading.angles[0]) <= abs(goal) + 1e-12
        angle = reading.angles[0]


def test_backlash_is_lost_at_every_turn():
    servos = driver(backlash=0.2)
    now = 0.0
    ends = []
    for goal in (1.0, 0.0, 1.0):
        servos.write([goal, 0.0])
        for _ in range(100):
            now += 0.02
            servos.read(now)
        ends.append(servos.read(now).angles[0])
    np.testing.assert_allclose(ends, [0.9, 0.1, 0.9], atol=1e-6)


def test_noise_is_the_same_for_the_same_seed():
    def heard(seed):
        servos = driver(seed, noise=0.01, effort_noise=0.1, spring=100.0)
        return [(r.angles.tolist(), r.efforts.tolist()) for r in map(servos.read, range(20))]

    assert heard(1) == heard(1) != heard(2)
    assert np.std([angles for angles, _ in heard(1)]) == pytest.approx(0.01, rel=0.3)


def test_efforts_are_those_of_the_tensions_told():
    servos = driver()
    assert np.all(np.isnan(servos.read(0.1).efforts))
    servos.set_tensions({0: 10.0, 1: 4.0})
    np.testing.assert_allclose(servos.read(0.2).efforts, [10 * 0.01, -4 * 0.01 / 2.0])
    servos.set_tensions({1: math.nan})
    assert np.isnan(servos.read(0.3).efforts).tolist() == [False, True]


def test_springs_pull_from_the_true_zeros_on():
    servos = driver(spring=400.0, true_zeros=(0.5, 0.0))
    assert servos.own_zeros is None and servos.tensions == [0.0, 0.0]
    servos.write([1.0, -1.0])
    for step in range(200):
        servos.read(0.02 * step)
    # 5 mm of each; the second one's cable, of 5 N/mm, takes its share.
    assert servos.tensions == pytest.approx([400 * 0.005, 0.005 / (1 / 400 + 1 / 5e3)], rel=1e-6)


def test_faults_on_demand():
    servos = driver(time_constant=0.01)
    servos.settings = replace(servos.settings, stalled=("thumb_main",))
    servos.write([1.0, 1.0])
    assert servos.read(1.0).angles == pytest.approx([0.0, 1.0])
    servos.settings = replace(servos.settings, dropout=True, stalled=())
    with pytest.raises(BusLost, match="dropout"):
        servos.write([2.0, 2.0])
    with pytest.raises(BusLost, match="dropout"):
        servos.read(2.0)
    servos.settings = replace(servos.settings, dropout=False, temperature=50.0)
    reading = servos.read(2.5)
    # What was on its way went on; what did not get through did not.
    assert reading.angles == pytest.approx([1.0, 1.0])
    assert reading.temperatures.tolist() == [50.0, 50.0]


def test_servos_keep_their_place_when_their_program_dies(tmp_path):
    file = tmp_path / "rack.yaml"
    first = driver(state_file=file, backlash=0.1)
    first.write([1.0, -0.5])
    for step in range(100):
        angles = first.read(0.02 * step).angles
    # No word of farewell: the next one finds them.
    second = driver(state_file=file, backlash=0.1)
    assert second.read(0.0).angles == pytest.approx(angles, abs=1e-6)
    assert second.enable(0.0) == (1.0, -0.5)


@pytest.mark.parametrize(
    ("content", "error", "text"),
    [
        ("thumb_main: [0, 0, 0]\n", InvalidValue, "index_main: missing"),
        ("thumb_main: [0, 0, 0]\nindex_main: [0, .nan, 0]\n", InvalidValue, r"index_main\[1\]"),
        ("a: [", InvalidFile, "not valid YAML"),
    ],
)
def test_a_state_file_of_something_else(tmp_path, content, error, text):
    file = tmp_path / "rack.yaml"
    file.write_text(content)
    with pytest.raises(error, match=text):
        driver(state_file=file)


def test_a_disk_that_fills_up_is_a_lost_bus(tmp_path):
    file = tmp_path / "folder" / "rack.yaml"
    servos = driver(state_file=file)
    file.unlink()
    file.parent.rmdir()
    file.parent.write_text("in its way")
    servos.write([1.0, 1.0])
    with pytest.raises(BusLost, match="cannot be written"):
        servos.read(0.1)


def test_a_state_file_that_cannot_be_written(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InvalidFile, match="cannot be written"):
        driver(state_file=tmp_path / "file" / "rack.yaml")
