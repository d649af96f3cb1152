# SPDX-License-Identifier: Apache-2.0
"""A Dynamixel bus by ROBOTIS' SDK (protocol 2.0): registers by name, and errors that are raised.

Registers are those of the X series: https://emanual.robotis.com/docs/en/dxl/x/xm430-w350/
"""

from __future__ import annotations

import termios
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from ..driver import BusLost, DriverError

# What a serial port raises when it goes; pyserial's own errors are OSErrors.
_PORT_ERRORS = (OSError, termios.error)

_ATTEMPTS = 3

# s; the SDK polls for answers, and would keep the processor busy with reads that do not wait.
_READ_SLICE = 0.002

_ALERT = 0x80  # of a status: the servo has a hardware error, which a register tells


@dataclass(frozen=True)
class Register:
    """A place in a servo's control table: address, size in bytes, with a sign or without."""

    name: str
    address: int
    size: int
    signed: bool = False

    def value(self, data: Sequence[int]) -> int:
        """Return the number that bytes of the register hold."""
        return int.from_bytes(bytes(data), "little", signed=self.signed)

    def data(self, value: int) -> list[int]:
        """Return the bytes of a number."""
        return list(value.to_bytes(self.size, "little", signed=self.signed))


OPERATING_MODE = Register("Operating Mode", 11, 1)
TORQUE_ENABLE = Register("Torque Enable", 64, 1)
HARDWARE_ERROR = Register("Hardware Error Status", 70, 1)
BUS_WATCHDOG = Register("Bus Watchdog", 98, 1, signed=True)
GOAL_CURRENT = Register("Goal Current", 102, 2, signed=True)
GOAL_POSITION = Register("Goal Position", 116, 4, signed=True)
PRESENT_CURRENT = Register("Present Current", 126, 2, signed=True)
PRESENT_VELOCITY = Register("Present Velocity", 128, 4, signed=True)
PRESENT_POSITION = Register("Present Position", 132, 4, signed=True)
PRESENT_TEMPERATURE = Register("Present Temperature", 146, 1)


