# SPDX-License-Identifier: Apache-2.0
"""Goals of one action: taken in, told about, and answered when what they ask for is over."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node

from ccr_ros.grasp.runs import End, Run
from ccr_ros.model import CcrError


class GoalDesk:
    """Serves an action whose goals take long, without threads: the coordinator's steps do the work.

    An accepted goal is kept, and executed (rclpy's deferred execution) when its run is over: then
    the callback only gives the result. Until then its status is ACCEPTED.

    Args:
        node: To serve the action on.
        action: Its type.
        name: Its name.
        begin: Begins what a request asks for; a CcrError rejects it.
        cancel: Gives up a run.
        result: Makes the result of a run.
        feedback: Makes the feedback of a run.
    """

    def __init__(
        self,
        node: Node,
        action: Any,
        name: str,
        begin: Callable[[Any], Run],
        cancel: Callable[[Run], None],
        result: Callable[[Run], Any],
        feedback: Callable[[Run], Any],
    ) -> None:
        self._log = node.get_logger().get_child(name)
        self._begin, self._cancel = begin, cancel
        self._result, self._feedback = result, feedback
        self._begun: Run | None = None  # of the goal that is being accepted
        self._open: list[tuple[ServerGoalHandle, Run]] = []
        self._over: list[tuple[ServerGoalHandle, Run]] = []  # rclpy answers them next
        self._server = ActionServer(
            node,
            action,
            name,
            execute_callback=self._answer,
            goal_callback=self._take,
            handle_accepted_callback=self._keep,
            cancel_callback=self._give_up,
        )

    def tell(self) -> None:
        """Publish feedback to all goals that are open."""
        for handle, run in self._open:
            handle.publish_feedback(self._feedback(run))

    def answer(self) -> None:
        """Answer the goals whose runs are over."""
        for handle, run in list(self._open):
            # A cancel request that was accepted counts once its callback is over.
            cancelled = run.outcome is not None and run.outcome.end is End.CANCELED
            if run.outcome is not None and handle.is_cancel_requested == cancelled:
                self._open.remove((handle, run))
                self._over.append((handle, run))
                handle.execute()

    def destroy(self) -> None:
        """Take the action away."""
        self._server.destroy()

    def _take(self, request: Any) -> GoalResponse:
        try:
            self._begun = self._begin(request)
        except CcrError as error:
            self._log.warning(f"goal rejected: {error}")
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    def _keep(self, handle: ServerGoalHandle) -> None:
        run, self._begun = self._begun, None
        if run is not None:
            self._open.append((handle, run))

    def _give_up(self, handle: ServerGoalHandle) -> CancelResponse:
        for known, run in self._open:
            if known.goal_id == handle.goal_id and run.outcome is None:
                self._cancel(run)
                return CancelResponse.ACCEPT
        return CancelResponse.REJECT

    def _answer(self, handle: ServerGoalHandle) -> Any:
        pair = next(pair for pair in self._over if pair[0].goal_id == handle.goal_id)
        self._over.remove(pair)
        run = pair[1]
        outcome = run.outcome
        if outcome is None:
            handle.abort()
        elif outcome.end is End.CANCELED:
            handle.canceled()
        elif outcome.end is End.DONE:
            handle.succeed()
        else:
            handle.abort()
        return self._result(run)
