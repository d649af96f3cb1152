# SPDX-License-Identifier: Apache-2.0
"""A grip whose fingers have unlike shares of the force, or carry an object between them."""

import numpy as np
import pytest
from plant import NAMES, Plant, free_motion

from ccr_ros.grasp.finger_control import FingerControl, SolvedFinger
from ccr_ros.grasp.grip import Grip
from ccr_ros.grasp.pull_path import PullPath
from ccr_ros.grasp.settings import GraspSettings

STIFFNESS = {"finger_1": 140.0, "finger_2": 66.0, "finger_3": 66.0}  # N/m; gripper_cube's
TOUCH = 0.002  # m


def test_a_finger_with_twice_the_share_presses_twice_as_hard():
    plant = Plant()
    plant.control["finger_1"].force_share = 2.0
    plant.held = False
    plant.run(0.2)
    seen = []
    run = plant.grasp(force=0.15)
    while run.outcome is None:
        plant.advance()
        seen.append(plant.gripper.target(plant.control["finger_1"]))
    assert run.outcome.reached
    assert plant.gripper.target_force == 0.15
    assert [plant.gripper.target(f) for f in plant.control.values()] == [0.3, 0.15, 0.15]
    assert max(seen) == 0.3
    plant.run(5.0)
    np.testing.assert_allclose(plant.forces(), [0.3, 0.15, 0.15], atol=0.005)
    plant.finish(plant.grasp(force=0.2))
    plant.run(5.0)
    np.testing.assert_allclose(plant.forces(), [0.4, 0.2, 0.2], atol=0.005)


class Carried:
    """An object that moves along x until finger_1 on one side balances the two on the other."""

    def __init__(self):
        path = PullPath(np.array([0.0]), np.array([0.006]))
        self.fingers = {n: FingerControl(n, ("main",), path, free_motion(0.006)) for n in NAMES}
        self.fingers["finger_1"].force_share = 2.0
        self.settings = GraspSettings(force_dead_band=0.0)
        self.grip = Grip(self.fingers, self.settings)
        self.now = 0.0
        self.x = 0.0
        for finger in self.fingers.values():
            finger.place = TOUCH + 0.001

    def solve(self, bias=0.0):
        """Tell the fingers their forces; that of finger_2 is felt wrong by a bias."""
        self.now += 0.02
        press = {n: STIFFNESS[n] * (f.place - TOUCH) for n, f in self.fingers.items()}
        self.x = (press["finger_1"] - press["finger_2"] - press["finger_3"]) / sum(
            STIFFNESS.values()
        )
        for name, finger in self.fingers.items():
            towards = -1.0 if name == "finger_1" else 1.0
            force = press[name] + towards * STIFFNESS[name] * self.x
            force += bias * (name == "finger_2")
            solved = SolvedFinger(np.array([finger.place]), np.array([1.0]), (("cube", force),))
            finger.hear_solved(solved, self.now)

    def hold(self, seconds, carried, bias=0.0):
        for _ in range(round(seconds / 0.02)):
            self.solve(bias)
            self.grip.hold(self.now, carried)


def test_fingers_that_carry_are_regulated_together():
    hand = Carried()
    hand.solve()
    hand.grip.commit(0.05)
    for finger in hand.fingers.values():
        hand.grip.floors[finger.name] = TOUCH
    hand.hold(60.0, carried=True, bias=0.01)
    level, target = hand.grip.mean()
    assert level == pytest.approx(0.05, abs=1e-4) and target == 0.05
    assert abs(hand.x) < 5e-5  # as its two sides are not quite equally stiff
    places = [finger.place for finger in hand.fingers.values()]
    assert np.ptp(places) < 1e-9


def test_fingers_that_each_went_after_their_own_would_push_it_away():
    """What the test above is good for: a force that is felt wrong by 0.01 N is enough."""
    hand = Carried()
    hand.solve()
    hand.grip.commit(0.05)
    for finger in hand.fingers.values():
        hand.grip.floors[finger.name] = TOUCH
    hand.hold(60.0, carried=False, bias=0.01)
    assert np.ptp([finger.place for finger in hand.fingers.values()]) > 1e-4


def test_what_one_may_not_do_none_does():
    hand = Carried()
    hand.solve()
    hand.grip.commit(0.02)  # less than they press with
    before = {name: finger.place for name, finger in hand.fingers.items()}
    hand.grip.floors["finger_1"] = before["finger_1"]
    for name in ("finger_2", "finger_3"):
        hand.grip.floors[name] = TOUCH
    hand.hold(5.0, carried=True)
    assert {name: finger.place for name, finger in hand.fingers.items()} == before


def test_a_pose_counts_once_whichever_finger_is_heard_first():
    """The fingers' states come one after the other; the step waits for the last of them."""
    hand = Carried()
    hand.solve()
    hand.grip.commit(0.1)
    hand.grip.hold(hand.now, carried=True)
    moved = []
    late = hand.fingers["finger_3"]
    for _ in range(3):
        earlier = late.solved_at
        hand.solve()
        solved_at, late.solved_at = late.solved_at, earlier
        before = late.place
        hand.grip.hold(hand.now, carried=True)
        moved.append(late.place - before)
        late.solved_at = solved_at
        hand.grip.hold(hand.now, carried=True)
        hand.grip.hold(hand.now, carried=True)
        moved.append(late.place - before)
    assert moved[::2] == [0.0] * 3
    # Each time once, by the law: towards a force that comes nearer.
    assert moved[1] > moved[3] > moved[5] > 0.9 * moved[1]


def test_a_finger_that_has_twice_the_share_has_half_the_level():
    hand = Carried()
    hand.solve()
    thumb = hand.fingers["finger_1"]
    assert hand.grip.level(thumb) == hand.grip.force(thumb) / 2.0 > 0.0
