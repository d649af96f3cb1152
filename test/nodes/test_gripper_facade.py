# SPDX-License-Identifier: Apache-2.0
"""The gripper in a person's words, through a coordinator that runs beside it."""

import threading
from contextlib import contextmanager
from copy import deepcopy

import pytest
from gripper_stack import BALL

from ccr_ros.gripper import Gripper, GripperFailed, GripperRefused, NoGripper
from ccr_ros.model import CcrError, InvalidValue


@contextmanager
def spinning(stack):
    """Spin the nodes of a gripper in a thread; return them, and a facade to them."""
    stack.ready()
    stack.show()  # so that the publisher is known: from another thread it only publishes
    with connected(stack) as gripper:
        yield stack, gripper


@contextmanager
def connected(stack):
    """Spin the nodes in a thread; return a facade to them."""
    over = threading.Event()

    def spin():
        while not over.is_set():
            stack.probe.executor.spin_once(timeout_sec=0.05)

    thread = threading.Thread(target=spin)
    thread.start()
    try:
        with Gripper("/gripper") as gripper:
            yield gripper
    finally:
        over.set()
        thread.join()


@pytest.fixture
def running(stack):
    with spinning(stack()) as both:
        yield both


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


@pytest.mark.long
def test_what_is_in_hand(stack):
    with spinning(stack(mode="gripper")) as (nodes, gripper):
        assert gripper.in_hand is None
        ball = deepcopy(BALL)
        ball.mass = 0.02
        nodes.show(ball)
        gripper._wait(lambda: gripper.in_hand, 60.0)
        assert not gripper.in_hand.held and gripper.in_hand.forces == {}
        gripper.grasp("ball", force=0.2)
        ball.held = True
        nodes.show(ball)
        gripper._wait(lambda: gripper.in_hand.held, 60.0)
        found = gripper.in_hand
        assert (found.object, found.mass, found.stable, found.stale) == ("ball", 0.02, True, False)
        assert found.position[2] < 0.11
        assert found.orientation == pytest.approx((0, 0, 0, 1), abs=1e-4)
        assert set(found.forces) == {"finger_1", "finger_2", "finger_3"}
        assert all(force > 0.05 for force in found.forces.values())
        assert gripper.state.object_held  # the coordinator goes on holding it
        nodes.show()
        gripper._wait(lambda: gripper.in_hand is None, 60.0)


@pytest.mark.long
def test_what_is_held_is_moved(cube):
    stack = cube().holding()
    with connected(stack) as gripper:
        report = gripper.rotate(0.06)
        assert report.done and report.state == "holding" and not report.limiting
        assert report.turn[2] == pytest.approx(0.06, abs=0.021)
        assert report.fraction == 1.0 and report.margin > 0.1
        with pytest.raises(GripperRefused, match=r"margin: 1\.5"):
            gripper.move(shift=(0.0, 0.0, 0.001), margin=1.5)
        for bad in ((float("nan"), 0.0, 0.0), (1.0, 2.0)):
            with pytest.raises(InvalidValue, match="shift"):
                gripper.move(shift=bad)
        with pytest.raises(GripperFailed, match="cannot be moved so") as failed:
            gripper.rotate(3.0, margin=0.3)
        assert failed.value.report.limiting and failed.value.report.fraction == 0.0
        assert gripper.state.object_held and gripper.in_hand.held


def test_errors_say_what_is_wrong(running):
    _, gripper = running
    assert gripper.in_hand is None  # the solver is in mode fingers
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
