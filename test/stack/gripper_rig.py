# SPDX-License-Identifier: Apache-2.0
"""A whole gripper as processes, and a person beside it: for tests of the stack."""

import os
import signal
import time
from contextlib import ExitStack, contextmanager

import rclpy
from action_msgs.msg import GoalStatus
from ccr_msgs.action import Grasp, Release
from ccr_msgs.msg import CablePulls, FingerState, GripperState, ServoState
from rclpy.action import ActionClient
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from std_srvs.srv import Trigger

from ccr_ros.demo.kinds import BALL_NODE
from ccr_ros.nodes.qos import LATCHED
from ccr_ros.stack.environment import import_environment
from ccr_ros.stack.processes import Children
from ccr_ros.stack.up import NODES, arguments_for, node_part

FINGERS = ("finger_1", "finger_2", "finger_3")
LIMIT = 120.0  # s; far beyond what anything takes


class Rig:
    """Starts the nodes of one gripper, hears what they say, asks them to do things."""

    def __init__(self, children, folder, context, namespace, patience, rate):
        self.namespace = namespace
        self._patience, self._rate = patience, rate
        self._children, self._folder = children, folder
        self._running = {}
        self.context = context
        self.node = rclpy.create_node("person", context=context, namespace=namespace)
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self.node)
        self.gripper = self.servos = None
        self.states, self.pulls = {}, {}
        self.node.create_subscription(GripperState, "gripper_state", self._gripper, LATCHED)
        self.node.create_subscription(ServoState, "servo_state", self._servos, LATCHED)
        for name in FINGERS:
            self.node.create_subscription(
                FingerState, f"{name}/state", lambda m, n=name: self.states.update({n: m}), LATCHED
            )
            self.node.create_subscription(
                CablePulls,
                f"{name}/cable_pulls",
                lambda m, n=name: self.pulls.update({n: (time.monotonic(), m.pulls[0])}),
                10,
            )
        self.grasp_client = ActionClient(self.node, Grasp, "grasp")
        self.release_client = ActionClient(self.node, Release, "release")
        self.ball = AsyncParameterClient(self.node, "demo_ball")

    def _gripper(self, message):
        self.gripper = message

    def _servos(self, message):
        self.servos = message

    def start(self, name):
        own = {}
        if name == "servo_bridge_node":
            own = {
                "calibration_file": str(self._folder / "zeros.yaml"),
                "loopback.state_file": str(self._folder / "angles.yaml"),
                "rate": self._rate,  # each of its cycles is three poses to solve
            }
        elif name == "gripper_coordinator_node" and self._patience:
            timeouts = ("solver_timeout", "bridge_timeout", "stale_timeout")
            own = dict.fromkeys(timeouts, self._patience)
        part = BALL_NODE if name == BALL_NODE.name else node_part(name)
        words = arguments_for(self.namespace, own, (), ())
        self._running[name] = self._children.start(part, *words)

    def kill(self, name):
        child = self._running.pop(name)
        os.kill(child.pid, signal.SIGKILL)
        child.wait(time.monotonic() + LIMIT)
        assert child.exit_code == -signal.SIGKILL

    def spin(self, seconds):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._executor.spin_once(timeout_sec=0.05)

    def until(self, condition, what):
        """Spin until a condition holds; return how long that took [s]."""
        begin = time.monotonic()
        while not condition():
            self._executor.spin_once(timeout_sec=0.05)
            if time.monotonic() - begin > LIMIT:
                said = "\n".join(f"{n}:\n{c.output[-2000:]}" for n, c in self._running.items())
                raise AssertionError(f"{what} did not come; {self.gripper}\n{said}")
        return time.monotonic() - begin

    def answer(self, future, what):
        self.until(future.done, what)
        return future.result()

    def call(self, service):
        client = self.node.create_client(Trigger, service)
        self.until(client.service_is_ready, service)
        answer = self.answer(client.call_async(Trigger.Request()), service)
        self.node.destroy_client(client)
        return answer

    def begin(self, client, goal):
        """Send a goal; return the future of its result."""
        self.until(client.server_is_ready, "the action server")
        handle = self.answer(client.send_goal_async(goal), "an answer to the goal")
        assert handle.accepted, self.gripper and self.gripper.refusal
        return handle.get_result_async()

    def act(self, client, goal):
        answer = self.answer(self.begin(client, goal), "a result")
        return answer.status == GoalStatus.STATUS_SUCCEEDED, answer.result

    def ready(self):
        self.until(
            lambda: (
                self.servos is not None
                and self.servos.state == ServoState.ACTIVE
                and self.gripper is not None
                and self.gripper.message == "ready for a grasp"
                and self.ball.services_are_ready()
            ),
            "a ready gripper",
        )

    def set_ball(self, name, value):
        future = self.ball.set_parameters([Parameter(name, value=value)])
        (result,) = self.answer(future, f"set {name}").results
        assert result.successful, result.reason

    def grasp(self, force=0.3):
        succeeded, result = self.act(
            self.grasp_client, Grasp.Goal(object="ball", force=force, timeout=LIMIT)
        )
        assert succeeded and result.reached, result.message
        return result

    def release(self, **goal):
        return self.act(self.release_client, Release.Goal(**goal))

    def measured(self):
        """Newest measured pull of each finger [m]."""
        return {name: self.pulls[name][1] for name in FINGERS}

    def forces(self):
        """Sum of the contact forces of each finger [N]."""
        return {n: sum(c.force for c in s.contacts) for n, s in self.states.items()}

    def sizes(self):
        """Memory [kB] and number of threads of each process."""
        found = {}
        for name, child in self._running.items():
            with open(f"/proc/{child.pid}/status") as status:
                values = dict(line.split(":", 1) for line in status)
            found[name] = (int(values["VmRSS"].split()[0]), int(values["Threads"]))
        return found

    def close(self):
        self._executor.shutdown()
        self.node.destroy_node()


@contextmanager
def rigs(folder, *namespaces, patience=10.0, rate=20.0):
    """Give a started gripper for each namespace; all of them end with the block.

    patience: silence of others that the coordinator bears [s], as the machine may be busy; None:
    its default.
    rate: cycles of the servo bridge per second.
    """
    context = rclpy.Context()
    rclpy.init(args=[], context=context)
    environ = {**os.environ, **import_environment(os.environ)}
    made = []
    try:
        with ExitStack() as stack:
            for namespace in namespaces:
                place = folder / namespace.strip("/")
                place.mkdir()
                children = stack.enter_context(Children(place, environ))
                made.append(Rig(children, place, context, namespace, patience, rate))
                for name in (*NODES, BALL_NODE.name):
                    made[-1].start(name)
            for rig in made:
                rig.ready()
            yield made
    finally:
        for rig in made:
            rig.close()
        context.try_shutdown()
