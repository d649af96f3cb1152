# SPDX-License-Identifier: Apache-2.0
"""What every kind of servo rack can do, whatever is behind it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ccr_ros.model.errors import CcrError

from .rack import ServoRack


class BusLost(CcrError):
    """The servos cannot be read or written; its text says why."""


class DriverError(CcrError):
    """The servos cannot be used as they are set up; its text says what to do."""


@dataclass(frozen=True, eq=False)
class ServoReading:
    """What the servos say, one number per joint; NaN: not known.

    Attributes:
        angles: [rad].
        velocities: [rad/s].
        efforts: Torques at the servos' shafts [N m].
        temperatures: [degC].
        errors: Errors that the servos report themselves, in words; empty: none.
    """

    angles: np.ndarray
    velocities: np.ndarray
    efforts: np.ndarray
    temperatures: np.ndarray
    errors: tuple[str, ...]


class ServoDriver(ABC):
    """Servos of a rack. No method ever lets go of a cable: servos keep their last setpoint.

    Args:
        rack: The servos, in the order of all arrays.
    """

    name: ClassVar[str]
    #: Zeros that are right by construction [rad], or None: calibration finds them.
    own_zeros: tuple[float, ...] | None = None

    def __init__(self, rack: ServoRack) -> None:
        self.rack = rack

    @abstractmethod
    def open(self) -> None:
        """Get in touch with the servos; nothing moves.

        Raises:
            BusLost: They do not answer.
            DriverError: They are not set up as they must be.
        """

    @abstractmethod
    def read(self, now: float) -> ServoReading:
        """Return what the servos say at a time [s].

        Raises:
            BusLost: They do not answer.
        """

    @abstractmethod
    def write(self, angles: Sequence[float]) -> None:
        """Send every servo to an angle [rad].

        Raises:
            BusLost: They do not listen.
        """

    def enable(self, now: float) -> tuple[float, ...]:
        """Have the servos follow setpoints from now on; nothing moves.

        Returns:
            The angles [rad] that they hold: where one follows a setpoint already, that setpoint,
            which keeps the force it holds with; else the angle it is at.

        Raises:
            BusLost, DriverError: As for `open`.
        """
        return tuple(self.read(now).angles.tolist())

    def recover(self) -> None:
        """Get in touch again after the bus was lost; nothing moves.

        Raises:
            BusLost, DriverError: As for `open`.
        """
        self.open()

    @abstractmethod
    def hold(self) -> None:
        """Have the servos keep their last setpoint from now on though nobody writes any more."""

    @abstractmethod
    def close(self) -> None:
        """Let go of the bus, not of the cables."""
