# SPDX-License-Identifier: Apache-2.0
"""Servos behind ros2_control: setpoints go to a forward_command_controller, joint states come back.

ROS-free: whoever makes the driver publishes for it and passes on what it hears.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from ccr_ros.model.errors import InvalidValue

from ..driver import BusLost, ServoDriver, ServoReading
from ..rack import ServoRack


class Ros2ControlDriver(ServoDriver):
    """Servos that another program moves.

    Joint states may come from several publishers, each with some of the joints.

    Args:
        rack: The servos; setpoints are sent in their order.
        send: Publishes setpoints [rad].
        timeout: Joint states older than this are a lost bus [s].
        torque_per_effort: Torque at a servo's shaft [N m] per unit of effort in its joint state.
    """

    name = "ros2_control"

    def __init__(
        self,
        rack: ServoRack,
        send: Callable[[list[float]], None],
        timeout: float,
        torque_per_effort: float = 1.0,
    ) -> None:
        super().__init__(rack)
        self._send = send
        self._timeout = timeout
        self._torque_per_effort = torque_per_effort
        count = len(rack.joints)
        self._values = np.full((3, count), math.nan)  # angle, velocity, effort
        self._heard = np.full(count, -math.inf)
        self._sent: tuple[float, ...] | None = None

    def open(self) -> None:
        """Nothing to do: joint states come when they come."""

    def take(
        self,
        names: Sequence[str],
        angles: Sequence[float],
        velocities: Sequence[float],
        efforts: Sequence[float],
        now: float,
    ) -> None:
        """Take joint states that came at a time; those of other joints are passed over.

        Raises:
            InvalidValue: A list is neither empty nor as long as the names, a name comes twice, or
                an angle is not finite. Nothing of it counts then.
        """
        for key, values in (("position", angles), ("velocity", velocities), ("effort", efforts)):
            if len(values) not in (0, len(names)):
                raise InvalidValue(key, len(values), f"as many as names ({len(names)}), or empty")
        known = self.rack.names
        ours = [(at, known.index(name)) for at, name in enumerate(names) if name in known]
        if len({index for _, index in ours}) < len(ours):
            raise InvalidValue("name", list(names), "given once each")
        if ours and not len(angles):
            raise InvalidValue("position", [], "given: servo angles are needed")
        for at, _ in ours:
            if not math.isfinite(angles[at]):
                raise InvalidValue(f"position.{names[at]}", angles[at], "a finite number [rad]")
        for at, index in ours:
            self._values[:, index] = [
                values[at] if len(values) else math.nan for values in (angles, velocities, efforts)
            ]
            self._heard[index] = now

    def read(self, now: float) -> ServoReading:
        """Return the newest joint states, all of them newer than the timeout."""
        late = [
            name
            for name, heard in zip(self.rack.names, self._heard, strict=True)
            if now - heard > self._timeout
        ]
        if late:
            raise BusLost(f"no joint states of {', '.join(late)} for {self._timeout:g} s")
        count = len(self.rack.joints)
        return ServoReading(
            angles=self._values[0].copy(),
            velocities=self._values[1].copy(),
            efforts=self._torque_per_effort * self._values[2],
            temperatures=np.full(count, math.nan),
            errors=("",) * count,
        )

    def write(self, angles: Sequence[float]) -> None:
        """Publish setpoints."""
        self._sent = tuple(float(angle) for angle in angles)
        self._send(list(self._sent))

    def enable(self, now: float) -> tuple[float, ...]:
        """Return what was sent last, or else where the servos are."""
        angles = super().enable(now)
        return self._sent or angles

    def hold(self) -> None:
        """Nothing to do: the controller keeps its last setpoint."""

    def close(self) -> None:
        """Nothing to do: there is no bus here."""
