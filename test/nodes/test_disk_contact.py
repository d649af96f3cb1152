# SPDX-License-Identifier: Apache-2.0
"""The solver node's parameter disk_contact: fingers press on each other beside an object."""

import numpy as np
from ccr_msgs.msg import GraspState
from probe import objects, sphere

from ccr_ros.grasp.clearance import disk_clearance
from ccr_ros.model import load_gripper, solve
from ccr_ros.resources import find_config

FINGERS = ("finger_1", "finger_2", "finger_3")
PULL = 0.047 * 0.182  # m; closed on nothing they go through each other


def tips(probe, start, namespace, **values):
    """Tips (3, 3) in the fingers' bases after all are pulled, an object standing far away."""
    start(namespace=namespace, mode="gripper", time_limit=20.0, **values)
    states = probe.listen(GraspState, f"/{namespace}/grasp_state")
    far = sphere("far", 0.01, (0.0, 0.0, 0.5))
    far.mass = 0.001
    stamp = probe.next_stamp()
    probe.publish(f"/{namespace}/objects", objects(far, stamp=stamp))
    probe.until(lambda: states and states[-1].object == "far", "the object")
    names = [f"/{namespace}/{finger}" for finger in FINGERS]
    for name in names:
        probe.states(name)
    for name in names:
        probe.pull(name, [PULL])

    def pulled():
        last = [probe.states(name)[-1] for name in names if probe.states(name)]
        return len(last) == 3 and all(s.pulls[0] == PULL for s in last) and last

    last = probe.until(pulled, "an answer to all pulls")
    assert not any(state.stale for state in last)
    return np.array([[s.tip.position.x, s.tip.position.y, s.tip.position.z] for s in last])


def test_fingers_stay_apart_with_disk_contact(probe, start):
    alone = tips(probe, start, "through")
    apart = tips(probe, start, "apart", disk_contact=True, disk_rim=0.0015)
    gripper = load_gripper(find_config("gripper_sphere"))
    free = solve(gripper.fingers[0].finger, [PULL]).require_converged().backbone[-1]
    assert np.abs(alone - free).max() < 1e-6
    assert (alone[:, 0] - apart[:, 0]).min() > 2e-4  # kept from bending as far
    closed = [solve(m.finger, [PULL]) for m in gripper.fingers]
    assert disk_clearance(closed, [m.base for m in gripper.fingers], rim=0.0015).touching
