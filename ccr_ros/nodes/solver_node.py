# SPDX-License-Identifier: Apache-2.0
"""solver_node: cable pulls and objects in, the fingers' poses out.

Topics, frames and parameters: docs/interfaces.md.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import Any

from ccr_msgs.msg import ObjectArray
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.clock import Clock, ClockType
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.timer import Timer
from std_msgs.msg import Header
from tf2_ros import StaticTransformBroadcaster, TransformBroadcaster
from visualization_msgs.msg import MarkerArray

from ccr_ros.model import CcrError
from ccr_ros.viz.markers import FingerView, SceneMarkers

from . import parameters, runner
from .conversions import transform_message
from .diagnostics import FingerDiagnostics, make_status
from .finger_channel import FingerChannel
from .frames import FingerFrames
from .grasp_channel import GraspChannel
from .grasp_diagnostics import grasp_status, grasp_verdict
from .move_service import MoveService
from .pull_service import PullService
from .qos import COMMAND, DIAGNOSTICS, LATCHED
from .scene import ObjectScene

_WARN_EVERY = 2.0  # s
_DIAGNOSTICS_PERIOD = 1.0  # s


class SolverNode(Node):
    """Solves the fingers of one gripper for the newest pulls and objects.

    Subscriptions only store what comes; a guard condition wakes the worker, which solves one
    finger per turn of the executor, which is so never kept for longer than a solve (or a marker
    message) takes. All callbacks run in one mutually exclusive group.

    Args:
        options: Of `rclpy.node.Node` (namespace, parameter_overrides, context, ...).

    Raises:
        CcrError: The gripper file or a setting is not valid.
        rclpy.exceptions.ParameterException: A parameter is of the wrong type or out of range.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("solver_node", **options)
        try:
            self._set_up(parameters.declare(self))
        except BaseException:
            self.destroy_node()
            raise

    def _set_up(self, fixed: parameters.SolverParameters) -> None:
        self._gripper_name = fixed.gripper.name
        self._gripper_frame = fixed.gripper_frame
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)  # as sim time may stand still
        self._wake = self.create_guard_condition(self._work)

        broadcaster = TransformBroadcaster(self)
        self._channels: deque[FingerChannel] = deque()
        for mounted in fixed.gripper.fingers:
            frames = FingerFrames.of(mounted.finger.name, fixed.gripper_frame, fixed.frame_prefix)
            self._channels.append(
                FingerChannel(
                    self, mounted, frames, fixed.settings, broadcaster, self._wake.trigger
                )
            )
        self._fingers = tuple(self._channels)  # in the gripper's order; _channels rotates
        self._static = StaticTransformBroadcaster(self)
        now = self.get_clock().now().to_msg()
        self._static.sendTransform(
            [transform_message(now, c.frames.gripper, c.frames.base, c.base) for c in self._fingers]
        )

        self._objects_message: ObjectArray | None = None  # the newest, not looked at yet
        self._grasp: GraspChannel | None = None
        if fixed.mode == parameters.GRIPPER:
            self._grasp = GraspChannel(self, self._fingers, fixed, broadcaster, self._steady)
        self._objects = ObjectScene(self._fingers, fixed.gripper_frame, self._grasp)
        self.create_subscription(ObjectArray, "objects", self._receive_objects, COMMAND)

        prepare = None if self._grasp is None else self._grasp.prepare
        self._pulls = PullService(self, self._fingers, self._wake.trigger, prepare)
        self._moves = MoveService(
            self, self._grasp, fixed.move_margin, fixed.move_time_limit, self._wake.trigger
        )

        self._markers = self.create_publisher(MarkerArray, "markers", LATCHED)
        self._scene = SceneMarkers()
        self._marker_timer = self._make_marker_timer()
        self.add_post_set_parameters_callback(self._parameters_changed)

        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", DIAGNOSTICS)
        self._health = tuple(FingerDiagnostics(channel) for channel in self._fingers)
        self._levels: tuple[object, ...] = ()
        self.create_timer(_DIAGNOSTICS_PERIOD, self._report, clock=self._steady)

        self._wake.trigger()  # the rest poses
        self.get_logger().info(
            f"gripper {self._gripper_name!r}: {', '.join(fixed.gripper.finger_names)}"
        )

    # The worker

    def _work(self) -> None:
        """Take new objects in, solve one finger, or all at once where they have an object in hand;
        come back for more when others were served.

        Requests for pulls and plans are worked on besides, each for the time of one solve.
        """
        message, self._objects_message = self._objects_message, None
        if message is not None:
            self._take_objects(message)
        self._solve_next()
        if self._grasp is not None:
            self._grasp.tell()
        self._report_change()
        self._pulls.work()
        self._moves.work()
        unsolved = self._objects_message is not None or any(c.unsolved for c in self._fingers)
        if unsolved or self._pulls.busy or self._moves.busy:
            self._wake.trigger()

    def _solve_next(self) -> None:
        if self._grasp is not None and self._grasp.active:
            if self._grasp.turn():
                self._scene_changed()
            return
        for _ in self._fingers:
            channel = self._channels[0]
            if channel.unsolved and not channel.settled():
                return  # it keeps its place: its newest pulls come in with the next turns
            self._channels.rotate(-1)  # fair: who was first is last next time
            if channel.unsolved:
                if channel.solve():
                    self._scene_changed()
                return

    # Objects

    def _receive_objects(self, message: ObjectArray) -> None:
        self._objects_message = message
        self._wake.trigger()

    def _take_objects(self, message: ObjectArray) -> None:
        try:
            changed = self._objects.take(message)
        except CcrError as error:
            self.get_logger().warning(
                f"objects refused: {error} (the last good objects stay)",
                throttle_duration_sec=_WARN_EVERY,
            )
            return
        if changed:
            stamp = message.header.stamp
            if not (stamp.sec or stamp.nanosec):
                stamp = self.get_clock().now().to_msg()
            for channel in self._fingers:
                channel.solve_again(stamp)
            self._scene_changed()

    # Markers

    def _make_marker_timer(self) -> Timer:
        rate = self.get_parameter(parameters.MARKER_RATE).value
        timer = self.create_timer(1.0 / rate, self._publish_markers, clock=self._steady)
        timer.cancel()  # runs only while there is something new to show
        return timer

    def _scene_changed(self) -> None:
        if self._marker_timer.is_canceled() and self.get_parameter(parameters.MARKERS).value:
            self._marker_timer.reset()

    def _publish_markers(self) -> None:
        self._marker_timer.cancel()
        grasp = self._grasp
        views = [
            FingerView(c.solution, c.frames.base, c.stale)
            for c in self._fingers
            if c.solution is not None
        ]
        objects = self._objects.objects
        bodies = [item.solid for item in objects] if grasp is None else grasp.seen(objects)
        contacts = () if grasp is None else grasp.contacts
        self._markers.publish(self._scene.message(views, bodies, self._gripper_frame, contacts))

    def _parameters_changed(self, changed: Sequence[Parameter]) -> None:
        names = {parameter.name for parameter in changed}
        if parameters.MARKER_RATE in names:
            self.destroy_timer(self._marker_timer)
            self._marker_timer = self._make_marker_timer()
        if parameters.MARKERS in names and not self.get_parameter(parameters.MARKERS).value:
            self._marker_timer.cancel()
            self._markers.publish(self._scene.clear())
        elif names & {parameters.MARKERS, parameters.MARKER_RATE}:
            self._scene_changed()

    # Diagnostics

    def _report_change(self) -> None:
        levels = (*(health.verdict()[0] for health in self._health), bool(self._objects.fault))
        if self._grasp is not None:
            levels = (*levels, grasp_verdict(self._grasp))
        if levels != self._levels:
            self._levels = levels
            self._publish_diagnostics()
            self._scene_changed()  # a finger may have become stale

    def _report(self) -> None:
        self._publish_diagnostics()
        for health in self._health:
            health.begin_period()

    def _publish_diagnostics(self) -> None:
        name = self.get_fully_qualified_name()
        statuses = [health.status(name, self._gripper_name) for health in self._health]
        fault = self._objects.fault
        statuses.append(
            make_status(
                f"{name}: objects",
                self._gripper_name,
                DiagnosticStatus.ERROR if fault else DiagnosticStatus.OK,
                fault or "ok",
                {"objects": len(self._objects.objects)},
            )
        )
        if self._grasp is not None:
            statuses.append(grasp_status(self._grasp, name, self._gripper_name))
        header = Header(stamp=self.get_clock().now().to_msg())
        self._diagnostics.publish(DiagnosticArray(header=header, status=statuses))


def spin(context: Context | None = None) -> None:
    """Run the node in a context until this ends; see `runner.spin`."""
    runner.spin(SolverNode, context)
