# SPDX-License-Identifier: Apache-2.0
"""The servo bridge without ROS. In every state the servos hold what they hold."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress

from ccr_ros.model.errors import CcrError

from .axis import CableAxis
from .calibrator import Calibrator
from .driver import BusLost, DriverError, ServoDriver
from .faults import Fault, FaultCode
from .states import BridgeSettings, BridgeState, Refused

_LONGEST_STEP = 0.1  # s that setpoints go on in one cycle, however late it comes


class ServoBridge:
    """Leads the servos of a rack.

    Args:
        driver: The servos, opened.
        settings: How.
        zeros: Angles [rad] by joint at which the cables are just taut; the others are not known.
        store: Called with all zeros when calibration has found them; an error it raises fails the
            calibration, and the zeros stay as they were.
    """

    def __init__(
        self,
        driver: ServoDriver,
        settings: BridgeSettings,
        zeros: Mapping[str, float],
        store: Callable[[dict[str, float]], None],
    ) -> None:
        self.driver = driver
        self.rack = driver.rack
        self.settings = settings
        self.axes = tuple(
            CableAxis(
                joint,
                zeros.get(joint.name, math.nan),
                settings.stall_time,
                settings.tension_filter,
            )
            for joint in self.rack.joints
        )
        self.fault: Fault | None = None
        self.measured_at: float | None = None  # s, when the servos answered last
        self._store = store
        self._reason = self._waiting = ""
        self._active = self._stopped = False
        self._now: float | None = None
        self._silent_since: float | None = None
        self._unwritten = False  # whether the newest setpoints could not be sent
        self._commanded_at: dict[int, float] = {}
        self._calibrator: Calibrator | None = None
        self._calibrated: Callable[[dict[str, float], str], None] | None = None

    @property
    def state(self) -> BridgeState:
        """The state it is in."""
        if self.fault is not None:
            return BridgeState.FAULT
        if self._stopped:
            return BridgeState.STOPPED
        if not self._active:
            return BridgeState.INACTIVE
        return BridgeState.CALIBRATING if self._calibrator else BridgeState.ACTIVE

    @property
    def reason(self) -> str:
        """Why it is in that state, in words; empty: nothing to tell."""
        if self.fault is not None:
            return self.fault.reason
        if self._calibrator is not None:
            return f"calibrating {self._calibrator.joint}"
        return self._waiting or self._reason

    @property
    def setpoints(self) -> tuple[float, ...]:
        """Where the servos are sent [rad]; NaN: nowhere yet."""
        return tuple(axis.setpoint for axis in self.axes)

    @property
    def leading(self) -> bool:
        """Whether the servos have been sent somewhere, and hold there at least."""
        return not any(math.isnan(axis.setpoint) for axis in self.axes)

    # Cycle

    def cycle(self, now: float) -> None:
        """Read the servos, look after them, send them on. Call it at an even rate; ``now`` in s."""
        dt = 0.0 if self._now is None else min(max(now - self._now, 0.0), _LONGEST_STEP)
        if self._now is not None and now < self._now:
            self._commanded_at.clear()  # the clock was set back: no command has an age any more
        self._now = now
        if not self._read(now, dt):
            return
        if self.fault is None and (fault := self._look(now)):
            self._fail(fault)
        if self.state == BridgeState.ACTIVE:
            self._follow(now, dt)
        elif self._calibrator is not None:
            self._calibrate(self._calibrator, dt)
        if self.state != BridgeState.INACTIVE:
            self._write()

    def _read(self, now: float, dt: float) -> bool:
        try:
            reading = self.driver.read(now)
        except BusLost as error:
            self._miss(now, str(error))
            return False
        self._waiting = ""
        if not self._unwritten:
            self._silent_since = None
        self.measured_at = now
        for index, axis in enumerate(self.axes):
            axis.measure(reading, index, dt)
        return True

    def _miss(self, now: float, why: str) -> None:
        """Count the time without an answer; before the first activation none is owed."""
        if self._silent_since is None or now < self._silent_since:
            self._silent_since = now
        if not self.leading:
            self._waiting = why
        elif now - self._silent_since >= self.settings.bus_timeout and not self.fault:
            self._fail(Fault(FaultCode.BUS_LOST, "", why))

    def _look(self, now: float) -> Fault | None:
        """Return what is wrong; what the servos do themselves counts only while they are led."""
        state = self.state
        for axis in self.axes:
            fault = axis.check_servo()
            if state == BridgeState.ACTIVE:
                fault = fault or axis.check_limits() or axis.check_progress(now)
            elif state == BridgeState.CALIBRATING:
                fault = fault or axis.check_tension() or axis.check_progress(now)
            if fault:
                return fault
        return None

    def _follow(self, now: float, dt: float) -> None:
        for index, axis in enumerate(self.axes):
            at = self._commanded_at.get(index, -math.inf)
            if now - at > self.settings.command_timeout:
                axis.expire()
            axis.advance(dt)

    def _calibrate(self, calibrator: Calibrator, dt: float) -> None:
        try:
            calibrator.step(dt)
            if not calibrator.done:
                return
            self._store({**self.zeros, **calibrator.zeros})
        except CcrError as error:
            self._end_calibration({}, str(error))
            return
        for name, zero in calibrator.zeros.items():
            self.axes[self.rack.index(name)].set_zero(zero)
        self._end_calibration(calibrator.zeros, "")

    def _end_calibration(self, zeros: dict[str, float], failure: str) -> None:
        """Hold; tell who asked: the zeros [rad] by joint, or why there are none."""
        if self._calibrator is None:
            return
        self._calibrator = None
        self._freeze()
        self._reason = f"calibration failed: {failure}" if failure else ""
        tell, self._calibrated = self._calibrated, None
        if tell is not None:
            tell(zeros, failure)

    def _write(self) -> None:
        lost = self.fault is not None and self.fault.code == FaultCode.BUS_LOST
        if lost or not self.leading or self._now is None:
            return  # who comes back from a lost bus may have been moved meanwhile
        try:
            self.driver.write(self.setpoints)
            self._unwritten = False
        except BusLost as error:
            self._unwritten = True
            self._miss(self._now, str(error))

    def _freeze(self, ease: str = "") -> None:
        """Stop all servos at once; `ease`: joints whose setpoint may not pull ahead."""
        self._commanded_at.clear()
        for axis in self.axes:
            axis.freeze(ease=axis.joint.name == ease)

    def _fail(self, fault: Fault) -> None:
        self.fault = fault
        self._freeze(fault.joint if fault.code == FaultCode.OVER_TENSION else "")
        self._end_calibration({}, f"{fault.joint or 'servos'}: {fault.reason}")

    # Requests

    @property
    def zeros(self) -> dict[str, float]:
        """The known zeros [rad] by joint."""
        return {a.joint.name: a.transmission.zero for a in self.axes if a.calibrated}

    def command(self, pulls: Mapping[int, float], at: float, now: float) -> None:
        """Send cables to pulls [m], by place of the joint, all or none; ``at``: its time [s].

        Raises:
            Refused: The bridge is not ACTIVE, or the command is too old or from the future.
            InvalidValue: A pull is not finite or beyond its travel.
            DriverError: A zero is not known.
        """
        if self.state != BridgeState.ACTIVE:
            raise Refused(f"servos are not led, the bridge is {self.state.name}")
        if abs(now - at) > self.settings.command_timeout:
            age = f"{now - at:.3g} s old" if now > at else f"{at - now:.3g} s ahead of the clock"
            raise Refused(f"the command is {age}; command_timeout is {self._timeout_text}")
        checked = {index: self.axes[index].checked(pull) for index, pull in pulls.items()}
        for index, pull in checked.items():
            self.axes[index].follow(pull)
            self._commanded_at[index] = at

    @property
    def _timeout_text(self) -> str:
        return f"{self.settings.command_timeout:g} s"

    def activate(self, now: float) -> None:
        """Lead the servos from now on, from where they are: nothing moves.

        Raises:
            BusLost, DriverError: The servos do not answer, or cannot be used.
            Refused: There is a fault that needs a reset.
        """
        if self.fault is not None:
            raise Refused(f"{self.fault.code.name}: {self.fault.reason}; reset first")
        self._adopt(now)
        self._active = True
        self._reason = ""

    def deactivate(self) -> None:
        """Lead the servos no more; they hold."""
        self._end_calibration({}, "the bridge was deactivated")
        self._freeze()
        self._write()
        self._active = False

    def stop(self) -> None:
        """Stop all servos at once, and hold until reset."""
        self._stopped = True
        self._end_calibration({}, "stopped")
        self._freeze()
        self._write()
        self._reason = "stopped on request"

    def reset(self, now: float) -> None:
        """Leave STOPPED or FAULT; nothing moves, and only new commands count.

        Raises:
            Refused: The cause is still there.
        """
        fault = self.fault
        if fault is not None and fault.code in (FaultCode.BUS_LOST, FaultCode.SERVO_ERROR):
            try:
                self.driver.recover()
                self._adopt(now)
                self._unwritten = False
            except (BusLost, DriverError) as error:
                raise Refused(f"{fault.code.name}: {error}") from None
        for axis in self.axes:
            if still := axis.check_servo():
                raise Refused(f"{still.joint}: {still.code.name}: {still.reason}")
            axis.resume()
        self.fault = None
        self._stopped = False
        self._reason = ""

    def calibrate(
        self, joints: Sequence[str], done: Callable[[dict[str, float], str], None]
    ) -> None:
        """Start to look for the zeros of joints (none named: of all), in later cycles.

        Args:
            done: Called once at the end with the zeros [rad] by joint, and why it failed, if so.

        Raises:
            Refused: The bridge is not ACTIVE, or a cable holds something.
            UnknownName: There is no such joint.
        """
        if self.state != BridgeState.ACTIVE:
            raise Refused(f"calibration starts from ACTIVE; the bridge is {self.state.name}")
        names = [name for name in self.rack.names if name in joints] if joints else self.rack.names
        for name in joints:
            self.rack.index(name)
        axes = [self.axes[self.rack.index(name)] for name in names]
        for axis in axes:
            search = self.settings.calibration
            if axis.pull > search.slack and axis.tension > search.threshold:
                raise Refused(
                    f"{axis.joint.name} is pulled by {1e3 * axis.pull:.3g} mm with "
                    f"{axis.tension:.3g} N and would let go; release first"
                )
        self._freeze()
        self._calibrator = Calibrator(axes, self.settings.calibration)
        self._calibrated = done

    def close(self) -> None:
        """Leave the servos as they are: they hold."""
        self._end_calibration({}, "the bridge was closed")
        self._active = False
        with suppress(BusLost):  # they keep their last setpoint by themselves
            self.driver.hold()
        self.driver.close()

    def _adopt(self, now: float) -> None:
        for axis, angle in zip(self.axes, self.driver.enable(now), strict=True):
            axis.adopt(angle)
        self._now = now
        self._read(now, 0.0)
        self._freeze()  # a setpoint far ahead of its servo is not adopted whole
