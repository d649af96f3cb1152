# SPDX-License-Identifier: Apache-2.0
"""A gripper's nodes in one executor: the solver, a servo bridge in a few lines, the coordinator."""

from __future__ import annotations

import math
import time
from typing import Any

from ccr_msgs.action import Grasp, Release
from ccr_msgs.msg import CablePulls, FingerState, GripperState, ServoJoint, ServoState
from probe import Probe, objects, sphere
from rclpy.action import ActionClient
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Header
from std_srvs.srv import Trigger

from ccr_ros.nodes.gripper_coordinator_node import GripperCoordinatorNode
from ccr_ros.nodes.solver_node import SolverNode

FINGERS = ("finger_1", "finger_2", "finger_3")
BALL = sphere("ball", 0.056, (0.0, 0.0, 0.11))
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)

OPEN = 0.004  # m

# In a hurry, but patient with a machine that is not: the ball is touched at 5.35 mm.
QUICK = {
    **{f"{name}.open_pulls": [OPEN] for name in FINGERS},
    "blind_lead": 0.0006,
    "control_rate": 25.0,
    "open_speed": 0.01,
    "close_speed": 0.004,
    "fast_release_speed": 0.01,
    "slow_release_speed": 0.004,
    "press_rate": 0.5,
    "force_gain": 0.003,
    "force_speed": 0.002,
    "settle_time": 0.15,
    "bridge_timeout": 15.0,
    "solver_timeout": 15.0,
    "stale_timeout": 15.0,
    "stall_time": 10.0,
}


class FakeBridge(Node):
    """Follows commands with a lag, and tells what the servos feel: the solver's tensions."""

    RATE = 25.0
    LAG = 0.06

    def __init__(self, context: Context, at: float = OPEN) -> None:
        super().__init__("fake_bridge", namespace="gripper", context=context)
        self.at = dict.fromkeys(FINGERS, at)
        self.wanted = dict(self.at)
        self.tensions = dict.fromkeys(FINGERS, math.nan)
        self.commands: dict[str, list[float]] = {name: [] for name in FINGERS}
        self.silent = False
        self.stuck: set[str] = set()
        self.fault = ""
        self._pulls = {}
        for name in FINGERS:
            self._pulls[name] = self.create_publisher(CablePulls, f"{name}/cable_pulls", 1)
            self.create_subscription(
                CablePulls, f"{name}/cable_pull_commands", lambda m, n=name: self._take(n, m), 1
            )
            self.create_subscription(
                FingerState, f"{name}/state", lambda m, n=name: self._feel(n, m), LATCHED
            )
        self._state = self.create_publisher(ServoState, "servo_state", LATCHED)
        self.create_timer(1.0 / self.RATE, self._step)

    def _take(self, name: str, message: CablePulls) -> None:
        self.commands[name].append(message.pulls[0])
        if not self.silent and not self.fault:
            self.wanted[name] = message.pulls[0]

    def _feel(self, name: str, message: FingerState) -> None:
        self.tensions[name] = message.tensions[0]

    def tell_stale(self, name: str, state: FingerState) -> None:
        """Say in the solver's place that it cannot solve a finger."""
        state.stale = True
        publisher = self.create_publisher(FingerState, f"{name}/state", LATCHED)
        self.create_timer(1.0 / self.RATE, lambda: publisher.publish(state))

    def _step(self) -> None:
        if self.silent:
            return
        state = ServoState(state=ServoState.FAULT if self.fault else ServoState.ACTIVE)
        state.reason = self.fault
        for name in FINGERS:
            if name not in self.stuck and not self.fault:
                share = -math.expm1(-1.0 / self.RATE / self.LAG)
                self.at[name] += share * (self.wanted[name] - self.at[name])
            header = Header(stamp=self.get_clock().now().to_msg())
            self._pulls[name].publish(CablePulls(header=header, pulls=[self.at[name]]))
            joint = ServoJoint(name=f"{name}_main", finger=name, cable="main")
            joint.tension = self.tensions[name]
            state.joints.append(joint)
        self._state.publish(state)


