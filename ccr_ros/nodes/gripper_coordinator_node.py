# SPDX-License-Identifier: Apache-2.0
"""gripper_coordinator_node: grasps, holds, moves what it holds, and lets go.

Topics, actions, services and parameters: docs/interfaces.md; what it does: docs/grasping.md.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from ccr_msgs.msg import CablePulls, FingerGrip, FingerState, GraspState, GripperState, ServoState
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.clock import Clock, ClockType
from rclpy.context import Context
from rclpy.node import Node
from std_msgs.msg import Header
from std_srvs.srv import Trigger

from ccr_ros.grasp.coordinator import GripperCoordinator
from ccr_ros.grasp.finger_control import FingerControl
from ccr_ros.grasp.machine import State
from ccr_ros.model import CcrError, Finger

from . import gripper_conversions as convert
from . import gripper_parameters, runner
from .conversions import pulls_from_message
from .diagnostics import make_status
from .gripper_actions import GripperActions
from .move_client import MoveClient
from .move_conversions import held_object
from .qos import COMMAND, DIAGNOSTICS, LATCHED

_WARN_EVERY = 2.0  # s
_DIAGNOSTICS_PERIOD = 1.0  # s
_LAST_COMMANDS = 0.2  # s; the command that freezes the fingers is repeated for so long
_LEVELS = {State.FAULT: DiagnosticStatus.ERROR, State.STOPPED: DiagnosticStatus.WARN}


class GripperCoordinatorNode(Node):
    """Moves the fingers of one gripper by commands of their pulls, as goals and calls ask for.

    All that is heard is kept; a timer makes the steps. All callbacks run in one mutually
    exclusive group.

    Args:
        options: Of `rclpy.node.Node` (namespace, parameter_overrides, context, ...).

    Raises:
        CcrError: The gripper file or a setting is not valid, or a finger cannot be grasped with.
        rclpy.exceptions.ParameterException: A parameter is of the wrong type or out of range.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("gripper_coordinator_node", **options)
        try:
            self._set_up(gripper_parameters.declare(self))
        except BaseException:
            self.destroy_node()
            raise

    def _set_up(self, fixed: gripper_parameters.GripperParameters) -> None:
        self._gripper_name = fixed.gripper.name
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)  # as sim time may stand still
        self._gripper = GripperCoordinator(fixed.controls(), fixed.settings)
        self._contacts: dict[str, list[Any]] = {name: [] for name in self._gripper.fingers}
        self._commands = {}
        for mounted in fixed.gripper.fingers:
            name, control = mounted.finger.name, self._gripper.fingers[mounted.finger.name]
            self._commands[name] = self.create_publisher(
                CablePulls, f"{name}/cable_pull_commands", COMMAND
            )
            pulls = partial(self._hear_pulls, control, mounted.finger)
            self.create_subscription(CablePulls, f"{name}/cable_pulls", pulls, COMMAND)
            solved = partial(self._hear_state, control)
            self.create_subscription(FingerState, f"{name}/state", solved, LATCHED)
        self.create_subscription(ServoState, "servo_state", self._hear_servos, LATCHED)
        self.create_subscription(GraspState, "grasp_state", self._hear_grasp, LATCHED)

        self._state = self.create_publisher(GripperState, "gripper_state", LATCHED)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", DIAGNOSTICS)
        self._told: tuple[Any, ...] = ()  # what the newest GripperState said
        self._commanded_until = -1.0

        self._actions = GripperActions(self, self._gripper, self._now, self._fingers)
        self._plans = MoveClient(self, self._gripper)
        for name, call in (
            ("stop", lambda: self._gripper.stop()),
            ("hold", lambda: self._gripper.hold(self._now())),
            ("reset", lambda: self._gripper.reset(self._now())),
        ):
            self.create_service(Trigger, name, partial(self._serve, name, call))

        self.create_timer(1.0 / fixed.control_rate, self._step, clock=self._steady)
        self.create_timer(1.0 / fixed.state_rate, self._tell, clock=self._steady)
        self.create_timer(_DIAGNOSTICS_PERIOD, self._publish_diagnostics, clock=self._steady)
        self.get_logger().info(
            f"gripper {self._gripper_name!r}: {', '.join(self._gripper.fingers)}"
        )

    def _now(self) -> float:
        return self._steady.now().nanoseconds * 1e-9

    # What is heard

    def _hear_pulls(self, control: FingerControl, finger: Finger, message: CablePulls) -> None:
        try:
            control.hear_pulls(pulls_from_message(message, finger), self._now())
        except CcrError as error:
            self._warn(f"measured pulls of {finger.name} refused: {error}")

    def _hear_state(self, control: FingerControl, message: FingerState) -> None:
        try:
            control.hear_solved(convert.solved_finger(message, control), self._now())
        except CcrError as error:
            self._warn(f"state of {control.name} refused: {error}")
            return
        self._contacts[control.name] = list(message.contacts)

    def _hear_servos(self, message: ServoState) -> None:
        self._gripper.servos = convert.servo_health(message)
        for finger in self._gripper.fingers.values():
            finger.servo_tensions = convert.servo_tensions(message, finger)

    def _hear_grasp(self, message: GraspState) -> None:
        try:
            self._gripper.thing.hear(held_object(message), self._now())
        except CcrError as error:
            self._warn(f"state of the object refused: {error}")

    def _warn(self, text: str) -> None:
        self.get_logger().warning(text, throttle_duration_sec=_WARN_EVERY)

    # What is done

    def _serve(
        self,
        name: str,
        call: Callable[[], str],
        request: Trigger.Request,
        response: Trigger.Response,
    ) -> Trigger.Response:
        try:
            response.message = call()
            response.success = True
        except CcrError as error:
            response.message = str(error)
            self.get_logger().warning(f"{name} refused: {error}")
        self._command()  # what was frozen goes out at once
        self._tell_changes()
        return response

    def _step(self) -> None:
        self._gripper.step(self._now())
        self._plans.step()
        self._command()
        self._actions.answer()
        self._tell_changes()

    def _command(self) -> None:
        now = self._now()
        if self._gripper.commanding:
            self._commanded_until = now + _LAST_COMMANDS
        if now > self._commanded_until:
            return  # the servo bridge holds by itself, and others may command it
        header = Header(stamp=self.get_clock().now().to_msg())
        for name, finger in self._gripper.fingers.items():
            self._commands[name].publish(convert.command_message(header, finger))

    # What is told

    def _fingers(self) -> list[FingerGrip]:
        return [
            convert.finger_grip(self._gripper, finger, self._contacts[name])
            for name, finger in self._gripper.fingers.items()
        ]

    def _tell_changes(self) -> None:
        gripper = self._gripper
        waits = gripper.release_in(self._now()) >= 0.0
        news = (gripper.state, gripper.phase, gripper.message, gripper.refusal, waits)
        if news == self._told:
            return
        before, self._told = self._told, news
        if not before or before[:1] != news[:1] or before[2] != news[2]:
            log = self.get_logger()
            text = f"{gripper.state}: {gripper.message}"
            if gripper.state is State.FAULT:
                log.error(text)
            else:
                log.info(text)
            self._publish_diagnostics()
        self._publish_state()

    def _tell(self) -> None:
        self._publish_state()
        self._actions.tell()

    def _publish_state(self) -> None:
        header = Header(stamp=self.get_clock().now().to_msg())
        self._state.publish(
            convert.gripper_state(header, self._gripper, self._now(), self._fingers())
        )

    def _publish_diagnostics(self) -> None:
        gripper = self._gripper
        values: dict[str, object] = {"state": gripper.state, "object held": gripper.object_held}
        for name, finger in gripper.fingers.items():
            values |= {f"{name} force [N]": f"{finger.force():.4f}"}
        status = make_status(
            self.get_fully_qualified_name(),
            self._gripper_name,
            _LEVELS.get(gripper.state, DiagnosticStatus.OK),
            f"{gripper.state}: {gripper.message}",
            values,
        )
        header = Header(stamp=self.get_clock().now().to_msg())
        self._diagnostics.publish(DiagnosticArray(header=header, status=[status]))


def spin(context: Context | None = None) -> None:
    """Run the node in a context until this ends; see `runner.spin`."""
    runner.spin(GripperCoordinatorNode, context)
