# SPDX-License-Identifier: Apache-2.0
"""A rack of Dynamixel servos of the X series on a serial bus."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence

import numpy as np

from ccr_ros.model.errors import InvalidValue

from ..driver import BusLost, DriverError, ServoDriver, ServoReading
from ..rack import ServoJoint, ServoRack
from . import dynamixel_bus as bus

_COUNTS = 4096 / (2 * math.pi)  # per rad
_VELOCITY_UNIT = 0.229 * 2 * math.pi / 60  # rad/s
_WATCHDOG_UNIT = 0.02  # s

# Operating modes; both count turns.
_EXTENDED_POSITION, _CURRENT_BASED_POSITION = 4, 5

_HEALTH_EVERY = 0.5  # s
_REBOOT_LIMIT = 2.0  # s until a servo answers after its restart

_HARDWARE_ERRORS = {
    0: "input voltage out of range",
    2: "overheating",
    3: "motor encoder broken",
    4: "electrical shock, or too little power",
    5: "overload",
}


class DynamixelDriver(ServoDriver):
    """Servos that hold by themselves: torque is switched on, and never off.

    Args:
        rack: The servos; each joint needs its ``id``. Where it has a ``current_limit`` the servo
            works in current-based position mode within this current, else in extended position
            mode. Efforts are known where it has a ``torque_constant``.
        port, baud_rate: Of the bus.
        watchdog: Servos stop and hold when the bus is silent for this long [s]; 0: never.
        current_unit: Current of one count [A].

    Raises:
        InvalidValue: A joint has no id.
        DriverError: The SDK is not installed.
    """

    name = "dynamixel"

    def __init__(
        self, rack: ServoRack, port: str, baud_rate: int, watchdog: float, current_unit: float
    ) -> None:
        super().__init__(rack)
        ids: list[int] = []
        for joint in rack.joints:
            if joint.id is None:
                raise InvalidValue(f"{joint.name}.id", None, "the servo's number on the bus")
            ids.append(joint.id)
        self._bus = bus.DynamixelBus(port, baud_rate, ids)
        self._joints = dict(zip(ids, rack.joints, strict=True))
        self._watchdog = math.ceil(watchdog / _WATCHDOG_UNIT)
        self._current_unit = current_unit
        self._torque_constants = np.array(
            [math.nan if j.torque_constant is None else j.torque_constant for j in rack.joints]
        )
        self._enabled = False
        self._health_at = -math.inf
        self._errors = ("",) * len(ids)

    def open(self) -> None:
        """Open the port and look for the servos; their registers stay as they are."""
        self._bus.open()
        for servo, joint in self._joints.items():
            self._bus.ping(servo)
            mode = self._bus.get(servo, bus.OPERATING_MODE)
            if mode != _mode(joint) and self._bus.get(servo, bus.TORQUE_ENABLE):
                raise DriverError(
                    f"servo {servo} ({joint.name}) holds in operating mode {mode}, and would have "
                    f"to let go to change to {_mode(joint)}; free it, then switch its torque off"
                )

    def enable(self, now: float) -> tuple[float, ...]:
        """Switch torque on where it is off; a servo that holds already keeps its goal."""
        held = tuple(self._enable(servo, joint) for servo, joint in self._joints.items())
        self._enabled = True
        self._health_at = -math.inf
        return held

    def read(self, now: float) -> ServoReading:
        """Read all servos at once, and now and then what errors they have."""
        values = self._bus.get_all(bus.PRESENT_CURRENT, bus.PRESENT_TEMPERATURE)
        if not 0.0 <= now - self._health_at < _HEALTH_EVERY:
            self._errors = self._read_errors()
            self._health_at = now

        def column(register: bus.Register, unit: float) -> np.ndarray:
            return unit * np.array([value(register) for value in values], dtype=float)

        return ServoReading(
            angles=column(bus.PRESENT_POSITION, 1.0 / _COUNTS),
            velocities=column(bus.PRESENT_VELOCITY, _VELOCITY_UNIT),
            efforts=column(bus.PRESENT_CURRENT, self._current_unit) * self._torque_constants,
            temperatures=column(bus.PRESENT_TEMPERATURE, 1.0),
            errors=self._errors,
        )

    def write(self, angles: Sequence[float]) -> None:
        """Write the goal positions of all servos at once."""
        self._bus.put_all(bus.GOAL_POSITION, [_counts(angle) for angle in angles])

    def recover(self) -> None:
        """Open the port anew, and restart servos that gave up on a hardware error."""
        self._bus.open()
        for servo, joint in self._joints.items():
            self._bus.ping(servo)
            error = self._bus.get(servo, bus.HARDWARE_ERROR)
            if not error:
                continue
            if self._bus.get(servo, bus.TORQUE_ENABLE):
                raise DriverError(
                    f"servo {servo} ({joint.name}) still holds with {_error_text(error)}, and "
                    "would let go in a restart; free it, then restart it"
                )
            self._bus.reboot(servo)
            self._wait_for(servo)
        self._errors = ("",) * len(self._joints)

    def hold(self) -> None:
        """Switch the watchdogs off: from now on silence is no alarm."""
        if self._enabled:
            for servo in self._joints:
                self._bus.put(servo, bus.BUS_WATCHDOG, 0)

    def close(self) -> None:
        """Close the port."""
        self._bus.close()

    def _enable(self, servo: int, joint: ServoJoint) -> float:
        """Have one servo follow its goal; return the angle it holds [rad]."""
        tripped = self._bus.get(servo, bus.BUS_WATCHDOG) < 0
        if self._bus.get(servo, bus.TORQUE_ENABLE):
            goal = self._bus.get(servo, bus.GOAL_POSITION)
            if tripped:  # it stopped on its way: no farther than the force it holds with needs
                most = _counts(joint.tolerance * joint.gear / joint.spool_radius)
                place = self._bus.get(servo, bus.PRESENT_POSITION)
                goal = min(max(goal, place - most), place + most)
            self._set_up(servo, joint, goal)
        else:
            if self._bus.get(servo, bus.OPERATING_MODE) != _mode(joint):
                self._bus.put(servo, bus.OPERATING_MODE, _mode(joint))
            goal = self._bus.get(servo, bus.PRESENT_POSITION)
            self._set_up(servo, joint, goal)
            self._bus.put(servo, bus.TORQUE_ENABLE, 1)
        return goal / _COUNTS

    def _set_up(self, servo: int, joint: ServoJoint, goal: int) -> None:
        self._bus.put(servo, bus.BUS_WATCHDOG, 0)  # goals can be written again
        if joint.current_limit is not None:
            limit = max(1, round(joint.current_limit / self._current_unit))
            self._bus.put(servo, bus.GOAL_CURRENT, limit)
        self._bus.put(servo, bus.GOAL_POSITION, goal)
        self._bus.put(servo, bus.BUS_WATCHDOG, self._watchdog)

    def _read_errors(self) -> tuple[str, ...]:
        errors = []
        for value in self._bus.get_all(bus.TORQUE_ENABLE, bus.BUS_WATCHDOG):
            words = _error_text(value(bus.HARDWARE_ERROR))
            if self._enabled and not value(bus.TORQUE_ENABLE):
                words = f"{words}; " if words else ""
                words += "its torque is off: it shut itself down, or lost its power"
            elif self._enabled and value(bus.BUS_WATCHDOG) < 0:
                words = words or "it stopped, as the bus was silent (bus watchdog)"
            errors.append(words)
        return tuple(errors)

    def _wait_for(self, servo: int) -> None:
        deadline = time.monotonic() + _REBOOT_LIMIT
        while True:
            try:
                self._bus.ping(servo)
                return
            except BusLost:
                if time.monotonic() > deadline:
                    raise


def _mode(joint: ServoJoint) -> int:
    return _EXTENDED_POSITION if joint.current_limit is None else _CURRENT_BASED_POSITION


def _counts(angle: float) -> int:
    return round(angle * _COUNTS)


def _error_text(bits: int) -> str:
    return ", ".join(
        _HARDWARE_ERRORS.get(bit, f"hardware error bit {bit}")
        for bit in range(8)
        if bits >> bit & 1
    )
