# SPDX-License-Identifier: Apache-2.0
"""The coordinator's actions that move what is held: move_object, and rotate, a part of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ccr_msgs.action import MoveObject, Rotate
from rclpy.node import Node

from ccr_ros.grasp.coordinator import GripperCoordinator
from ccr_ros.grasp.moves import MoveRun, move_goal
from ccr_ros.grasp.runs import End, Outcome

from .goal_desk import GoalDesk
from .move_conversions import motion_message, vector_of


class MoveActions:
    """Serves both actions; they have the same results and feedback.

    Args:
        node: To serve them on.
        gripper: What does the work.
        clock: Returns the time that the gripper's steps are of [s].
    """

    def __init__(self, node: Node, gripper: GripperCoordinator, clock: Callable[[], float]) -> None:
        self._gripper = gripper
        self._clock = clock
        self._node = node
        self.desks = [
            self._desk(MoveObject, "move_object", self._begin_move),
            self._desk(Rotate, "rotate", self._begin_turn),
        ]

    def _desk(self, action: Any, name: str, begin: Callable[[Any], MoveRun]) -> GoalDesk:
        return GoalDesk(
            self._node,
            action,
            name,
            begin,
            self._gripper.cancel,
            lambda run: self._result(run, action.Result()),
            lambda run: self._fill(run, action.Feedback()),
        )

    def _begin_move(self, request: MoveObject.Goal) -> MoveRun:
        return self._begin(request, vector_of(request.shift), vector_of(request.turn))

    def _begin_turn(self, request: Rotate.Goal) -> MoveRun:
        return self._begin(request, [0.0, 0.0, 0.0], [0.0, 0.0, request.angle])

    def _begin(self, request: Any, shift: list[float], turn: list[float]) -> MoveRun:
        try:
            goal = move_goal(
                self._gripper.settings,
                shift=shift,
                turn=turn,
                margin=request.margin,
                duration=request.duration,
                speed=request.speed,
                partial=request.partial,
            )
        except Exception as error:
            self._gripper.refusal = str(error)
            raise
        return self._gripper.move(goal, self._clock())

    def _result(self, run: Any, message: Any) -> Any:
        outcome = run.outcome or Outcome(End.FAILED, "ended without an outcome")
        message.reached = outcome.reached
        message.limiting = outcome.limiting
        message.message = outcome.message
        message.state = str(self._gripper.state)
        message.motion = motion_message(run.motion)
        return message

    def _fill(self, run: Any, message: Any) -> Any:
        message.state = str(self._gripper.state)
        message.phase = self._gripper.phase
        message.motion = motion_message(run.motion)
        return message
