# SPDX-License-Identifier: Apache-2.0
"""The whole chain with the real servo bridge and its simulated servos: calibrate, grasp, let go."""

import math

import pytest
from ccr_msgs.msg import ServoState
from gripper_stack import BALL, FINGERS, GripperStack

pytestmark = pytest.mark.long
SETTINGS = {
    **dict.fromkeys(("bridge_timeout", "solver_timeout", "stale_timeout"), 20.0),  # s
    **{f"{name}.open_pulls": [0.0] for name in FINGERS},  # where calibration ends
}


@pytest.fixture
def chain(context, probe, start_bridge, servos):
    """The nodes, with calibrated servos."""
    bridge = start_bridge(rate=20.0)
    stack = GripperStack(context, probe, bridge=bridge, **SETTINGS)
    servos.in_state(ServoState.ACTIVE)
    assert servos.calibrate().success
    yield stack
    stack.close()


def test_calibrate_grasp_stop_hold_release(chain, servos):
    stack = chain.ready()
    stack.show(BALL)
    result = stack.grasp(object="ball", force=0.2).result()
    assert result.reached
    for finger in result.fingers:
        assert finger.force == pytest.approx(0.2, abs=0.021)
        # The servos feel what the solver says: 0.2 N on the ball are 7.2 N in the cable.
        assert finger.tensions[0] == pytest.approx(7.2, abs=0.5)

    assert servos.trigger("stop").success
    stack.until_state("fault", "servo bridge: stopped")
    before = {name: servos.joint(f"{name}_main").pull for name in FINGERS}
    assert not stack.call("reset").success
    assert servos.trigger("reset").success
    stack.probe.until(lambda: stack.call("reset").success, "the reset")
    assert stack.call("hold").success
    stack.until_state("holding")
    stack.probe.until(lambda: stack.now.object_held, "the object held")
    after = {name: servos.joint(f"{name}_main").pull for name in FINGERS}
    assert all(math.isclose(before[n], after[n], abs_tol=2e-4) for n in FINGERS)
    assert stack.release(fast=True).result().released
