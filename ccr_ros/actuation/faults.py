# SPDX-License-Identifier: Apache-2.0
"""What makes a rack hold until somebody has looked: the kinds of faults, and a joint's watch."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from .rack import ServoJoint

_BEARABLE = 1.1  # of what was there at a reset


class FaultCode(IntEnum):
    """Kinds of faults, numbered as in ServoState.msg."""

    NO_FAULT = 0
    OVER_TENSION = 1
    OVER_TRAVEL = 2
    STALL = 3
    TEMPERATURE = 4
    BUS_LOST = 5
    SERVO_ERROR = 6


@dataclass(frozen=True)
class Fault:
    """One fault: its kind, the joint it is of (empty: all), and what happened, in words."""

    code: FaultCode
    joint: str
    reason: str


class StallWatch:
    """Tells a servo that does not come nearer to its setpoint.

    By progress, not by velocity, which noise keeps from zero: as long as the servo is farther from
    its setpoint than the tolerance, it has to move towards it by half the tolerance within every
    ``patience``.

    Args:
        tolerance: [m]
        patience: [s]
    """

    def __init__(self, tolerance: float, patience: float) -> None:
        self._tolerance = tolerance
        self._patience = patience
        self._since: float | None = None  # when it was last seen to get on
        self._place = 0.0

    def reset(self) -> None:
        """Forget what was seen."""
        self._since = None

    def stalled(self, setpoint: float, measured: float, now: float) -> bool:
        """Tell whether the servo stalls: where it should be and is [m], at a time [s]."""
        way = setpoint - measured
        if not abs(way) > self._tolerance:
            self._since = None
            return False
        progress = (measured - self._place) * (1.0 if way > 0.0 else -1.0)
        if self._since is None or now < self._since or progress > 0.5 * self._tolerance:
            self._since, self._place = now, measured
            return False
        return now - self._since > self._patience


class Limits:
    """Watches tension and travel of one joint, and its servo.

    After a reset a tension or a travel that is still beyond its limit is borne as long as it does
    not grow: otherwise nobody could lead the cable back.
    """

    def __init__(self, joint: ServoJoint) -> None:
        self._joint = joint
        self._bearable_tension = joint.max_tension  # N
        self._bearable_excess = 0.0  # m beyond the travel

    def accept(self, pull: float, tension: float) -> None:
        """Bear a pull [m] and a tension [N] beyond their limits; they may not grow by a tenth."""
        self._bearable_tension = max(self._joint.max_tension, _BEARABLE * tension)
        self._bearable_excess = _BEARABLE * self.excess(pull)

    def excess(self, pull: float) -> float:
        """Return how far a pull is beyond the travel and its tolerance [m]; NaN: not known."""
        low, high = self._joint.travel
        margin = self._joint.tolerance
        return max(low - margin - pull, pull - high - margin, 0.0)

    def strained(self, tension: float) -> bool:
        """Tell whether a tension [N] is such that the cable may only be paid out."""
        return tension > self._joint.max_tension

    def check(self, pull: float, tension: float) -> Fault | None:
        """Return the limit that a pull [m] or a tension [N] is beyond; NaN is beyond nothing."""
        joint, excess = self._joint, self.excess(pull)
        if tension > self._bearable_tension:
            reason = f"tension {tension:.3g} N, limit {joint.max_tension:g} N"
            return Fault(FaultCode.OVER_TENSION, joint.name, reason)
        if excess > self._bearable_excess:
            low, high = (1e3 * limit for limit in joint.travel)
            reason = f"pull {1e3 * pull:.4g} mm, travel {low:g}..{high:g} mm"
            return Fault(FaultCode.OVER_TRAVEL, joint.name, reason)
        bearable = min(self._bearable_tension, _BEARABLE * tension)
        self._bearable_tension = max(joint.max_tension, bearable)
        self._bearable_excess = min(self._bearable_excess, _BEARABLE * excess)
        return None

    def check_servo(self, temperature: float, error: str) -> Fault | None:
        """Return what is wrong with the servo: its temperature [degC], or an error of its own."""
        joint = self._joint
        if error:
            return Fault(FaultCode.SERVO_ERROR, joint.name, error)
        if temperature > joint.max_temperature:
            reason = f"{temperature:.3g} degC, limit {joint.max_temperature:g} degC"
            return Fault(FaultCode.TEMPERATURE, joint.name, reason)
        return None
