# SPDX-License-Identifier: Apache-2.0
"""Fetches the plans that the coordinator wants from the solver node."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ccr_msgs.srv import PlanMove
from rclpy.node import Node

from ccr_ros.grasp.coordinator import GripperCoordinator
from ccr_ros.grasp.moves import MoveRun
from ccr_ros.model import CcrError, InvalidValue

from .move_conversions import path_from_response, plan_request


class MoveClient:
    """Asks for one plan at a time, without waiting: `step` looks whether it has come.

    Args:
        node: To call the service ``solver_node/plan_move`` from.
        gripper: Whose motions are planned.
    """

    def __init__(self, node: Node, gripper: GripperCoordinator) -> None:
        self._gripper = gripper
        self._client = node.create_client(PlanMove, "solver_node/plan_move")
        self._asked: tuple[MoveRun, Any] | None = None

    def step(self) -> None:
        """Take the answer that has come, and ask for the plan that is wanted now."""
        if self._asked is not None:
            run, future = self._asked
            if not future.done():
                if self._gripper.plan_wanted is not run and not self._client.service_is_ready():
                    self._give_up(future)  # nobody is left to answer what is wanted no more
                return
            self._asked = None
            self._take(run, future)
        wanted = self._gripper.plan_wanted
        if wanted is not None and self._client.service_is_ready():
            request = plan_request(wanted.goal, self._ranges, self._cables)
            self._asked = wanted, self._client.call_async(request)

    def _give_up(self, future: Any) -> None:
        self._client.remove_pending_request(future)
        self._asked = None

    def _take(self, run: MoveRun, future: Any) -> None:
        try:
            self._gripper.take_plan(run, path_from_response(future.result(), self._cables))
        except CcrError as error:
            text = error.value if isinstance(error, InvalidValue) else error
            self._gripper.take_plan(run, CcrError(str(text)))

    @property
    def _cables(self) -> dict[str, tuple[str, ...]]:
        return {name: finger.cables for name, finger in self._gripper.fingers.items()}

    @property
    def _ranges(self) -> Mapping[str, Any]:
        return {name: finger.pull_range for name, finger in self._gripper.fingers.items()}