class Goal:
    """A goal that was sent: whether it was accepted, what it tells, and its result."""

    def __init__(self, stack: GripperStack, client: ActionClient, goal: Any) -> None:
        self._stack = stack
        self.feedback: list[Any] = []
        sent = client.send_goal_async(goal, lambda m: self.feedback.append(m.feedback))
        stack.probe.until(sent.done, "an answer to the goal")
        self.handle = sent.result()
        self.accepted = self.handle.accepted
        self._future = self.handle.get_result_async() if self.accepted else None

    @property
    def over(self) -> bool:
        return self._future.done()

    def result(self) -> Any:
        deadline = time.monotonic() + 60.0  # never reached when all is well
        while not self.over:
            now = self._stack.now
            assert time.monotonic() < deadline, f"{now.state}: {now.message}"
            self._stack.probe.executor.spin_once(timeout_sec=0.05)
        self.status = self._future.result().status
        return self._future.result().result

    def cancel(self) -> bool:
        """Cancel; tell whether that was accepted."""
        future = self.handle.cancel_goal_async()
        self._stack.probe.until(future.done, "an answer to the cancel request")
        return bool(future.result().goals_canceling)


class GripperStack:
    """The nodes, and what a person does with them."""

    def __init__(
        self,
        context: Context,
        probe: Probe,
        at: float = OPEN,
        bridge: Any = None,
        mode: str = "fingers",
        solver: dict[str, Any] | None = None,
        start: bool = True,
        **values: Any,
    ) -> None:
        self.context = context
        self.probe = probe
        self._ended: list[Node] = []
        parameters = {"mode": mode} if solver is None else solver
        overrides = [Parameter(name, value=value) for name, value in parameters.items()]
        self.solver = probe.add(
            SolverNode(context=context, namespace="gripper", parameter_overrides=overrides)
        )
        self.bridge = bridge or probe.add(FakeBridge(context, at))
        self._values = values
        if start:
            self.start()
        self.clients = {
            kind: ActionClient(probe.node, kind, name)
            for kind, name in ((Grasp, "grasp"), (Release, "release"))
        }
        self.states: list[GripperState] = []
        probe.node.create_subscription(GripperState, "gripper_state", self.states.append, LATCHED)

    def start(self) -> None:
        """Start the coordinator with the parameters that were given."""
        self.node = self.start_coordinator(**self._values)

    def start_coordinator(self, **values: Any) -> GripperCoordinatorNode:
        settings = {**QUICK, **values}
        overrides = [Parameter(name, value=value) for name, value in settings.items()]
        node = GripperCoordinatorNode(
            context=self.context, namespace="gripper", parameter_overrides=overrides
        )
        return self.probe.add(node)

    def end(self, node: Node) -> None:
        """Have a node fall silent, as if its process had been killed."""
        self.probe.executor.remove_node(node)
        self._ended.append(node)

    def close(self) -> None:
        for node in self._ended:
            node.destroy_node()

    @property
    def now(self) -> GripperState:
        return self.states[-1]

    def show(self, *things: Any) -> None:
        """Put objects where they are, and wait until the solver knows them."""
        self.probe.publish("objects", objects(*things))

    def until_state(self, state: str, text: str = "") -> GripperState:
        self.probe.until(
            lambda: self.states and self.now.state == state and text in self.now.message,
            f"the state {state} ({text})",
        )
        return self.now

    def ready(self) -> GripperStack:
        """Wait until the coordinator knows where the fingers are."""
        for client in self.clients.values():
            self.probe.until(client.server_is_ready, "the actions")
        self.until_state("idle", "ready for a grasp")
        return self

    def grasp(self, **values: Any) -> Goal:
        return Goal(self, self.clients[Grasp], Grasp.Goal(**values))

    def release(self, **values: Any) -> Goal:
        return Goal(self, self.clients[Release], Release.Goal(**values))

    def holding(self) -> GripperStack:
        """Show the ball and hold it."""
        self.ready().show(BALL)
        assert self.grasp(object="ball", force=0.2).result().reached
        return self

    def call(self, name: str) -> Trigger.Response:
        client = self.probe.node.create_client(Trigger, name)
        self.probe.until(client.service_is_ready, f"the service {name}")
        future = client.call_async(Trigger.Request())
        return self.probe.until(lambda: future.done() and future.result(), f"{name}'s answer")
