# SPDX-License-Identifier: Apache-2.0
"""One finger in the solver node: its topics, its warm solver, its last good pose."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from builtin_interfaces.msg import Time as TimeMessage
from ccr_msgs.msg import CablePulls, FingerState
from geometry_msgs.msg import PoseArray
from rclpy.node import Node
from std_msgs.msg import Header
from tf2_ros import TransformBroadcaster

from ccr_ros.model import CcrError, FingerSolver, MountedFinger, Obstacle, Solution, SolverSettings

from .backlog import Backlog
from .conversions import pose_array, pulls_from_message, state_message, transform_message
from .frames import FingerFrames
from .qos import COMMAND_QUEUE, LATCHED

_TIMES_KEPT = 1000  # solve times, for the percentiles
_WARN_EVERY = 2.0  # s
_SAME = 1e-7  # m; pulls as near to each other as that have the same pose


@dataclass(frozen=True)
class Task:
    """Pulls to be solved [m], the time they are of, and when they came [s, monotonic]."""

    pulls: np.ndarray
    stamp: TimeMessage
    arrived: float = field(default_factory=time.monotonic)


class FingerChannel:
    """Keeps the newest pulls of one finger, solves them when told to, publishes the pose.

    `solve` does so for the finger alone; who solves it with others calls `begin`, then `show` or
    `fail`.

    Receiving only stores, so that many messages cost one solve. Bad pulls are refused when they
    come and change nothing else.

    Args:
        node: The node to make the topics on.
        mounted: The finger and its place in the gripper.
        frames: Its frames.
        settings: Of the solver.
        broadcaster: For the tip's transform.
        wake: Called when there is something to solve.
    """

    def __init__(
        self,
        node: Node,
        mounted: MountedFinger,
        frames: FingerFrames,
        settings: SolverSettings,
        broadcaster: TransformBroadcaster,
        wake: Callable[[], None],
    ) -> None:
        self.finger = mounted.finger
        self.base = mounted.base
        self.frames = frames
        self.solver = FingerSolver(mounted.finger, settings)
        self.solution: Solution | None = None  # the last good one
        self.fault = ""  # why the newest pulls are not what the pose shows
        self.received = self.refused = self.dropped = self.solves = self.failures = 0
        self.solve_times: deque[float] = deque(maxlen=_TIMES_KEPT)

        self._node = node
        self._log = node.get_logger().get_child(self.finger.name)
        self._broadcaster = broadcaster
        self._wake = wake
        now = node.get_clock().now().to_msg()
        # Shown at once: the finger at rest.
        self._wanted = Task(np.zeros(len(self.finger.cables)), now)
        self._pose_stamp = now
        self.accepted = self._wanted  # the last that the solver took
        self._refusal = ""  # why the newest message was refused
        self._unsolved = True  # whether there is something to solve, or to show again
        self._anew = True  # whether to solve even the pulls that are shown
        self._waiting = False  # whether _wanted came as a message and is not solved yet
        self._dropped_told = 0
        self._backlog = Backlog()

        name = self.finger.name
        self._backbone = node.create_publisher(PoseArray, f"{name}/backbone", LATCHED)
        self._cables = {
            cable: node.create_publisher(PoseArray, f"{name}/cables/{cable}", LATCHED)
            for cable in self.finger.cable_names
        }
        self._state = node.create_publisher(FingerState, f"{name}/state", LATCHED)
        node.create_subscription(CablePulls, f"{name}/cable_pulls", self._receive, COMMAND_QUEUE)

    @property
    def stale(self) -> bool:
        """Whether the pose is not that of the newest pulls, because they were refused or failed."""
        return bool(self.fault)

    @property
    def unsolved(self) -> bool:
        """Whether there is something to solve, or to show again."""
        return self._unsolved

    @property
    def shown(self) -> bool:
        """Whether the pose is that of the wanted pulls already, and nothing else is due."""
        if self._anew or self.fault or self.solution is None:
            return False
        return _same(self._wanted.pulls, self.solution.pulls)

    def set_obstacles(self, obstacles: Sequence[Obstacle]) -> None:
        """Replace all obstacles, given in the finger's base frame; nothing is solved yet.

        Raises:
            InvalidValue: One overlaps the base disk; nothing has changed.
        """
        self.solver.obstacles = tuple(obstacles)

    def solve_again(self, stamp: TimeMessage) -> None:
        """Ask for a new solve of the wanted pulls, because the obstacles are new at this time."""
        if not self._waiting or self.shown:
            self._wanted = Task(self._wanted.pulls, stamp)
        self._unsolved = self._anew = True

    def settled(self) -> bool:
        """Tell whether no newer pulls have come in since the last look, which this one becomes."""
        return self._backlog.settled(self.received)

    def solve(self) -> bool:
        """Solve the wanted pulls and publish: the new pose, or the last good one as stale.

        Pulls that are shown already, as those of a gripper that holds, are not solved but shown
        again, with their own stamp; return whether it was a solve.
        """
        if self.shown:
            self.show_again()
            return False
        task = self.begin()
        solution = self.solver.solve(task.pulls)
        self.solve_times.append(solution.certificate.solve_time)
        if solution.certificate.converged:
            self.show(task, solution)
        else:
            self.fail(task, solution.certificate.message)
        return True

    def show_again(self) -> None:
        """Publish the pose for the wanted pulls, which are its own; see `shown`."""
        assert self.solution is not None
        self._unsolved = self._waiting = False
        self.accepted, self._pose_stamp = self._wanted, self._wanted.stamp
        self._publish_pose(self.solution)
        self._publish_state()

    def begin(self) -> Task:
        """Take the wanted pulls to solve them; `show` or `fail` comes next."""
        self._unsolved = self._anew = self._waiting = False
        self._warn_of_backlog()
        self.solves += 1
        return self._wanted

    def show(self, task: Task, solution: Solution) -> None:
        """Publish the pose that pulls lead to."""
        self.accepted = task
        self.fault = self._refusal
        self.solution = solution
        self._pose_stamp = task.stamp
        self._publish_pose(solution)
        self._publish_state()

    def fail(self, task: Task, reason: str) -> None:
        """Publish the last good pose as stale, as none was found for pulls."""
        self.accepted = task
        self.failures += 1
        failure = f"not converged: {reason}"
        self.fault = self._refusal or failure
        self._log.warning(
            f"{failure} (the last good pose stays)", throttle_duration_sec=_WARN_EVERY
        )
        self._publish_state()

    def _receive(self, message: CablePulls) -> None:
        self.received += 1
        try:
            pulls = self.solver.checked_pulls(pulls_from_message(message, self.finger))
        except CcrError as error:
            self._refuse(error)
            return
        stamp = self._stamp(message.header.stamp)
        if self._waiting:
            self.dropped += not _same(pulls, self._wanted.pulls)
        elif not self._backlog.growing:
            self._backlog.mark_seen(self.received)  # a single message: solved at the first look
        self._refusal = ""
        self._wanted = Task(pulls, stamp)
        self._unsolved = self._waiting = True
        self._wake()

    def _refuse(self, error: CcrError) -> None:
        self.refused += 1
        self.fault = self._refusal = f"pulls refused: {error}"
        self._log.warning(
            f"{self.fault} (the last good pose stays)", throttle_duration_sec=_WARN_EVERY
        )
        self._publish_state()
        self._wake()  # that the diagnostics tell it at once

    def _warn_of_backlog(self) -> None:
        if self.dropped > self._dropped_told:
            self._dropped_told = self.dropped
            self._log.warning(
                f"pulls come faster than they can be solved; {self.dropped} were dropped so far",
                throttle_duration_sec=_WARN_EVERY,
            )

    def _stamp(self, given: TimeMessage) -> TimeMessage:
        # Zero is what an unstamped message has; tf would take it for the beginning of time.
        return given if given.sec or given.nanosec else self._node.get_clock().now().to_msg()

    def _publish_pose(self, solution: Solution) -> None:
        header = Header(stamp=self._pose_stamp, frame_id=self.frames.base)
        quaternions = solution.quaternions
        self._backbone.publish(pose_array(header, solution.backbone, quaternions))
        for cable, publisher in self._cables.items():
            publisher.publish(pose_array(header, solution.cables[cable], quaternions))
        self._broadcaster.sendTransform(
            transform_message(header.stamp, self.frames.base, self.frames.tip, solution.tip)
        )

    def _publish_state(self) -> None:
        if self.solution is not None:
            header = Header(stamp=self._pose_stamp, frame_id=self.frames.base)
            self._state.publish(state_message(header, self.solution, self.stale, self.dropped))


def _same(one: np.ndarray, other: np.ndarray) -> bool:
    return bool(np.all(np.abs(one - other) <= _SAME))