class DynamixelBus:
    """Servos on one serial port.

    Args:
        port: Of the serial adapter, as /dev/ttyUSB0.
        baud_rate: As set in the servos.
        ids: Their numbers.

    Raises:
        DriverError: The SDK is not installed.
    """

    def __init__(self, port: str, baud_rate: int, ids: Sequence[int]) -> None:
        try:
            import dynamixel_sdk
        except ImportError:
            raise DriverError(
                "Dynamixel servos need dynamixel_sdk: pip install 'ccr_ros[dynamixel]', or with "
                "ROS 2 apt install ros-jazzy-dynamixel-sdk"
            ) from None
        self._sdk: Any = dynamixel_sdk
        self._name = port
        self._baud_rate = baud_rate
        self.ids = tuple(ids)
        self._packets = dynamixel_sdk.PacketHandler(2.0)
        self._port: Any = None

    def open(self) -> None:
        """Open the port anew.

        Raises:
            BusLost: It cannot be opened.
        """
        self.close()
        port = self._sdk.PortHandler(self._name)  # a new one: an old one may think it is in use
        port.baudrate = self._baud_rate
        try:
            port.openPort()
            port.ser.timeout = _READ_SLICE
        except _PORT_ERRORS as error:
            raise BusLost(f"{self._name} cannot be opened: {_reason(error)}") from None
        self._port = port

    def close(self) -> None:
        """Close the port, if it is open."""
        port, self._port = self._port, None
        if port is not None:
            try:
                port.closePort()
            except _PORT_ERRORS:
                return  # it has gone already

    def ping(self, servo: int) -> None:
        """Raise BusLost unless a servo answers."""
        _, result, _ = self._persist(self._packets.ping, servo)
        self._check(servo, result, 0, "does not answer")

    def reboot(self, servo: int) -> None:
        """Restart a servo, which lets go of what it holds; it answers again after a while."""
        result, error = self._call(self._packets.reboot, servo)
        self._check(servo, result, error, "reboot")

    def get(self, servo: int, register: Register) -> int:
        """Return what a register of a servo holds.

        Raises:
            BusLost: There is no answer, or none that can be read.
            DriverError: The servo refuses.
        """
        data, result, error = self._persist(
            self._packets.readTxRx, servo, register.address, register.size
        )
        self._check(servo, result, error, register.name)
        if len(data) != register.size:
            raise BusLost(f"servo {servo} at {self._name}: {register.name}: answer cut short")
        return register.value(data)

    def put(self, servo: int, register: Register, value: int) -> None:
        """Write a register of a servo, which confirms it; errors as for `get`."""
        result, error = self._persist(
            self._packets.writeTxRx, servo, register.address, register.size, register.data(value)
        )
        self._check(servo, result, error, register.name)

    def get_all(self, first: Register, last: Register) -> list[Callable[[Register], int]]:
        """Read all registers from one to another from all servos at once (sync read).

        Returns:
            For each servo a function from register to value.

        Raises:
            BusLost: One does not answer, or not as it can be read.
        """
        length = last.address + last.size - first.address
        group = self._sdk.GroupSyncRead(self._open_port, self._packets, first.address, length)
        for servo in self.ids:
            group.addParam(servo)
        result = self._guard(group.txRxPacket)
        found: list[Callable[[Register], int]] = []
        for servo in self.ids:
            data = list(group.data_dict[servo])
            if len(data) != length:  # those after the first that fails are not heard any more
                raise BusLost(f"servo {servo} at {self._name}: {self._failure(result)}")
            found.append(_reader(first, data))
        if result != self._sdk.COMM_SUCCESS:
            raise BusLost(f"{self._name}: {self._failure(result)}")
        return found

    def put_all(self, register: Register, values: Sequence[int]) -> None:
        """Write a register of all servos at once (sync write); they do not confirm it.

        Raises:
            BusLost: It cannot be sent.
        """
        group = self._sdk.GroupSyncWrite(
            self._open_port, self._packets, register.address, register.size
        )
        for servo, value in zip(self.ids, values, strict=True):
            group.addParam(servo, register.data(value))
        result = self._guard(group.txPacket)
        self._check(self.ids[0], result, 0, register.name)

    @property
    def _open_port(self) -> Any:
        if self._port is None:
            raise BusLost(f"{self._name} is not open")
        return self._port

    def _call(self, function: Callable[..., Any], *args: Any) -> Any:
        return self._guard(function, self._open_port, *args)

    def _persist(self, function: Callable[..., Any], *args: Any) -> Any:
        """Call until there is an answer, a few times: one may get lost on any bus."""
        for _ in range(_ATTEMPTS):
            answer = self._call(function, *args)
            if answer[-2] == self._sdk.COMM_SUCCESS:
                break
        return answer

    def _failure(self, result: int) -> str:
        text = self._packets.getTxRxResult(result).partition("]")[2].strip()
        return text if result != self._sdk.COMM_SUCCESS else "answer cut short"

    def _guard(self, function: Callable[..., Any], *args: Any) -> Any:
        try:
            return function(*args)
        except _PORT_ERRORS as error:
            raise BusLost(f"{self._name} has gone: {_reason(error)}") from None

    def _check(self, servo: int, result: int, error: int, what: str) -> None:
        if result != self._sdk.COMM_SUCCESS:
            raise BusLost(f"servo {servo} at {self._name}: {what}: {self._failure(result)}")
        if error & ~_ALERT:
            text = self._packets.getRxPacketError(error & ~_ALERT).partition("]")[2].strip()
            raise DriverError(f"servo {servo} at {self._name}: {what}: {text}")


def _reader(first: Register, data: list[int]) -> Callable[[Register], int]:
    def value(register: Register) -> int:
        start = register.address - first.address
        return register.value(data[start : start + register.size])

    return value


def _reason(error: BaseException) -> str:
    return getattr(error, "strerror", None) or str(error)
