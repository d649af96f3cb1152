# SPDX-License-Identifier: Apache-2.0
"""The demo's ball, through its topics and parameters."""

import time
from dataclasses import replace

import pytest
import rclpy
from ccr_msgs.msg import CablePulls, ObjectArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter

from ccr_ros.demo.ball import BallNode
from ccr_ros.demo.scene import HEIGHT
from ccr_ros.grasp.statics import GraspSolver
from ccr_ros.nodes.qos import COMMAND, LATCHED

PULL = 0.0061  # m; presses with about 0.3 N
FINGERS = ("finger_1", "finger_2", "finger_3")


@pytest.fixture
def table():
    """A ball, and a person who pulls cables and looks at it."""
    context = rclpy.Context()
    rclpy.init(args=[], context=context)
    ball = BallNode(context=context, namespace="gripper")
    person = rclpy.create_node("person", context=context, namespace="gripper")
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(ball)
    executor.add_node(person)
    seen = []
    person.create_subscription(ObjectArray, "objects", seen.append, LATCHED)
    publishers = {
        name: person.create_publisher(CablePulls, f"{name}/cable_pulls", COMMAND)
        for name in FINGERS
    }

    class Table:
        def pull(self, value):
            for publisher in publishers.values():
                publisher.publish(CablePulls(pulls=[value]))

        def set(self, name, value):
            return ball.set_parameters([Parameter(name, value=value)])[0]

        def until(self, condition, pull=None):
            end = time.monotonic() + 60
            while not (seen and condition(seen[-1].objects[0])):
                assert time.monotonic() < end, seen[-1:]
                if pull is not None:
                    self.pull(pull)
                executor.spin_once(timeout_sec=0.05)
            return seen[-1].objects[0]

        def let_go(self):
            end = time.monotonic() + 60
            while not (answer := self.set("supported", False)).successful:
                assert "not known" in answer.reason and time.monotonic() < end, answer
                self.pull(PULL)
                executor.spin_once(timeout_sec=0.05)

    yield Table()
    executor.shutdown()
    ball.destroy_node()
    person.destroy_node()
    context.try_shutdown()


def height(ball):
    return ball.pose.position.z


def test_on_its_stand_it_stays(table):
    ball = table.until(lambda _: True)
    assert (ball.name, height(ball)) == ("ball", HEIGHT)
    assert list(ball.primitive.dimensions) == [0.056]
    answer = table.set("supported", False)
    assert not answer.successful and "finger_1" in answer.reason


def test_without_it_the_fingers_draw_it_in_and_weight_lowers_it(table):
    table.let_go()
    light = table.until(lambda ball: height(ball) < HEIGHT - 1e-3)
    table.set("mass", 0.03)
    heavy = table.until(lambda ball: ball.mass == 0.03)
    assert height(heavy) < height(light) - 1e-5
    table.set("supported", True)
    kept = table.until(lambda ball: True)
    assert height(kept) == height(heavy)  # the stand is under it, where it is


def test_a_ball_that_is_not_held_is_caught_by_the_stand(table, monkeypatch):
    table.let_go()
    table.until(lambda ball: height(ball) < HEIGHT - 1e-3)
    solve = GraspSolver.solve
    monkeypatch.setattr(
        GraspSolver, "solve", lambda *a, **k: replace(solve(*a, **k), converged=False)
    )
    table.set("mass", 0.02)
    caught = table.until(lambda ball: ball.mass == 0.02)
    assert height(caught) == HEIGHT


def test_bad_values_change_nothing(table):
    for mass in (-0.1, 2.0, float("nan")):
        assert not table.set("mass", mass).successful
    table.pull(float("nan"))
    assert height(table.until(lambda ball: True)) == HEIGHT
