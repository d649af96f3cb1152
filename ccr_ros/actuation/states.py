# SPDX-License-Identifier: Apache-2.0
"""States of the servo bridge, its settings, and what it answers to what it cannot do."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum

from ccr_ros.model.errors import CcrError

from .calibrator import CalibrationSettings


class BridgeState(IntEnum):
    """States of the bridge, numbered as in ServoState.msg."""

    UNCONFIGURED = 0
    INACTIVE = 1
    ACTIVE = 2
    CALIBRATING = 3
    STOPPED = 4
    FAULT = 5


class Refused(CcrError):
    """What was asked for cannot be done in the state the bridge is in; its text says why."""


@dataclass(frozen=True)
class BridgeSettings:
    """How the bridge behaves.

    Attributes:
        command_timeout: A command older than this does not count any more [s].
        bus_timeout: How long servos may not answer before that is a fault [s].
        stall_time: How long a servo may make no progress [s].
        tension_filter: Time constant of the low-pass filter on tensions [s].
        calibration: How zeros are looked for.
    """

    command_timeout: float = 0.5
    bus_timeout: float = 0.2
    stall_time: float = 0.5
    tension_filter: float = 0.05
    calibration: CalibrationSettings = field(default_factory=CalibrationSettings)
