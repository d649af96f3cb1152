# SPDX-License-Identifier: Apache-2.0
"""The coordinator's actions: grasp, release and, where control_msgs is there, gripper_cmd.

Those that move what is held are in `move_actions`.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

from ccr_msgs.action import Grasp, Release
from ccr_msgs.msg import FingerGrip
from rclpy.node import Node

from ccr_ros.grasp.coordinator import GripperCoordinator
from ccr_ros.grasp.runs import End, Outcome, Run, grasp_goal, release_goal
from ccr_ros.model import checks

from .goal_desk import GoalDesk
from .move_actions import MoveActions

_SAME_GAP = 0.0005  # m; gripper_cmd positions that differ by less ask for no motion outwards


class GripperActions:
    """Serves the actions.

    Args:
        node: To serve them on.
        gripper: What does the work.
        clock: Returns the time that the gripper's steps are of [s].
        fingers: Returns the fingers as messages.
    """

    def __init__(
        self,
        node: Node,
        gripper: GripperCoordinator,
        clock: Callable[[], float],
        fingers: Callable[[], list[FingerGrip]],
    ) -> None:
        self._gripper = gripper
        self._clock = clock
        self._fingers = fingers
        cancel = gripper.cancel
        self.desks = [
            GoalDesk(
                node,
                Grasp,
                "grasp",
                self._begin_grasp,
                cancel,
                self._grasp_result,
                self._grasp_feedback,
            ),
            GoalDesk(
                node,
                Release,
                "release",
                self._begin_release,
                cancel,
                self._release_result,
                self._release_feedback,
            ),
            *MoveActions(node, gripper, clock).desks,
        ]
        if find_spec("control_msgs") is not None:
            from control_msgs.action import GripperCommand

            self._command = GripperCommand
            self.desks.append(
                GoalDesk(
                    node,
                    GripperCommand,
                    "gripper_cmd",
                    self._begin_command,
                    cancel,
                    lambda run: self._fill_command(GripperCommand.Result(), run),
                    lambda run: self._fill_command(GripperCommand.Feedback(), run),
                )
            )

    def answer(self) -> None:
        """Answer the goals that are over."""
        for desk in self.desks:
            desk.answer()

    def tell(self) -> None:
        """Publish feedback."""
        for desk in self.desks:
            desk.tell()

    # grasp

    def _begin_grasp(self, request: Grasp.Goal) -> Run:
        goal = self._checked(
            grasp_goal,
            self._gripper.settings,
            tuple(self._gripper.fingers),
            thing=request.object,
            gap=request.width,
            force=request.force,
            speed=request.speed,
            timeout=request.timeout,
            required=tuple(request.required_fingers),
        )
        return self._gripper.grasp(goal, self._clock())

    def _grasp_result(self, run: Run) -> Grasp.Result:
        outcome = _outcome(run)
        return Grasp.Result(
            reached=outcome.reached,
            stalled=outcome.stalled,
            state=str(self._gripper.state),
            message=outcome.message,
            fingers=self._fingers(),
        )

    def _grasp_feedback(self, run: Run) -> Grasp.Feedback:
        return Grasp.Feedback(
            state=str(self._gripper.state), phase=self._gripper.phase, fingers=self._fingers()
        )

    # release

    def _begin_release(self, request: Release.Goal) -> Run:
        goal = self._checked(release_goal, delay=request.delay, fast=request.fast)
        return self._gripper.release(goal, self._clock())

    def _release_result(self, run: Run) -> Release.Result:
        outcome = _outcome(run)
        return Release.Result(
            released=outcome.reached,
            state=str(self._gripper.state),
            message=outcome.message,
            fingers=self._fingers(),
        )

    def _release_feedback(self, run: Run) -> Release.Feedback:
        return Release.Feedback(
            remaining=max(0.0, self._gripper.release_in(self._clock())),
            state=str(self._gripper.state),
            fingers=self._fingers(),
        )

    # gripper_cmd

    def _begin_command(self, request: Any) -> Run:
        command = request.command
        gap = self._checked(checks.real, "position", command.position, low=0.0, unit="m")
        force = self._checked(checks.real, "max_effort", command.max_effort, low=0.0, unit="N")
        if gap > self._gap() + _SAME_GAP:
            return self._gripper.release(release_goal(gap=gap), self._clock())
        goal = grasp_goal(
            self._gripper.settings,
            tuple(self._gripper.fingers),
            force=min(force, self._gripper.settings.max_force),
            least_gap=gap,
        )
        return self._gripper.grasp(goal, self._clock())

    def _fill_command(self, message: Any, run: Run) -> Any:
        fingers = self._gripper.fingers.values()
        outcome = run.outcome
        held = self._gripper.object_held
        message.position = self._gap()
        message.effort = sum(finger.force() for finger in fingers) / len(fingers)
        message.stalled = held or (outcome is not None and outcome.stalled)
        message.reached_goal = outcome is not None and outcome.reached and not held
        return message

    def _gap(self) -> float:
        fingers = self._gripper.fingers.values()
        return sum(f.free.gap_at(f.measured_place) for f in fingers) / len(fingers)

    def _checked(self, make: Callable[..., Any], *args: Any, **values: Any) -> Any:
        """Return what is made of a request; the reason to refuse it is told like any other."""
        try:
            return make(*args, **values)
        except Exception as error:
            self._gripper.refusal = str(error)
            raise


def _outcome(run: Run) -> Outcome:
    return run.outcome or Outcome(End.FAILED, "ended without an outcome")
