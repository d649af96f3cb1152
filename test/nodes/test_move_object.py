# SPDX-License-Identifier: Apache-2.0
"""The coordinator's actions move_object and rotate, on a solver node that knows of the object."""

import math

import numpy as np
import pytest
from action_msgs.msg import GoalStatus
from cube_stack import CABLES, QUICK, array

TURN = math.radians(8)


@pytest.mark.long
def test_a_cube_is_turned_and_shifted(cube):
    stack = cube().holding()
    goal = stack.rotate(TURN)
    assert goal.accepted
    result = goal.result()
    assert (goal.status, result.reached) == (GoalStatus.STATUS_SUCCEEDED, True), result.message
    assert (result.state, result.limiting, result.message) == ("holding", "", "moved")
    assert result.motion.turn.z == pytest.approx(TURN, abs=0.021)
    assert result.motion.fraction == 1.0 and result.motion.margin > 0.08
    told = goal.feedback
    assert {message.state for message in told} == {"moving"}
    phases = [message.phase for message in told]
    assert phases[0] == "plan" and phases[-1] == "go" and sorted(phases, reverse=True) == phases
    fractions = [message.motion.fraction for message in told]
    assert sorted(fractions) == fractions and fractions[0] == 0.0
    assert stack.now.object_held and stack.thing.held and not stack.now.refusal
    # It is held so: the regulation that follows leaves it there.
    stack.probe.spin_for(0.5)
    again = stack.move(shift=(0.0, 0.0, 0.0003), duration=0.5)
    result = again.result()
    assert (again.status, result.reached) == (GoalStatus.STATUS_SUCCEEDED, True), result.message
    assert result.motion.shift.z == pytest.approx(0.0003, abs=5e-4)
    assert abs(result.motion.turn.z) < 0.05

    stack.place(held=False)  # on the table again
    stack.probe.until(lambda: not stack.thing.held, "it on the table")
    assert stack.release(fast=True).result().released
    for name in CABLES:
        np.testing.assert_allclose(stack.bridge.at[name], QUICK[f"{name}.open_pulls"], atol=3e-4)
    assert array(result.motion.shift).shape == (3,)
