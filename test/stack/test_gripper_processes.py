# SPDX-License-Identifier: Apache-2.0
"""The whole gripper as separate processes: a grasp, and what happens when a node is killed."""

import os
import time

import pytest
from ccr_msgs.action import Release
from ccr_msgs.msg import GripperState, ServoState
from gripper_rig import FINGERS, rigs

pytestmark = [pytest.mark.processes, pytest.mark.long, pytest.mark.timeout(300)]

KEPT = 1e-4  # m; a pull that is held changes by less


@pytest.fixture(scope="module")
def rig(tmp_path_factory, request):
    """A gripper that tests share, as starting and grasping take long."""
    with rigs(tmp_path_factory.mktemp("rig"), "/gripper", patience=request.param) as (rig,):
        yield rig


# Silence of others that the coordinator bears [s]: as the machine may be busy, or its default.
patient = pytest.mark.parametrize("rig", [10.0], indirect=True, ids=["patient"])
strict = pytest.mark.parametrize("rig", [None], indirect=True, ids=["strict"])


def held(rig, force=0.3):
    """Have the ball in the fingers alone, grasped now or by the test before."""
    if rig.gripper.state != GripperState.HOLDING:
        rig.grasp(force)
        rig.set_ball("supported", False)
        rig.until(lambda: near(rig, force), f"{force} N without the stand")


def near(rig, force, tolerance=0.03):
    forces = rig.forces()
    return len(forces) == 3 and all(abs(f - force) < tolerance for f in forces.values())


def keeps_its_pulls(rig, seconds, before):
    rig.spin(seconds)
    after = rig.measured()
    return all(abs(after[name] - before[name]) < KEPT for name in FINGERS)


@patient
def test_grasp_hold_more_weight(rig):
    result = rig.grasp(0.3)
    assert {f.finger for f in result.fingers} == set(FINGERS)
    assert all(f.in_contact and f.effort_agrees for f in result.fingers)
    assert rig.gripper.state == GripperState.HOLDING and rig.gripper.object_held
    rig.set_ball("supported", False)
    rig.until(lambda: near(rig, 0.3), "the force, with the ball in the fingers alone")
    rig.set_ball("mass", 0.03)
    rig.spin(1.0)
    rig.until(lambda: near(rig, 0.3), "the force, with the heavier ball")
    assert rig.gripper.state == GripperState.HOLDING


@patient
def test_coordinator_killed_while_holding(rig):
    held(rig)
    before = rig.measured()
    rig.kill("gripper_coordinator_node")
    took = rig.until(lambda: all(j.stale for j in rig.servos.joints), "word of stale commands")
    print(f"told after {took:.2f} s")
    assert rig.servos.state == ServoState.ACTIVE
    assert keeps_its_pulls(rig, 2.0, before)
    # Until its lease is over it seems to be there: goals would go to it, and be lost.
    rig.until(lambda: not rig.release_client.server_is_ready(), "word that it has gone")
    rig.gripper = None  # only now: its last words may have come after its end
    rig.start("gripper_coordinator_node")
    rig.until(
        lambda: rig.gripper is not None and rig.gripper.state == GripperState.HOLDING,
        "a coordinator that finds its grip again",
    )
    assert rig.gripper.object_held
    assert keeps_its_pulls(rig, 1.0, before)


@patient
def test_a_release_that_waits(rig):
    held(rig)
    begin = time.monotonic()
    future = rig.begin(rig.release_client, Release.Goal(delay=1.5))
    rig.until(lambda: rig.gripper.release_in > 0, "a release that waits")
    assert rig.gripper.state == GripperState.HOLDING
    assert rig.answer(future, "the release").result.released
    assert time.monotonic() - begin > 1.5
    rig.until(lambda: rig.gripper.state == GripperState.READY, "an open gripper")
    assert max(rig.measured().values()) < 3e-4


@strict
def test_solver_killed_while_holding(rig):
    held(rig)
    before = rig.measured()
    rig.kill("solver_node")
    took = rig.until(lambda: "solver" in rig.gripper.message, "word of the solver's silence")
    print(f"told after {took:.2f} s")
    assert rig.gripper.state == GripperState.FAULT
    assert keeps_its_pulls(rig, 2.0, before)
    rig.start("solver_node")
    comes_back(rig)


@strict
def test_servo_bridge_killed_while_holding(rig):
    held(rig)
    before = rig.measured()
    rig.kill("servo_bridge_node")
    took = rig.until(lambda: "servo bridge" in rig.gripper.message, "word of the bridge")
    print(f"told after {took:.2f} s")
    assert rig.gripper.state == GripperState.FAULT
    rig.pulls.clear()
    rig.start("servo_bridge_node")
    rig.until(lambda: len(rig.pulls) == 3, "measured pulls")
    assert keeps_its_pulls(rig, 1.0, before)  # the servos are where they were
    comes_back(rig)
    succeeded, result = rig.release(fast=True)
    assert succeeded and result.released


def comes_back(rig):
    """Reset, hold: all as before."""
    rig.until(lambda: rig.call("reset").success, "a reset")
    rig.until(lambda: rig.call("hold").success, "a hold")
    rig.until(lambda: rig.gripper.state == GripperState.HOLDING, "holding again")


def test_two_grippers_at_once(tmp_path):
    with rigs(tmp_path, "/left", "/right", rate=8.0) as (left, right):
        left.until(lambda: len(left.pulls) == 3, "measured pulls")
        before = left.measured()
        right.grasp(0.3)
        left.spin(0.5)
        assert left.gripper.state == GripperState.IDLE and not left.gripper.object_held
        assert all(abs(left.measured()[name] - before[name]) < KEPT for name in FINGERS)
        succeeded, _ = left.release(fast=True)
        assert succeeded
        right.spin(0.5)
        assert right.gripper.state == GripperState.HOLDING and right.gripper.object_held


@pytest.mark.soak
@pytest.mark.timeout(900)
@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="memory is read from /proc")
def test_ten_minutes_of_grasping_leave_nothing_behind(tmp_path):
    with rigs(tmp_path, "/gripper") as (rig,):
        sizes, end, cycles = {}, time.monotonic() + 600, 0
        while time.monotonic() < end:
            rig.grasp(0.3)
            assert rig.release(fast=True)[0]
            cycles += 1
            if cycles == 5:  # caches are filled by then
                sizes = rig.sizes()
        grown = {name: (sizes[name], now) for name, now in rig.sizes().items()}
        print(f"{cycles} cycles; (memory [kB], threads) after 5 and at the end: {grown}")
        for (memory, threads), (memory_now, threads_now) in grown.values():
            assert threads_now <= threads
            assert memory_now < 1.05 * memory + 3000
