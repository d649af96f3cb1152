# SPDX-License-Identifier: Apache-2.0
"""What a demo's story is told with: waiting, calling, goals and parameters, a step at a time."""

from __future__ import annotations

import math
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator
from typing import Any

from action_msgs.msg import GoalStatus
from ccr_msgs.action import Grasp, Release
from ccr_msgs.msg import GripperState, ServoState
from ccr_msgs.srv import Calibrate
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.task import Future

from ccr_ros.nodes.qos import LATCHED
from ccr_ros.stack.parts import StackFailed

_READY_TIMEOUT = 30.0  # s until all nodes are there
_ANSWER_TIMEOUT = 10.0  # s for an answer that needs no motion
_REFUSALS, _AGAIN = 10.0, 0.3  # s for which a goal that is refused is sent again, and how often
_CALIBRATION_TIMEOUT = 60.0  # s

Steps = Generator[None, None, None]


class Story(ABC):
    """Plays a story through services, actions and parameters, as a person's program would.

    Args:
        node: Talks to the others; somebody else spins it.
        hold: How long the object is held [s].
        world: Name of the node that is there in place of the object.

    Attributes:
        phase: What is going on, in a few words.
        done: Whether the story has ended.
        gripper, servos: The newest states heard, or None.
    """

    def __init__(self, node: Node, hold: float, world: str) -> None:
        self.phase = "starting"
        self.done = False
        self.gripper: GripperState | None = None
        self.servos: ServoState | None = None
        self._hold = hold
        self._world_name = world
        self._calibrate = node.create_client(Calibrate, "servo_bridge_node/calibrate")
        self._grasp = ActionClient(node, Grasp, "grasp")
        self._release = ActionClient(node, Release, "release")
        self._world = AsyncParameterClient(node, world)
        node.create_subscription(GripperState, "gripper_state", self._gripper_heard, LATCHED)
        node.create_subscription(ServoState, "servo_state", self._servos_heard, LATCHED)
        self._steps = self._whole()

    def go_on(self) -> None:
        """Do what can be done now; call it often.

        Raises:
            StackFailed: A node has refused something, or did not answer.
        """
        if not self.done:
            try:
                next(self._steps)
            except StopIteration:
                self.done = True

    @abstractmethod
    def _story(self) -> Steps:
        """What happens once all nodes are there and the cables are wound."""

    def _whole(self) -> Steps:
        yield from self._until(self._all_there, _READY_TIMEOUT, "the nodes to be ready")
        self.phase = "calibrating"
        answer = yield from self._answer(
            self._calibrate.call_async(Calibrate.Request()), _CALIBRATION_TIMEOUT, "calibrate"
        )
        if not answer.success:
            raise StackFailed(f"calibrating failed: {answer.message}")
        yield from self._story()

    def _all_there(self) -> bool:
        return (
            self.gripper is not None
            and self.servos is not None
            and self.servos.state == ServoState.ACTIVE
            # Simulated servos hear of them from the solver, which may take its time at first.
            and not any(math.isnan(joint.tension) for joint in self.servos.joints)
            and self._calibrate.service_is_ready()
            and self._grasp.server_is_ready()
            and self._release.server_is_ready()
            and self._world.services_are_ready()
        )

    def _until(self, condition: Callable[[], bool], limit: float, what: str) -> Steps:
        end = time.monotonic() + limit
        while not condition():
            if time.monotonic() > end:
                raise StackFailed(f"waited {limit:g} s for {what}, in vain")
            yield

    def _nap(self, seconds: float) -> Steps:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            yield

    def _answer(self, future: Future, limit: float, what: str) -> Generator[None, None, Any]:
        yield from self._until(future.done, limit, f"an answer to {what!r}")
        return future.result()

    def _act(self, client: Any, goal: Any, limit: float, what: str) -> Generator[None, None, Any]:
        end = time.monotonic() + _REFUSALS
        while True:
            handle = yield from self._answer(client.send_goal_async(goal), _ANSWER_TIMEOUT, what)
            if handle.accepted:
                break
            # The coordinator may not have heard yet what this node has: that the servos are ready.
            if time.monotonic() > end:
                why = self.gripper.refusal if self.gripper is not None else ""
                raise StackFailed(f"the coordinator refused to {what}{f': {why}' if why else ''}")
            yield from self._nap(_AGAIN)
        answer = yield from self._answer(handle.get_result_async(), limit, what)
        if answer.status not in (GoalStatus.STATUS_SUCCEEDED, GoalStatus.STATUS_ABORTED):
            raise StackFailed(f"{what} was canceled: {answer.result.message}")
        return answer.result

    def _set_world(self, name: str, value: Any) -> Steps:
        future = self._world.set_parameters([Parameter(name, value=value)])
        answer = yield from self._answer(future, _ANSWER_TIMEOUT, f"set {name}")
        (result,) = answer.results
        if not result.successful:
            raise StackFailed(f"{self._world_name} could not change {name!r}: {result.reason}")

    def _gripper_heard(self, message: GripperState) -> None:
        self.gripper = message

    def _servos_heard(self, message: ServoState) -> None:
        self.servos = message
