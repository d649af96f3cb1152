# SPDX-License-Identifier: Apache-2.0
"""A simulated servo rack: lag, rate limit, backlash, noise, and faults on demand."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ccr_ros.model import checks
from ccr_ros.model.errors import InvalidFile
from ccr_ros.model.file_checks import mapping
from ccr_ros.model.yaml_reader import read_mapping

from ..driver import BusLost, ServoDriver, ServoReading
from ..rack import ServoRack
from ..transmission import Transmission

_AMBIENT = 25.0  # degC
_LONGEST_STEP = 0.5  # s of simulated motion per read, however late it comes


@dataclass
class LoopbackSettings:
    """How the simulated servos behave; may change while they run.

    Attributes:
        time_constant: Of the servo's first-order approach to its setpoint [s].
        max_speed: Largest angular velocity [rad/s].
        backlash: Play between motor and spool [rad].
        noise: Standard deviation of measured angles [rad].
        effort_noise: Standard deviation of measured efforts [N m].
        dropout: The bus is dead: neither reads nor writes get through; the servos hold.
        stalled: Names of joints that do not move.
        temperature: Of all servos [degC].
        spring: Stiffness [N/m] of springs that stand in for fingers: they pull at the cables from
            the true zeros on. 0: tensions are those that `set_tensions` was told.
    """

    time_constant: float = 0.05
    max_speed: float = 10.0
    backlash: float = 0.0
    noise: float = 0.0
    effort_noise: float = 0.0
    dropout: bool = False
    stalled: tuple[str, ...] = ()
    temperature: float = _AMBIENT
    spring: float = 0.0


class LoopbackDriver(ServoDriver):
    """Simulates the servos in this process, from the times at which they are read.

    Args:
        rack: The servos.
        settings: How they behave.
        seed: Of the noise, which is the same for the same reads.
        true_zeros: Angles [rad] at which the cables are just taut. Without, the servos start with
            their cables taut, and tell that they know their zeros.
        state_file: Where the servos keep their angles, as real ones keep theirs when the program
            that moves them ends or dies.
    """

    name = "loopback"

    def __init__(
        self,
        rack: ServoRack,
        settings: LoopbackSettings | None = None,
        seed: int = 0,
        true_zeros: Sequence[float] | None = None,
        state_file: str | Path | None = None,
    ) -> None:
        super().__init__(rack)
        self.settings = settings or LoopbackSettings()
        count = len(rack.joints)
        if true_zeros is None:
            self.own_zeros = (0.0,) * count
        self._transmissions = [
            Transmission(joint, zero)
            for joint, zero in zip(rack.joints, true_zeros or (0.0,) * count, strict=True)
        ]
        self._random = np.random.default_rng(seed)
        self._state_file = Path(state_file).expanduser() if state_file else None
        self._motors = np.zeros(count)
        self._spools = np.zeros(count)
        self._setpoints = np.zeros(count)
        self._velocities = np.zeros(count)
        self._tensions = np.full(count, math.nan)
        self._now: float | None = None

    def open(self) -> None:
        """Put the servos where they were left; see `state_file`.

        Raises:
            InvalidFile, InvalidValue: The state file is not one of these servos.
        """
        if self._state_file is not None and self._state_file.exists():
            kept = mapping(read_mapping(self._state_file), set(self.rack.names), set())
            for index, name in enumerate(self.rack.names):
                angles = checks.vector(name, kept[name], 3, unit="rad")
                self._motors[index], self._spools[index], self._setpoints[index] = angles
        self._keep()

    def set_tensions(self, tensions: Mapping[int, float]) -> None:
        """Tell the tensions of cables [N], by place of the joint; NaN: not known."""
        for index, tension in tensions.items():
            self._tensions[index] = tension

    def read(self, now: float) -> ServoReading:
        """Move the servos up to a time and return what they measure."""
        self._move(now)
        if self.settings.dropout:
            raise BusLost("the simulated bus is dead (loopback.dropout)")
        count = len(self.rack.joints)
        pairs = zip(self._transmissions, self.tensions, strict=True)
        torques = np.array([transmission.torque(tension) for transmission, tension in pairs])
        noise = self._random.standard_normal((2, count))
        return ServoReading(
            angles=self._spools + self.settings.noise * noise[0],
            velocities=self._velocities.copy(),
            efforts=torques + self.settings.effort_noise * noise[1],
            temperatures=np.full(count, self.settings.temperature),
            errors=("",) * count,
        )

    def write(self, angles: Sequence[float]) -> None:
        """Set the setpoints, unless the bus is dead."""
        if self.settings.dropout:
            raise BusLost("the simulated bus is dead (loopback.dropout)")
        self._setpoints[:] = angles

    def enable(self, now: float) -> tuple[float, ...]:
        """Return the setpoints, which simulated servos follow always."""
        self.read(now)
        return tuple(self._setpoints.tolist())

    def hold(self) -> None:
        """Keep the angles in the state file."""
        self._keep()

    def close(self) -> None:
        """Keep the angles in the state file."""
        self._keep()

    @property
    def tensions(self) -> list[float]:
        """True tensions of the cables [N]; NaN: not known."""
        stiffness = self.settings.spring
        if not stiffness:
            return self._tensions.tolist()
        tensions = []
        for transmission, spool in zip(self._transmissions, self._spools, strict=True):
            joint = transmission.joint
            wound = transmission.pull(spool, 0.0) - joint.offset
            # The spring and the cable's own are in series.
            both = stiffness / (1.0 + stiffness / joint.cable_stiffness)
            tensions.append(max(0.0, both * wound))
        return tensions

    def _move(self, now: float) -> None:
        dt = 0.0 if self._now is None else min(max(now - self._now, 0.0), _LONGEST_STEP)
        self._now = now
        if dt == 0.0:
            return
        settings = self.settings
        wanted = (self._setpoints - self._motors) * -math.expm1(-dt / settings.time_constant)
        most = settings.max_speed * dt
        moved = np.clip(wanted, -most, most)
        moved[[name in settings.stalled for name in self.rack.names]] = 0.0
        self._motors += moved
        play = settings.backlash / 2
        before = self._spools.copy()
        np.clip(self._spools, self._motors - play, self._motors + play, out=self._spools)
        self._velocities = (self._spools - before) / dt
        if np.any(np.abs(moved) > 1e-9):
            try:
                self._keep()
            except InvalidFile as error:  # servos that cannot keep their place are out of order
                raise BusLost(str(error)) from None

    def _keep(self) -> None:
        if self._state_file is None:
            return
        table = np.stack([self._motors, self._spools, self._setpoints], axis=1).tolist()
        lines = [f"{name}: {row}\n" for name, row in zip(self.rack.names, table, strict=True)]
        temporary = self._state_file.with_name(self._state_file.name + ".tmp")
        try:
            self._state_file.parent.mkdir(parents=True, exist_ok=True)
            temporary.write_text("".join(lines), encoding="utf-8")
            temporary.replace(self._state_file)
        except OSError as error:
            raise InvalidFile(self._state_file, f"cannot be written: {error.strerror}") from None
