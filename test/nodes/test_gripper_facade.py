# SPDX-License-Identifier: Apache-2.0
"""The gripper in a person's words, through a coordinator that runs beside it."""

import threading

import pytest
from gripper_stack import BALL

from ccr_ros.gripper import Gripper, GripperFailed, GripperRefused, NoGripper
from ccr_ros.model import CcrError


@pytest.fixture
def running(stack):
    """The nodes of a gripper that spin in a thread, and a facade to it."""
    stack = stack().ready()
    stack.show()  # so that the publisher is known: from another thread it only publishes
    over = threading.Event()

    def spin():
        while not over.is_set():
            stack.probe.executor.spin_once(timeout_sec=0.05)

    thread = threading.Thread(target=spin)
    thread.start()
    try:
        with Gripper("/gripper") as gripper:
            yield stack, gripper
    finally:
        over.set()
        thread.join()


@pytest.mark.long
def test_grasp_hold_release(running, monkeypatch):
    stack, gripper = running
    assert gripper.state.state == "idle"
    with pytest.raises(GripperFailed, match="closed without touching anything") as failed:
        gripper.grasp()
    assert not failed.value.report.done
    stack.show(BALL)
    report = gripper.grasp("ball", force=0.2)
    assert report.state == "holding"
    assert report.in_contact == ("finger_1", "finger_2", "finger_3")
    assert all(force == pytest.approx(0.2, abs=0.021) for force in report.forces.values())
    assert gripper.hold().object_held
    assert gripper.stop().state == "stopped"
    assert gripper.hold().state == "holding"
    with monkeypatch.context() as patch:
        patch.setattr("ccr_ros.gripper._MARGIN", -89.7)
        with pytest.raises(NoGripper):  # who gives up waiting calls the release off
            gripper.release(after=60.0)
    gripper._wait(lambda: gripper.state.release_in < 0.0, 10.0)
    assert gripper.state.object_held
    assert gripper.release(after=0.5, fast=True).state == "ready"
    assert gripper.reset().state == "ready"  # no fault: nothing to do


def test_errors_say_what_is_wrong(running):
    _, gripper = running
    with pytest.raises(GripperRefused, match=r"force: 99\.0 is not allowed"):
        gripper.grasp(force=99.0)
    with pytest.raises(GripperRefused, match="unknown finger 'thumb'"):
        gripper.grasp(required_fingers=["thumb"])
    with pytest.raises(GripperRefused, match="the gripper is idle"):
        gripper.hold()
    gripper.close()
    gripper.close()
    with pytest.raises(NoGripper, match="closed"):
        gripper.stop()


def test_nobody_there():
    with pytest.raises(NoGripper, match="no gripper coordinator answers in '/nowhere'") as error:
        Gripper("/nowhere", timeout=0.2)
    assert isinstance(error.value, CcrError)
