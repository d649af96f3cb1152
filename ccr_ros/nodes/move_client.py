# SPDX-License-Identifier: Apache-2.0
"""Fetches the plans that the coordinator wants from the solver node."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from ccr_msgs.srv import PlanMove
from rclpy.node import Node

from ccr_ros.grasp.coordinator import GripperCoordinator
from ccr_ros.grasp.moves import MoveRun
from ccr_ros.model import CcrError, InvalidValue

from .move_conversions import BUSY, path_from_response, plan_request

_AGAIN = 0.3  # s; how soon a solver that plans something else is asked again


class MoveClient:
    """Asks for one plan at a time, without waiting: `step` looks whether it has come.

    A solver that is killed while it plans answers no more, and one that is started at once in its
    place never seems to be away: so nothing waits for the answer to what is wanted no more.

    Args:
        node: To call the service ``solver_node/plan_move`` from.
        gripper: Whose motions are planned.
    """

    def __init__(self, node: Node, gripper: GripperCoordinator) -> None:
        self._gripper = gripper
        self._client = node.create_client(PlanMove, "solver_node/plan_move")
        self._asked: tuple[MoveRun, Any] | None = None
        self._not_before = 0.0

    def step(self) -> None:
        """Take the answer that has come, and ask for the plan that is wanted now."""
        if self._asked is not None:
            run, future = self._asked
            if future.done():
                self._take(run, future.result())
            elif self._gripper.plan_wanted is run and self._client.service_is_ready():
                return
            else:  # wanted no more, or nobody is left to answer
                self._client.remove_pending_request(future)
            self._asked = None
        wanted = self._gripper.plan_wanted
        if wanted is None or time.monotonic() < self._not_before:
            return
        if self._client.service_is_ready():
            request = plan_request(wanted.goal, self._ranges, self._cables)
            self._asked = wanted, self._client.call_async(request)

    def _take(self, run: MoveRun, response: PlanMove.Response) -> None:
        if response.message == BUSY:  # with what is wanted no more, as a rule
            self._not_before = time.monotonic() + _AGAIN
            return
        try:
            self._gripper.take_plan(run, path_from_response(response, self._cables))
        except CcrError as error:
            text = error.value if isinstance(error, InvalidValue) else error
            self._gripper.take_plan(run, CcrError(str(text)))

    @property
    def _cables(self) -> dict[str, tuple[str, ...]]:
        return {name: finger.cables for name, finger in self._gripper.fingers.items()}

    @property
    def _ranges(self) -> Mapping[str, Any]:
        return {name: finger.pull_range for name, finger in self._gripper.fingers.items()}
