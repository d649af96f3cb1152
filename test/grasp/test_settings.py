# SPDX-License-Identifier: Apache-2.0
"""Settings and goals: what is out of range is refused, by name."""

import math
from dataclasses import fields

import pytest

from ccr_ros.grasp.runs import grasp_goal, release_goal
from ccr_ros.grasp.settings import GraspSettings
from ccr_ros.model import InvalidValue, UnknownName

FINGERS = ("thumb", "index")


@pytest.mark.parametrize("item", fields(GraspSettings), ids=lambda item: item.name)
def test_every_setting_has_a_text_and_a_range(item):
    limits = item.metadata
    assert limits["low"] <= item.default <= limits["high"]
    assert len(limits["text"]) > 20 and limits["unit"]
    for bad in (math.nan, math.inf, limits["high"] * 1.01, limits["low"] - 1.0, "fast", True, None):
        with pytest.raises(InvalidValue, match=item.name):
            GraspSettings(**{item.name: bad})


def test_the_default_force_is_allowed():
    with pytest.raises(InvalidValue, match=r"default_force: 0\.2 .*<= 0\.1"):
        GraspSettings(max_force=0.1)


def test_a_goal_takes_what_is_not_given_from_the_settings():
    settings = GraspSettings(default_force=0.3)
    goal = grasp_goal(settings, FINGERS)
    assert (goal.force, goal.speed, goal.timeout) == (0.3, settings.close_speed, 30.0)
    assert goal.required == FINGERS
    assert grasp_goal(settings, FINGERS, required=("index",), force=0.1).force == 0.1


@pytest.mark.parametrize("name", ["force", "speed", "timeout", "gap"])
@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf, "much"])
def test_bad_goals(name, value):
    with pytest.raises(InvalidValue):
        grasp_goal(GraspSettings(), FINGERS, **{name: value})


def test_bad_fingers_and_names():
    with pytest.raises(UnknownName, match="unknown finger 'pinky'; valid: thumb, index"):
        grasp_goal(GraspSettings(), FINGERS, required=("pinky",))
    with pytest.raises(InvalidValue, match=r"required_fingers\[0\]"):
        grasp_goal(GraspSettings(), FINGERS, required=("thumb", "thumb"))
    with pytest.raises(InvalidValue, match="object"):
        grasp_goal(GraspSettings(), FINGERS, thing="a\nb")


@pytest.mark.parametrize("delay", [-0.1, math.nan, math.inf, 1e6])
def test_bad_delays(delay):
    with pytest.raises(InvalidValue, match="delay"):
        release_goal(delay=delay)
