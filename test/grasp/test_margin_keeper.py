# SPDX-License-Identifier: Apache-2.0
"""The grip under a weight that changes: harder while the friction margin is short, and back."""

import math

import numpy as np
import pytest
from plant import NAMES, Plant

from ccr_ros.grasp.settings import GraspSettings

WANTED = 0.4
MU, SHARE = 0.8, 3  # fingers that share the weight


class Loaded(Plant):
    """A plant whose object hangs by friction: margin = 1 - weight / (3 mu N)."""

    weight = 0.2  # N

    def advance(self):
        least = min(self.forces())
        self.margin = 1.0 - self.weight / SHARE / (MU * max(least, 1e-9))
        self.margin = math.nan if math.isnan(self.weight) else max(0.0, self.margin)
        super().advance()


@pytest.fixture
def plant():
    return Loaded(GraspSettings(hold_margin=WANTED, max_force=0.5)).holding()


def test_a_weight_that_grows_is_gripped_harder_and_one_that_goes_is_let_be(plant):
    plant.run(3.0)
    assert np.allclose(plant.forces(), 0.2, atol=0.01)  # its margin is 0.58
    plant.weight = 0.45
    plant.run(0.2)
    assert plant.margin < 0.2
    plant.until(lambda: plant.margin >= WANTED - 0.01, 20.0)
    plant.run(5.0)
    assert WANTED - 0.01 <= plant.margin <= WANTED + plant.settings.margin_band + 0.02
    for finger in plant.control.values():
        assert plant.gripper.target(finger) == pytest.approx(plant.force(finger.name), abs=0.02)
    assert plant.gripper.target_force > 0.3
    plant.weight = 0.2
    plant.until(lambda: plant.gripper.grip.extra == 0.0, 30.0)
    plant.run(5.0)
    assert np.allclose(plant.forces(), 0.2, atol=0.01)


def test_never_beyond_the_largest_force(plant):
    plant.weight = 2.0
    plant.run(20.0)
    assert max(plant.forces()) < 0.5 + 0.01
    assert plant.gripper.grip.extra == pytest.approx(0.3)


def test_what_the_fingers_cannot_press_does_not_add_up(plant):
    for finger in NAMES:
        plant.stuck.add(finger)
    plant.weight = 0.6
    plant.run(5.0)
    assert 0.0 < plant.gripper.grip.extra < 0.1


@pytest.mark.parametrize("what", ["told", "held", "lost_pose", "margin"])
def test_without_a_fresh_margin_the_force_stays(plant, what):
    plant.weight = 0.45
    plant.run(1.5)
    extra = plant.gripper.grip.extra
    assert extra > 0.02
    if what == "margin":
        plant.weight = math.nan
    else:
        setattr(plant, what, what == "lost_pose")
    plant.run(3.0)
    assert plant.gripper.grip.extra == pytest.approx(extra, abs=0.02)
    assert plant.gripper.object_held


def test_off_by_default():
    plant = Loaded().holding()
    plant.weight = 0.45
    plant.run(5.0)
    assert plant.gripper.grip.extra == 0.0 and np.allclose(plant.forces(), 0.2, atol=0.01)


def test_another_force_and_another_grip_count_from_what_is_asked(plant):
    plant.weight = 0.45
    plant.run(10.0)
    extra = plant.gripper.grip.extra
    run = plant.grasp(force=0.25)
    assert plant.finish(run).reached
    plant.gripper.stop()
    plant.gripper.hold(plant.now)
    plant.run(5.0)
    assert max(plant.forces()) < 0.45 and plant.margin >= WANTED - 0.02
    plant.weight = 0.0
    plant.until(lambda: plant.gripper.grip.extra == 0.0, 30.0)
    assert extra > 0.1
    plant.finish(plant.release())
    assert plant.gripper.grip.extra == 0.0
