# SPDX-License-Identifier: Apache-2.0
"""servo_bridge_node: wanted pulls in, servo angles out; measured angles in, pulls out.

Topics, services and parameters: docs/interfaces.md. Wiring and calibration: docs/servo_bridge.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ccr_msgs.srv import Calibrate
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import SetParametersResult
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.context import Context
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter
from rclpy.task import Future
from rclpy.timer import Timer
from std_msgs.msg import Header
from std_srvs.srv import Trigger

from ccr_ros.actuation.bridge import ServoBridge
from ccr_ros.actuation.driver import ServoDriver
from ccr_ros.actuation.drivers.loopback import LoopbackDriver
from ccr_ros.actuation.drivers.ros2_control import Ros2ControlDriver
from ccr_ros.actuation.zeros import load_zeros, save_zeros
from ccr_ros.model import CcrError

from . import runner, servo_parameters
from .qos import DIAGNOSTICS
from .servo_diagnostics import ServoDiagnostics
from .servo_topics import ServoTopics

_STATE_RATE = 10.0  # Hz, at most; changes are told at once
_HEARTBEAT = 0.4  # s, also where simulated time stands still
_DIAGNOSTICS_PERIOD = 1.0  # s


class ServoBridgeNode(LifecycleNode):
    """Leads the servos of one gripper.

    Configured, it reads the servos; active, it follows commands. In no state, and at no end, does
    it let go of a cable: servos keep their last setpoint.

    Args:
        options: Of `rclpy.node.Node` (namespace, parameter_overrides, context, ...).

    Raises:
        CcrError: A file or a setting is not valid; with autostart also when the servos cannot be
            used.
        rclpy.exceptions.ParameterException: A parameter is of the wrong type or out of range.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("servo_bridge_node", **options)
        try:
            self._set_up(servo_parameters.declare(self))
        except BaseException:
            self.end()
            self.destroy_node()
            raise

    _bridge: ServoBridge | None = None

    def _set_up(self, fixed: servo_parameters.ServoParameters) -> None:
        self._fixed = fixed
        self._failure = ""  # why it is not configured
        self._cycle_timer: Timer | None = None
        self._cycles = 0
        self._told: tuple[object, ...] = ()  # what was last told of the state
        self._starting = fixed.autostart
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)  # as sim time may stand still
        self._untold = False  # whether a command was refused that diagnostics do not tell yet
        self._topics = ServoTopics(self, fixed, self._refused)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", DIAGNOSTICS)
        self._health = ServoDiagnostics(self.get_fully_qualified_name(), fixed.rack.name)

        self.create_service(Trigger, "~/stop", self._stop)
        self.create_service(Trigger, "~/reset", self._reset)
        # Its answer comes after many cycles, which must not wait for it.
        self._waiting_group = ReentrantCallbackGroup()
        self.create_service(
            Calibrate, "~/calibrate", self._calibrate, callback_group=self._waiting_group
        )
        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._parameters_changed)

        self.create_timer(_HEARTBEAT, self._tell, clock=self._steady)
        self.create_timer(_DIAGNOSTICS_PERIOD, self._report, clock=self._steady)
        if fixed.autostart:
            self._start()
        self._tell()

    def _start(self) -> None:
        """Configure; activate as soon as the servos answer.

        Raises:
            CcrError: It cannot be configured, or not activated though the servos answer.
        """
        if self.trigger_configure() != TransitionCallbackReturn.SUCCESS:
            raise CcrError(self._failure)
        self._cycle()
        if self._failure:
            raise CcrError(self._failure)

    # Lifecycle

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Read the zeros, get in touch with the servos; nothing moves."""
        fixed = self._fixed
        try:
            driver = self._make_driver()
            zeros = load_zeros(fixed.calibration_file, fixed.rack, fixed.driver)
            driver.open()
        except CcrError as error:
            return self._failed(error)
        if driver.own_zeros is not None:
            zeros = {**dict(zip(fixed.rack.names, driver.own_zeros, strict=True)), **zeros}

        def store(found: dict[str, float]) -> None:
            save_zeros(fixed.calibration_file, fixed.rack, fixed.driver, found)

        self._bridge = ServoBridge(driver, fixed.settings, zeros, store)
        self._topics.serve(self._bridge)
        self._cycle_timer = self.create_timer(1.0 / fixed.rate, self._cycle)
        self._failure = ""
        unknown = [name for name in fixed.rack.names if name not in zeros]
        if unknown:
            self.get_logger().warning(f"to be calibrated: {', '.join(unknown)}")
        self._tell()
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Follow commands from now on, starting where the servos are; nothing moves."""
        self._starting = False
        try:
            self._present().activate(self._now())
        except CcrError as error:
            return self._failed(error)
        self._failure = ""
        self.get_logger().info(f"leads {', '.join(self._fixed.rack.names)}")
        self._tell()
        return TransitionCallbackReturn.SUCCESS

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Follow no commands any more; the servos hold."""
        self._starting = False
        self._present().deactivate()
        self._tell()
        return TransitionCallbackReturn.SUCCESS

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Leave the servos, which hold."""
        self._leave()
        self._tell()
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Leave the servos, which hold."""
        self._leave()
        self._tell()
        return TransitionCallbackReturn.SUCCESS

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Leave the servos, which hold, and be unconfigured."""
        self._leave()
        return TransitionCallbackReturn.SUCCESS

    def end(self) -> None:
        """Leave the servos, which hold: the process ends."""
        bridge, self._bridge = self._bridge, None
        if bridge is not None:
            bridge.close()

    def _leave(self) -> None:
        if self._cycle_timer is not None:
            self.destroy_timer(self._cycle_timer)
            self._cycle_timer = None
        self._starting = False
        self._topics.serve(None)
        self.end()

    def _failed(self, error: CcrError) -> TransitionCallbackReturn:
        self._failure = str(error)
        self.get_logger().error(self._failure)
        return TransitionCallbackReturn.FAILURE

    def _make_driver(self) -> ServoDriver:
        fixed = self._fixed
        if fixed.driver == LoopbackDriver.name:
            settings = servo_parameters.loopback_settings(self, fixed.rack)
            return LoopbackDriver(
                fixed.rack, settings, fixed.seed, state_file=fixed.state_file or None
            )
        if fixed.driver == Ros2ControlDriver.name:
            return Ros2ControlDriver(
                fixed.rack, self._topics.send, fixed.settings.bus_timeout, fixed.torque_per_effort
            )
        from ccr_ros.actuation.drivers.dynamixel import DynamixelDriver

        return DynamixelDriver(
            fixed.rack, fixed.port, fixed.baud_rate, fixed.watchdog, fixed.current_unit
        )

    def _present(self) -> ServoBridge:
        if self._bridge is None:
            raise CcrError("the bridge is not configured")
        return self._bridge

    # Cycle

    def _now(self) -> float:
        return self.get_clock().now().nanoseconds * 1e-9

    def _cycle(self) -> None:
        bridge = self._bridge
        if bridge is None:
            return
        now = self.get_clock().now()
        seconds = now.nanoseconds * 1e-9
        bridge.cycle(seconds)
        if bridge.measured_at == seconds:
            self._topics.publish_measured(now.to_msg())
            if self._starting:
                self._starting = False
                self.trigger_activate()
        self._cycles += 1
        if self._cycles >= self._fixed.rate / _STATE_RATE or self._news() != self._told:
            self._tell()
        if self._untold:
            self._report()

    def _news(self) -> tuple[object, ...]:
        bridge = self._bridge
        if bridge is None:
            return (self._failure,)
        return (bridge.state, bridge.fault, bridge.reason)

    def _tell(self) -> None:
        """Publish the state, and what is wrong with it if that is new."""
        self._cycles = 0
        news = self._news()
        if news != self._told:
            self._told = news
            if self._bridge is not None and self._bridge.fault is not None:
                fault = self._bridge.fault
                self.get_logger().error(
                    f"{fault.code.name} {fault.joint or 'of all servos'}: {fault.reason}; "
                    "the servos hold until ~/reset"
                )
            self._report()
        self._topics.publish_state(self.get_clock().now().to_msg(), self._failure)

    def _refused(self) -> None:
        self._untold = True  # the next cycle tells: once, of however many

    def _report(self) -> None:
        """Publish diagnostics."""
        self._untold = False
        status = self._health.status(self._bridge, self._topics, self._failure)
        header = Header(stamp=self.get_clock().now().to_msg())
        self._diagnostics.publish(DiagnosticArray(header=header, status=[status]))

    # Services

    def _stop(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        if self._bridge is None:
            response.success, response.message = True, "not configured: nothing is led"
            return response
        self._bridge.stop()
        self._tell()
        response.success, response.message = True, "stopped; the servos hold until ~/reset"
        return response

    def _reset(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        try:
            self._present().reset(self._now())
        except CcrError as error:
            response.success, response.message = False, str(error)
        else:
            response.success, response.message = True, f"now {self._present().state.name}"
        self._tell()
        return response

    async def _calibrate(
        self, request: Calibrate.Request, response: Calibrate.Response
    ) -> Calibrate.Response:
        done = Future()
        try:
            self._present().calibrate(
                list(request.joints), lambda zeros, failure: done.set_result((zeros, failure))
            )
        except CcrError as error:
            response.success, response.message = False, str(error)
            return response
        self._tell()
        zeros, failure = await done
        response.success, response.message = not failure, failure or "calibrated"
        response.joints, response.zeros = list(zeros), list(zeros.values())
        return response

    # Parameters

    def _check_parameters(self, changed: Sequence[Parameter]) -> SetParametersResult:
        try:
            servo_parameters.loopback_settings(self, self._fixed.rack, changed)
        except CcrError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _parameters_changed(self, changed: Sequence[Parameter]) -> None:
        driver = None if self._bridge is None else self._bridge.driver
        if isinstance(driver, LoopbackDriver) and any(map(servo_parameters.is_loopback, changed)):
            driver.settings = servo_parameters.loopback_settings(self, self._fixed.rack)


def spin(context: Context | None = None) -> None:
    """Run the node in a context until this ends; see `runner.spin`."""
    runner.spin(ServoBridgeNode, context)
