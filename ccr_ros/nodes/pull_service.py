# SPDX-License-Identifier: Apache-2.0
"""The solver node's service ~/solve_pulls: which pulls would bring a finger to a target."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Generator, Sequence

import numpy as np
from ccr_msgs.srv import SolvePulls
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.task import Future

from ccr_ros.design.pulls import PullPlanner, PullSolution
from ccr_ros.design.pulls_limits import PullLimits
from ccr_ros.design.pulls_targets import PointsTarget, PressTarget, Target, TipTarget
from ccr_ros.model import CcrError, InvalidValue, Pose, UnknownName

from .conversions import certificate_message, contact_message, pose_message
from .finger_channel import FingerChannel
from .turns import take_turn

_KINDS = "TIP_POSITION (0), TIP_POSE (1), POINTS (2) or PRESS (3)"


class PullService:
    """Answers one request after the other, a solve per call of `work`, and so per turn of the node.

    Each finger has a planner with a solver of its own, which starts from the pose of the live one:
    that goes on with its stream of pulls meanwhile.

    Args:
        node: The node to make the service on.
        fingers: Its fingers.
        wake: Called when there is something to `work` on.
        prepare: Called with a finger before a request about it; may refuse with a CcrError.
    """

    def __init__(
        self,
        node: Node,
        fingers: Sequence[FingerChannel],
        wake: Callable[[], None],
        prepare: Callable[[FingerChannel], None] | None = None,
    ) -> None:
        self._fingers = {channel.finger.name: channel for channel in fingers}
        self._planners: dict[str, PullPlanner] = {}
        self._log = node.get_logger().get_child("solve_pulls")
        self._wake = wake
        self._prepare = prepare
        self._waiting: deque[tuple[SolvePulls.Request, Future]] = deque()
        self._steps: Generator[None, None, PullSolution] | None = None  # of the first one waiting
        # A group of its own: while an answer is waited for the node's other callbacks go on.
        node.create_service(
            SolvePulls, "~/solve_pulls", self._serve, callback_group=ReentrantCallbackGroup()
        )

    @property
    def busy(self) -> bool:
        """Whether there is something to work on."""
        return bool(self._waiting)

    def work(self) -> None:
        """Do one solve for the first request that waits; answer it when it is done."""
        if not self._waiting:
            return
        request, answer = self._waiting[0]
        if take_turn(lambda: self._turn(request), answer, self._log):
            self._waiting.popleft()
            self._steps = None

    def _turn(self, request: SolvePulls.Request) -> None:
        if self._steps is None:
            self._steps = self._begun(request)
        next(self._steps)

    async def _serve(
        self, request: SolvePulls.Request, response: SolvePulls.Response
    ) -> SolvePulls.Response:
        answer: Future = Future()
        self._waiting.append((request, answer))
        self._wake()
        result = await answer
        if isinstance(result, PullSolution):
            return _answered(response, result)
        response.message = f"refused: {result}" if isinstance(result, CcrError) else repr(result)
        for name in ("position_error", "rotation_error", "force_error", "gap"):
            setattr(response, name, math.nan)
        return response

    def _begun(self, request: SolvePulls.Request) -> Generator[None, None, PullSolution]:
        if request.finger not in self._fingers:
            raise UnknownName("finger", request.finger, self._fingers)
        channel = self._fingers[request.finger]
        target = _target(request, channel)
        limits = _limits(request, channel)
        if self._prepare is not None:
            self._prepare(channel)
        planner = self._planners.get(request.finger)
        if planner is None:
            planner = self._planners[request.finger] = PullPlanner(channel.solver)
        planner.solver.resume(channel.solver.standing)
        planner.limits = limits
        return planner.steps(target)


def _target(request: SolvePulls.Request, channel: FingerChannel) -> Target:
    kind = request.target
    if kind == SolvePulls.Request.PRESS:
        return PressTarget(int(request.disk), request.obstacle, float(request.force))
    frames = channel.frames
    if request.frame_id not in ("", frames.base, frames.gripper):
        raise UnknownName("frame", request.frame_id, [frames.base, frames.gripper])
    place = Pose() if request.frame_id in ("", frames.base) else channel.base.inverse()
    if kind in (SolvePulls.Request.TIP_POSITION, SolvePulls.Request.TIP_POSE):
        p, q = request.tip.position, request.tip.orientation
        # An orientation that is not asked for need not be one.
        turn = [q.x, q.y, q.z, q.w] if kind == SolvePulls.Request.TIP_POSE else [0.0, 0.0, 0.0, 1.0]
        try:
            tip = place @ Pose(np.array([p.x, p.y, p.z]), np.array(turn))
        except InvalidValue as error:
            raise error.located("tip") from None
        if kind == SolvePulls.Request.TIP_POSITION:
            return TipTarget(tip.position)
        weight = float(request.rotation_weight)
        return TipTarget(tip.position, tip.orientation, rotation_weight=weight if weight else None)
    if kind == SolvePulls.Request.POINTS:
        disks, points = list(request.disks), list(request.points)
        if len(disks) != len(points) or len(set(disks)) != len(disks):
            allowed = f"different disks, one per point ({len(points)} given)"
            raise InvalidValue("disks", disks, allowed)
        wanted = {}
        for disk, p in zip(disks, points, strict=True):
            wanted[int(disk)] = place.points(np.array([p.x, p.y, p.z]))
        return PointsTarget(wanted)
    raise InvalidValue("target", int(kind), _KINDS)


def _limits(request: SolvePulls.Request, channel: FingerChannel) -> PullLimits:
    return PullLimits.of(
        channel.finger,
        tension=list(request.largest_tensions) or None,
        low=list(request.least_pulls) or None,
        high=list(request.largest_pulls) or None,
    )


def _answered(response: SolvePulls.Response, found: PullSolution) -> SolvePulls.Response:
    solution, error = found.solution, found.error
    response.success, response.nearest = bool(found.reached), bool(found.optimal)
    response.message = found.message
    response.cables = list(solution.finger.cable_names)
    response.pulls = found.pulls.tolist()
    response.tensions = solution.tensions.tolist()
    response.forces_are = solution.finger.forces_are
    for name, value in (
        ("position_error", error.position),
        ("rotation_error", error.rotation),
        ("force_error", error.force),
        ("gap", error.gap),
    ):
        setattr(response, name, math.nan if value is None else float(value))
    response.limits = list(found.limits)
    tip = solution.tip
    response.tip = pose_message(tip.position, tip.orientation)
    response.contacts = [contact_message(contact) for contact in solution.contacts]
    response.certificate = certificate_message(solution.certificate)
    return response
