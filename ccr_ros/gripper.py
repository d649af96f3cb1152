# SPDX-License-Identifier: Apache-2.0
"""A gripper in a person's words: grasp, hold, move, rotate, release, stop.

    from ccr_ros.gripper import Gripper

    with Gripper() as gripper:
        gripper.grasp(force=0.2)
        gripper.release(after=5.0)

Calls wait until what they ask for is done, or raise an error that says why it is not. They talk to
the coordinator node of a namespace, under ROS 2 as without it. Leaving the ``with`` block lets go
of nothing.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import Any

from ccr_ros.gripper_reports import (
    GraspReport,
    GripperReport,
    MoveReport,
    grasp_report,
    gripper_report,
    move_report,
)
from ccr_ros.model import checks
from ccr_ros.model.errors import CcrError
from ccr_ros.runtime import enable_ros

_POLL = 0.02  # s
_REASON_WAIT = 2.0  # s that the reason of a refusal may come after it
_MARGIN = 10.0  # s beyond the gripper's own timeouts before it counts as silent


class GripperError(CcrError):
    """The gripper did not do what was asked; the text says why."""


class NoGripper(GripperError):
    """No coordinator answers."""


class GripperRefused(GripperError):
    """The gripper does not do this now; nothing has changed."""


class GripperFailed(GripperError):
    """What was begun did not come to its end.

    Attributes:
        report: What became of it.
    """

    def __init__(self, report: GripperReport | MoveReport) -> None:
        self.report = report
        super().__init__(report.message)


class Gripper:
    """One gripper, through the coordinator in its namespace.

    Args:
        namespace: Of the gripper's nodes.
        timeout: Longest that the coordinator may take to appear or to answer [s].

    Raises:
        RuntimeMissing: There is neither ROS 2 nor its embedded replacement.
        NoGripper: No coordinator was found within the timeout.
    """

    def __init__(self, namespace: str = "/gripper", timeout: float = 10.0) -> None:
        enable_ros()
        import rclpy
        from ccr_msgs.action import Grasp, MoveObject, Release, Rotate
        from ccr_msgs.msg import GraspState, GripperState
        from geometry_msgs.msg import Vector3
        from rclpy.action import ActionClient
        from rclpy.context import Context
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.node import Node
        from rclpy.qos import DurabilityPolicy, QoSProfile
        from std_srvs.srv import Trigger

        self.namespace = namespace
        self._timeout = timeout
        self._closed = False
        self._latest: Any = None
        self._grasp: Any = None
        self._heard_at = 0.0
        self._trigger = Trigger.Request
        self._context = Context()
        rclpy.init(args=[], context=self._context)
        self._node = Node("gripper_facade", namespace=namespace, context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._actions = {
            kind: ActionClient(self._node, kind, name)
            for kind, name in (
                (Grasp, "grasp"),
                (Release, "release"),
                (MoveObject, "move_object"),
                (Rotate, "rotate"),
            )
        }
        self._grasp_type, self._release_type = Grasp, Release
        self._move_type, self._rotate_type, self._vector = MoveObject, Rotate, Vector3
        self._services = {
            name: self._node.create_client(Trigger, name) for name in ("stop", "hold", "reset")
        }
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._node.create_subscription(GripperState, "gripper_state", self._hear, latched)
        self._node.create_subscription(GraspState, "grasp_state", self._hear_grasp, latched)
        self._thread = threading.Thread(target=self._spin, name="gripper", daemon=True)
        self._thread.start()
        try:
            self._find()
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Gripper:
        """Return the gripper itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close the connection; what is held stays held."""
        self.close()

    # What a person does

    def grasp(
        self,
        object: str = "",
        *,
        force: float = 0.0,
        width: float = 0.0,
        speed: float = 0.0,
        required_fingers: Sequence[str] = (),
        timeout: float = 30.0,
    ) -> GripperReport:
        """Close on an object and hold it; return when all required fingers press.

        Args:
            object: Its name; empty: whatever is touched.
            force: Of each finger [N]; 0: the coordinator's default.
            width: Expected gap between the fingertips [m]; 0: not known.
            speed: Of the pulls [m/s]; 0: the coordinator's default.
            required_fingers: Which must touch; empty: all.
            timeout: Of the grasp [s].

        Raises:
            GripperRefused: Not now, or not these values.
            GripperFailed: It was not grasped; the report says what is.
            NoGripper: The coordinator went silent.
        """
        goal = self._grasp_type.Goal(
            object=object,
            force=float(force),
            width=float(width),
            speed=float(speed),
            timeout=float(timeout),
            required_fingers=list(required_fingers),
        )
        result = self._achieve(self._grasp_type, goal, timeout + _MARGIN)
        return self._judge(result, result.reached)

    def move(
        self,
        shift: Sequence[float] = (0.0, 0.0, 0.0),
        turn: Sequence[float] = (0.0, 0.0, 0.0),
        *,
        margin: float = 0.0,
        duration: float = 0.0,
        speed: float = 0.0,
        partial: bool = False,
        timeout: float = 300.0,
    ) -> MoveReport:
        """Shift and turn what is held, without letting a contact slip; return when it is there.

        Args:
            shift: (3,) [m] of its centre, in the gripper's frame.
            turn: (3,) rotation vector [rad] about its centre, in the gripper's frame.
            margin: Least friction margin of every contact, below 1; 0: the solver's default.
            duration: Of the motion [s]; 0: as the speed says. Not both.
            speed: Of the cable that moves most [m/s]; 0: the coordinator's default.
            partial: Where the target cannot be reached, go as far as is possible, and return that.
            timeout: Of planning and motion [s]; then it is cancelled.

        Raises:
            InvalidValue: A shift or turn that is not three numbers.
            GripperRefused: Nothing is held, or not these values.
            GripperFailed: It is not there; the report names the constraint that keeps it from
                there, and where it is. It is still held.
            NoGripper: The coordinator went silent. As with any error while it waits, and with an
                interrupt, the motion is cancelled.
        """
        goal = self._move_type.Goal(
            shift=self._vector_of("shift", shift),
            turn=self._vector_of("turn", turn),
            margin=float(margin),
            duration=float(duration),
            speed=float(speed),
            partial=bool(partial),
        )
        return self._moved(self._achieve(self._move_type, goal, timeout), partial)

    def rotate(
        self,
        angle: float,
        *,
        margin: float = 0.0,
        duration: float = 0.0,
        speed: float = 0.0,
        partial: bool = False,
        timeout: float = 300.0,
    ) -> MoveReport:
        """Turn what is held about the gripper's z axis by an angle [rad]; else as `move`."""
        goal = self._rotate_type.Goal(
            angle=float(angle),
            margin=float(margin),
            duration=float(duration),
            speed=float(speed),
            partial=bool(partial),
        )
        return self._moved(self._achieve(self._rotate_type, goal, timeout), partial)

    def hold(self) -> GripperReport:
        """Hold what is gripped as it is; a release that waits is off.

        Raises:
            GripperRefused: Nothing is gripped, or there is a fault.
        """
        return self._call("hold")

    def release(
        self, *, after: float = 0.0, fast: bool = False, timeout: float = 30.0
    ) -> GripperReport:
        """Let go, now or after a time; return when the fingers are open.

        Args:
            after: Until the fingers begin to open [s].
            fast: At the fast speed.
            timeout: Of the opening [s].

        Raises:
            GripperRefused, GripperFailed, NoGripper: As for `grasp`. An interrupt, or any other
                error while it waits, calls the release off.
        """
        goal = self._release_type.Goal(delay=float(after), fast=fast)
        result = self._achieve(self._release_type, goal, after + timeout + _MARGIN)
        return self._judge(result, result.released)

    def stop(self) -> GripperReport:
        """Freeze the fingers; what they grip they keep, and a release that waits is off."""
        return self._call("stop")

    def reset(self) -> GripperReport:
        """Leave a fault; nothing moves.

        Raises:
            GripperRefused: What failed is still so.
        """
        return self._call("reset")

    @property
    def state(self) -> GripperReport:
        """What the gripper says of itself, the newest heard."""
        return gripper_report(self._latest, True)

    @property
    def in_hand(self) -> GraspReport | None:
        """What the solver says of the object in hand, the newest heard; None: it says nothing.

        The solver node says it in its mode gripper, while there is an object.
        """
        return None if self._grasp is None else grasp_report(self._grasp)

    def close(self) -> None:
        """Close the connection; what is held stays held. May be called again."""
        if self._closed:
            return
        self._closed = True
        self._context.try_shutdown()
        self._thread.join()
        self._executor.shutdown()
        self._node.destroy_node()

    # How

    def _spin(self) -> None:
        from rclpy.executors import ExternalShutdownException

        try:
            self._executor.spin()
        except ExternalShutdownException:
            return
        except Exception:
            if self._context.ok():
                raise

    def _hear(self, message: Any) -> None:
        self._latest, self._heard_at = message, time.monotonic()

    def _hear_grasp(self, message: Any) -> None:
        self._grasp = message

    def _find(self) -> None:
        ends = [client.server_is_ready for client in self._actions.values()]
        ends += [client.service_is_ready for client in self._services.values()]
        self._wait(lambda: self._latest is not None and all(end() for end in ends), self._timeout)

    def _wait(self, condition: Callable[[], Any], timeout: float) -> None:
        deadline = time.monotonic() + timeout
        while not condition():
            self._check_open()
            if time.monotonic() > deadline:
                raise NoGripper(
                    f"no gripper coordinator answers in {self.namespace!r} within {timeout:g} s; "
                    "is gripper_coordinator_node running there, in the same ROS_DOMAIN_ID?"
                )
            time.sleep(_POLL)

    def _check_open(self) -> None:
        if self._closed or not self._context.ok():
            raise NoGripper("the connection to the gripper is closed")

    def _achieve(self, kind: Any, goal: Any, timeout: float) -> Any:
        self._check_open()
        sent = self._actions[kind].send_goal_async(goal)
        self._wait(sent.done, self._timeout)
        handle = sent.result()
        if not handle.accepted:
            raise GripperRefused(self._reason())
        future = handle.get_result_async()
        try:
            self._wait(future.done, timeout)
        except BaseException:
            if self._context.ok():
                handle.cancel_goal_async()
            raise
        return future.result().result

    def _call(self, name: str) -> GripperReport:
        self._check_open()
        future = self._services[name].call_async(self._trigger())
        self._wait(future.done, self._timeout)
        answer = future.result()
        if not answer.success:
            raise GripperRefused(answer.message)
        self._newer()
        return self.state

    def _newer(self) -> None:
        """Wait for a state that is newer than now."""
        since = time.monotonic()
        self._wait(lambda: self._heard_at > since, _REASON_WAIT)

    def _reason(self) -> str:
        self._newer()
        return self._latest.refusal or "the gripper refuses, and does not say why"

    def _vector_of(self, place: str, values: Sequence[float]) -> Any:
        x, y, z = checks.vector(place, values, 3)
        return self._vector(x=float(x), y=float(y), z=float(z))

    def _moved(self, result: Any, partial: bool) -> MoveReport:
        report = move_report(result)
        as_far = partial and report.limiting and report.fraction == 1.0
        if not (report.done or as_far):
            raise GripperFailed(report)
        return report

    def _judge(self, result: Any, done: bool) -> GripperReport:
        report = gripper_report(result, done)
        if not done:
            raise GripperFailed(report)
        return report
