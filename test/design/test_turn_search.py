# SPDX-License-Identifier: Apache-2.0
"""The search for a gripper that turns farther: its score, its seed, and how it ends."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ccr_ros.design.turn import TurnTask
from ccr_ros.design.turn_search import score, search_turn
from ccr_ros.design.turn_units import units_of
from ccr_ros.grasp.manipulation import MoveLimits
from ccr_ros.grasp.statics import box_body
from ccr_ros.model import Cable, InvalidValue, Pose, SolverSettings, load_gripper
from ccr_ros.resources import find_config

LONG = SolverSettings(time_limit=60.0)
CUBE = box_body(np.full(3, 0.04), 0.01, Pose(np.array([0.0, 0.0, 0.17])), 0.8)
TASK = TurnTask(  # a few degrees, so that tests are fast
    CUBE,
    {"finger_1": 0.12, "finger_2": 0.06, "finger_3": 0.06},
    MoveLimits(step=2e-4, drift=5e-4, waypoints=4),
)


@pytest.fixture(scope="module")
def gripper():
    return load_gripper(find_config("gripper_cube"))


def told(angle, margin, held=True):
    return SimpleNamespace(
        held=held, angle=math.radians(angle), hold=SimpleNamespace(margin=margin), ways=()
    )


def test_the_score_counts_turn_margin_and_winding():
    assert score(told(30, 0.5), 0) == pytest.approx(40)
    assert score(told(30, 0.5), 8) == pytest.approx(38)
    assert score(told(80, 0.0), 0) == pytest.approx(45)
    assert score(told(80, 0.0), 0, math.radians(60)) == pytest.approx(60)
    assert score(told(30, math.nan), 0) == pytest.approx(30)
    assert score(told(30, 0.5, held=False), 0) == 0
    assert score(told(1, 0.0), 100) == 0


@pytest.mark.long
def test_a_seed_finds_the_same_again_and_mirrored_fingers_stay_so(gripper):
    seen = [], []
    for designs in seen:
        search = search_turn(
            gripper, TASK, 1, 5, settings=LONG,
            watch=lambda number, design, kept=designs: kept.append((number, design)) or True,
        )  # fmt: skip
        assert search.tried == 1 and not search.stopped
        assert search.best.score == max(design.score for _, design in designs)
        assert search.best.score >= search.given.score > 0
    first, second = seen
    assert [n for n, _ in first] == [0, 1]
    for (_, a), (_, b) in zip(first, second, strict=True):
        assert a.choice == b.choice and a.score == b.score
        assert units_of(a.gripper) == units_of(gripper)
    assert len({design.choice for _, design in first}) == 2


def test_an_interrupt_ends_with_the_best_so_far(gripper):
    def watch(number, design):
        raise KeyboardInterrupt

    search = search_turn(gripper, TASK, 100, settings=LONG, watch=watch)
    assert search.stopped and search.tried == 0
    assert search.best is search.given and search.best.gripper is gripper


def test_a_caller_may_end_it(gripper):
    search = search_turn(gripper, TASK, 100, settings=LONG, watch=lambda number, design: False)
    assert search.stopped and search.tried == 0


def test_bad_values_are_refused(gripper):
    for key, bad in (("tries", 0), ("seed", -1), ("cap", 0.0), ("cap", float("nan"))):
        with pytest.raises(InvalidValue, match=key):
            search_turn(gripper, TASK, **{"tries": 1, key: bad})
    first, *others = gripper.fingers
    finger = replace(first.finger, cables=(Cable("left", np.full(10, 0.1)),))
    free = replace(gripper, fingers=(replace(first, finger=finger), *others))
    with pytest.raises(InvalidValue, match="left"):
        search_turn(free, TASK, 1)
