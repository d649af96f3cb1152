# SPDX-License-Identifier: Apache-2.0
"""The solver node's service ~/plan_move: which pulls would move the object in hand."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator

from ccr_msgs.srv import PlanMove
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.task import Future

from ccr_ros.grasp.manipulation import MovePlan, Waypoint, move_steps
from ccr_ros.model import CcrError, InvalidValue

from .grasp_channel import GraspChannel
from .move_conversions import BUSY, fill_plan, limits_from_request, target_from_request
from .turns import take_turn

Steps = Generator[Waypoint | None, str | None, MovePlan]


class MoveService:
    """Plans one motion at a time, a solve per call of `work`, and so per turn of the node.

    The plan is made on a copy of the grasp, which goes on with its stream of pulls meanwhile.

    Args:
        node: The node to make the service on.
        grasp: The object in hand; None: the node's mode knows of none.
        margin: Least friction margin of a plan where a request asks for none.
        time_limit: Longest that a plan may take [s].
        wake: Called when there is something to `work` on.
    """

    def __init__(
        self,
        node: Node,
        grasp: GraspChannel | None,
        margin: float,
        time_limit: float,
        wake: Callable[[], None],
    ) -> None:
        self._grasp = grasp
        self._margin, self._time_limit = margin, time_limit
        self._wake = wake
        self._log = node.get_logger().get_child("plan_move")
        self._asked: tuple[PlanMove.Request, Future] | None = None
        self._steps: Steps | None = None
        self._ends_at = 0.0
        # A group of its own: while an answer is waited for the node's other callbacks go on.
        node.create_service(
            PlanMove, "~/plan_move", self._serve, callback_group=ReentrantCallbackGroup()
        )

    @property
    def busy(self) -> bool:
        """Whether there is a plan to work on."""
        return self._asked is not None

    def work(self) -> None:
        """Do one solve for the plan that is asked for; answer when it is done."""
        if self._asked is None:
            return
        request, answer = self._asked
        if take_turn(lambda: self._turn(request), answer, self._log):
            self._asked = self._steps = None

    def _turn(self, request: PlanMove.Request) -> None:
        if self._steps is None:
            self._steps = self._begun(request)
            next(self._steps)
        else:
            late = time.monotonic() > self._ends_at
            self._steps.send(f"the time limit of planning: {self._time_limit:g} s" if late else "")

    async def _serve(
        self, request: PlanMove.Request, response: PlanMove.Response
    ) -> PlanMove.Response:
        if self._asked is not None:
            response.message = BUSY
            return response
        answer: Future = Future()
        self._asked = request, answer
        self._wake()
        result = await answer
        if isinstance(result, MovePlan):
            assert self._grasp is not None
            cables = {n: finger.cable_names for n, finger in self._grasp.by_name.items()}
            return fill_plan(response, result, cables)
        text = str(result) if isinstance(result, CcrError) else repr(result)
        response.message = f"refused: {text}"
        return response

    def _begun(self, request: PlanMove.Request) -> Steps:
        if self._grasp is None:
            raise InvalidValue("mode", "fingers", "gripper, the mode that knows of an object")
        target = target_from_request(request)
        limits = limits_from_request(request, self._grasp.by_name, self._margin)
        self._ends_at = time.monotonic() + self._time_limit
        return move_steps(self._grasp.plan_solver(), target, limits)
