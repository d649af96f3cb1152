# SPDX-License-Identifier: Apache-2.0
"""Servos behind ros2_control: joint states in any order, from anybody, and their age."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from racks import rack

from ccr_ros.actuation.driver import BusLost
from ccr_ros.actuation.drivers.ros2_control import Ros2ControlDriver
from ccr_ros.model import InvalidValue

PAIR = rack()


def driver(**options):
    sent = []
    made = Ros2ControlDriver(PAIR, sent.append, timeout=0.2, **options)
    made.open()
    return made, sent


@given(st.permutations(["elbow", "index_main", "thumb_main", "wrist"]))
def test_joints_are_found_by_name(names):
    servos, _ = driver()
    numbers = {"thumb_main": 1.0, "index_main": 2.0, "elbow": math.nan, "wrist": 9.0}
    values = [numbers[name] for name in names]
    servos.take(names, values, [10 * v for v in values], [100 * v for v in values], 5.0)
    reading = servos.read(5.1)
    assert reading.angles.tolist() == [1.0, 2.0]
    assert reading.velocities.tolist() == [10.0, 20.0]
    assert reading.efforts.tolist() == [100.0, 200.0]
    assert np.all(np.isnan(reading.temperatures))


def test_efforts_may_be_of_another_unit():
    servos, _ = driver(torque_per_effort=0.5)
    servos.take(PAIR.names, [1.0, 2.0], [], [3.0, 4.0], 1.0)
    assert servos.read(1.0).efforts.tolist() == [1.5, 2.0]


def test_joints_of_several_publishers_each_have_their_age():
    servos, _ = driver()
    with pytest.raises(BusLost, match=r"no joint states of thumb_main, index_main for 0\.2 s"):
        servos.read(1.0)
    servos.take(["thumb_main"], [1.0], [], [], 1.0)
    with pytest.raises(BusLost, match="of index_main for"):
        servos.read(1.1)
    servos.take(["index_main"], [2.0], [], [0.3], 1.1)
    reading = servos.read(1.15)
    assert reading.angles.tolist() == [1.0, 2.0]
    assert np.isnan(reading.efforts).tolist() == [True, False]
    with pytest.raises(BusLost, match="of thumb_main for"):
        servos.read(1.25)


@pytest.mark.parametrize(
    ("names", "angles", "efforts", "text"),
    [
        (["thumb_main", "index_main"], [1.0], [], "position: 1 .*as many as names"),
        (["thumb_main"], [1.0], [1.0, 2.0], "effort: 2"),
        (["thumb_main", "thumb_main"], [1.0, 1.0], [], "given once"),
        (["thumb_main"], [math.nan], [], "position.thumb_main: nan"),
        (["thumb_main"], [], [], "servo angles are needed"),
    ],
)
def test_what_is_wrong_counts_for_nothing(names, angles, efforts, text):
    servos, _ = driver()
    servos.take(["thumb_main", "index_main"], [1.0, 2.0], [], [], 1.0)
    with pytest.raises(InvalidValue, match=text):
        servos.take(names, angles, [], efforts, 1.1)
    assert servos.read(1.15).angles.tolist() == [1.0, 2.0]
    with pytest.raises(BusLost):
        servos.read(1.25)


def test_setpoints_are_sent_and_remembered():
    servos, sent = driver()
    servos.take(PAIR.names, [1.0, 2.0], [], [], 1.0)
    assert servos.enable(1.0) == (1.0, 2.0)  # nobody has sent anything: where they are
    servos.write(np.array([1.5, 2.5]))
    assert sent == [[1.5, 2.5]] and type(sent[0][0]) is float
    assert servos.enable(1.1) == (1.5, 2.5)  # what the controller still holds
    servos.hold()
    servos.close()
    assert sent == [[1.5, 2.5]]
