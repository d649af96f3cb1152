# SPDX-License-Identifier: Apache-2.0
"""The demo's story, told to the nodes step by step: calibrate, grasp, hold, more weight, let go."""

from __future__ import annotations

import time
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

from .ball import MASS, SUPPORTED
from .scene import BALL, GRIP_FORCE, HEAVY, LIGHT

_READY_TIMEOUT = 30.0  # s until all nodes are there
_ANSWER_TIMEOUT = 10.0  # s for an answer that needs no motion
_REFUSALS, _AGAIN = 10.0, 0.3  # s for which a goal that is refused is sent again, and how often
_CALIBRATION_TIMEOUT = 60.0  # s
_GRASP_TIMEOUT = 40.0  # s
_RELEASE_DELAY = 3.0  # s; the paper's gripper lets go at a set time
_RELEASE_TIMEOUT = 30.0  # s, from when it begins
_SETTLE = 1.0  # s, of looking at what has been reached

Steps = Generator[None, None, None]


class Show:
    """Plays the story through services, actions and parameters, as a person's program would.

    Args:
        node: Talks to the others; somebody else spins it.
        hold: How long the ball is held [s].

    Attributes:
        phase: What is going on, in a few words.
        done: Whether the story has ended.
        gripper, servos: The newest states heard, or None.
    """

    def __init__(self, node: Node, hold: float) -> None:
        self.phase = "starting"
        self.done = False
        self.gripper: GripperState | None = None
        self.servos: ServoState | None = None
        self._hold = hold
        self._calibrate = node.create_client(Calibrate, "servo_bridge_node/calibrate")
        self._grasp = ActionClient(node, Grasp, "grasp")
        self._release = ActionClient(node, Release, "release")
        self._ball = AsyncParameterClient(node, "demo_ball")
        node.create_subscription(GripperState, "gripper_state", self._gripper_heard, LATCHED)
        node.create_subscription(ServoState, "servo_state", self._servos_heard, LATCHED)
        self._steps = self._story()

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

    # -- the story ---------------------------------------------------------------------------

    def _story(self) -> Steps:
        yield from self._until(self._all_there, _READY_TIMEOUT, "the nodes to be ready")
        self.phase = "calibrating"
        answer = yield from self._answer(
            self._calibrate.call_async(Calibrate.Request()), _CALIBRATION_TIMEOUT, "calibrate"
        )
        if not answer.success:
            raise StackFailed(f"calibrating failed: {answer.message}")
        self.phase = "closing"
        grasped = yield from self._act(
            self._grasp, Grasp.Goal(object=BALL.name, force=GRIP_FORCE), _GRASP_TIMEOUT, "grasp"
        )
        if not grasped.reached:
            raise StackFailed(f"the ball was not grasped: {grasped.message}")
        yield from self._nap(_SETTLE)
        yield from self._set_ball(SUPPORTED, False)
        self.phase = f"holding {LIGHT * 1e3:g} g"
        yield from self._nap(self._hold / 2)
        yield from self._set_ball(MASS, HEAVY)
        self.phase = f"holding {HEAVY * 1e3:g} g"
        yield from self._nap(self._hold / 2)
        yield from self._let_go()
        self.phase = "open"
        yield from self._nap(_SETTLE)

    def _let_go(self) -> Steps:
        """Let go at a set time; the stand is back under the ball by then."""
        self.phase = "holding, timed release"
        opening = self._act(
            self._release,
            Release.Goal(delay=_RELEASE_DELAY),
            _RELEASE_DELAY + _RELEASE_TIMEOUT,
            "release",
        )
        caught = False
        while True:
            try:
                next(opening)
            except StopIteration as end:
                if not end.value.released:
                    raise StackFailed(f"the ball was not released: {end.value.message}") from None
                return
            opens = self.gripper is not None and self.gripper.state == GripperState.RELEASING
            if opens and not caught:
                caught = True
                self.phase = "releasing"
                yield from self._set_ball(SUPPORTED, True)
            yield

    # -- how ---------------------------------------------------------------------------------

    def _all_there(self) -> bool:
        return (
            self.gripper is not None
            and self.servos is not None
            and self.servos.state == ServoState.ACTIVE
            and self._calibrate.service_is_ready()
            and self._grasp.server_is_ready()
            and self._release.server_is_ready()
            and self._ball.services_are_ready()
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

    def _set_ball(self, name: str, value: Any) -> Steps:
        future = self._ball.set_parameters([Parameter(name, value=value)])
        answer = yield from self._answer(future, _ANSWER_TIMEOUT, f"set {name}")
        (result,) = answer.results
        if not result.successful:
            raise StackFailed(f"the ball could not change {name!r}: {result.reason}")

    def _gripper_heard(self, message: GripperState) -> None:
        self.gripper = message

    def _servos_heard(self, message: ServoState) -> None:
        self.servos = message
