# SPDX-License-Identifier: Apache-2.0
"""The gripper of the paper's cube, its nodes in one executor: what it holds it can move."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import numpy as np
from ccr_msgs.action import MoveObject, Rotate
from ccr_msgs.msg import CablePulls, GraspState, Object, ServoState
from ccr_msgs.srv import PlanMove
from geometry_msgs.msg import Pose, Vector3
from gripper_stack import LATCHED, Goal, GripperStack
from probe import Probe
from rclpy.action import ActionClient
from rclpy.context import Context
from rclpy.node import Node
from shape_msgs.msg import SolidPrimitive
from std_msgs.msg import Header

CABLES = {"finger_1": ("left", "right"), "finger_2": ("main",), "finger_3": ("main",)}
SHUT = {"finger_1": [0.00217] * 2, "finger_2": [0.003524], "finger_3": [0.003524]}  # m, it holds

CUBE = Object(name="cube", mass=0.01, friction=0.8)
CUBE.primitive = SolidPrimitive(type=SolidPrimitive.BOX, dimensions=[0.04] * 3)
CUBE.pose.position.z, CUBE.pose.orientation.w = 0.170, 1.0

QUICK = {
    **{f"{name}.open_pulls": [0.5 * pull for pull in pulls] for name, pulls in SHUT.items()},
    **{f"{name}.closed_pulls": [1.3 * pull for pull in pulls] for name, pulls in SHUT.items()},
    **{f"{name}.least_pulls": [0.0] * len(pulls) for name, pulls in SHUT.items()},
    **{f"{name}.largest_pulls": [0.008] * len(pulls) for name, pulls in SHUT.items()},
    "effort_margin": 0.0,
    "move_speed": 0.001,
    "slow_release_speed": 0.005,
}


class CubeBridge(Node):
    """Follows commands with a lag."""

    RATE = 25.0
    SHARE = 0.5  # of the way to the command, per step

    def __init__(self, context: Context) -> None:
        super().__init__("fake_bridge", namespace="gripper", context=context)
        self.at = {name: np.array(pulls) for name, pulls in SHUT.items()}
        self.wanted = {name: pulls.copy() for name, pulls in self.at.items()}
        self.stuck: set[str] = set()
        self.fault = ""
        self._pulls = {}
        for name in CABLES:
            self._pulls[name] = self.create_publisher(CablePulls, f"{name}/cable_pulls", 1)
            self.create_subscription(
                CablePulls, f"{name}/cable_pull_commands", lambda m, n=name: self._take(n, m), 1
            )
        self._state = self.create_publisher(ServoState, "servo_state", LATCHED)
        self.create_timer(1.0 / self.RATE, self._step)

    def _take(self, name: str, message: CablePulls) -> None:
        assert tuple(message.names) == CABLES[name]
        self.wanted[name] = np.array(message.pulls)

    def _step(self) -> None:
        state = ServoState(state=ServoState.FAULT if self.fault else ServoState.ACTIVE)
        state.reason = self.fault
        for name in CABLES:
            if name not in self.stuck and not self.fault:
                self.at[name] = self.at[name] + self.SHARE * (self.wanted[name] - self.at[name])
            header = Header(stamp=self.get_clock().now().to_msg())
            pulls = self.at[name].tolist()
            self._pulls[name].publish(CablePulls(header=header, pulls=pulls))
        self._state.publish(state)


class CubeStack(GripperStack):
    """The gripper's nodes, with what moves what is held."""

    def __init__(
        self, context: Context, probe: Probe, solver: dict[str, Any] | None = None, **values: Any
    ) -> None:
        super().__init__(
            context,
            probe,
            bridge=probe.add(CubeBridge(context)),
            solver={
                "mode": "gripper",
                "gripper_file": "gripper_cube",
                "time_limit": 2.0,
                **(solver or {}),
            },
            start=False,
            **{**QUICK, "gripper_file": "gripper_cube", **values},
        )
        for kind, name in ((MoveObject, "move_object"), (Rotate, "rotate")):
            self.clients[kind] = ActionClient(probe.node, kind, name)
        self.plans = probe.node.create_client(PlanMove, "solver_node/plan_move")
        self.grasps: list[GraspState] = probe.listen(GraspState, "grasp_state")

    @property
    def thing(self) -> GraspState:
        """What the solver says of the object, the newest."""
        return self.grasps[-1]

    def place(self, **values: Any) -> None:
        """Say what the cube is."""
        cube = deepcopy(CUBE)
        for name, value in values.items():
            setattr(cube, name, value)
        self.show(cube)

    def carry(self) -> CubeStack:
        """Have the fingers carry the cube."""
        self.place()
        self.probe.until(lambda: self.grasps and self.thing.contacts, "a touch")
        self.place(held=True)
        self.probe.until(lambda: self.thing.held and not self.thing.stale, "the cube held")
        return self

    def holding(self) -> CubeStack:
        """Have the coordinator find the cube held."""
        self.carry()
        self.start()
        for client in self.clients.values():
            self.probe.until(client.server_is_ready, "the actions")
        self.until_state("holding", "found holding")
        return self

    def move(self, shift: Any = (0, 0, 0), turn: Any = (0, 0, 0), **values: Any) -> Goal:
        goal = MoveObject.Goal(shift=vector(shift), turn=vector(turn), **values)
        return Goal(self, self.clients[MoveObject], goal)

    def rotate(self, angle: float, **values: Any) -> Goal:
        return Goal(self, self.clients[Rotate], Rotate.Goal(angle=angle, **values))

    def plan(self, **values: Any) -> PlanMove.Response:
        """Ask the solver node for a plan, and wait for it."""
        for name in ("shift", "turn"):
            if name in values:
                values[name] = vector(values[name])
        self.probe.until(self.plans.service_is_ready, "the service plan_move")
        future = self.plans.call_async(PlanMove.Request(**values))
        return self.probe.until(lambda: future.done() and future.result(), "a plan")


def vector(values: Any) -> Vector3:
    x, y, z = map(float, values)
    return Vector3(x=x, y=y, z=z)


def angle_between(one: Pose, two: Pose) -> float:
    """Return the angle [rad] between two orientations."""
    a, b = one.orientation, two.orientation
    q = np.array([a.x, a.y, a.z, a.w]), np.array([b.x, b.y, b.z, b.w])
    return float(
        2.0 * np.arcsin(min(1.0, 0.5 * min(np.linalg.norm(q[0] - s * q[1]) for s in (1, -1)))) * 2.0
    )


def array(message: Vector3) -> np.ndarray:
    return np.array([message.x, message.y, message.z])
