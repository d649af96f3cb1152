# SPDX-License-Identifier: Apache-2.0
"""One cable and its servo: what is measured, where it shall go, where it is sent."""

from __future__ import annotations

import math

from ccr_ros.model.errors import InvalidValue

from .driver import DriverError, ServoReading
from .faults import Fault, FaultCode, Limits, StallWatch
from .rack import ServoJoint
from .trajectory import Trajectory
from .transmission import Transmission


class CableAxis:
    """Leads one servo: follows pulls, or holds an angle.

    While it follows, the setpoint is a pull on its way to the command, and the servo's angle makes
    up for the stretch of the cable under the measured tension. While it holds, the angle stays.

    Args:
        joint: The servo and its spool.
        zero: The servo's angle where the cable is just taut [rad]; NaN: not known.
        stall_time: How long a servo may make no progress [s].
        tension_filter: Time constant of the low-pass filter on the tension [s].
    """

    def __init__(
        self, joint: ServoJoint, zero: float, stall_time: float, tension_filter: float
    ) -> None:
        self.joint = joint
        self.transmission = Transmission(joint, zero)
        self.angle = self.velocity = self.torque = math.nan  # measured: rad, rad/s, N m
        self.tension = self.raw_tension = math.nan  # N, the first one filtered
        self.temperature = math.nan  # degC
        self.setpoint = math.nan  # rad, where the servo is sent
        self.command: float | None = None  # m, the newest that counts
        self._error = ""
        self._following = False
        self._stale = False
        self._trajectory = Trajectory(joint.max_rate, joint.max_acceleration)
        self._limits = Limits(joint)
        self._stall = StallWatch(joint.tolerance, stall_time)
        self._filter = tension_filter

    @property
    def calibrated(self) -> bool:
        """Whether the zero is known."""
        return math.isfinite(self.transmission.zero)

    @property
    def pull(self) -> float:
        """The measured pull [m]; NaN: not known."""
        return self.transmission.pull(self.angle, self.tension)

    @property
    def pull_setpoint(self) -> float:
        """The pull it is sent to now [m]; NaN: not known."""
        if self._following:
            return self._trajectory.position
        return self.transmission.pull(self.setpoint, self.tension)

    @property
    def moving(self) -> bool:
        """Whether the setpoint is on its way."""
        return self._following and not self._trajectory.done

    @property
    def stale(self) -> bool:
        """Whether it holds for want of fresh commands."""
        return self._stale

    # Measuring

    def measure(self, reading: ServoReading, index: int, dt: float) -> None:
        """Take what the servo at this place says, a time dt [s] after the last."""
        self.angle, self.velocity = float(reading.angles[index]), float(reading.velocities[index])
        self.temperature = float(reading.temperatures[index])
        self.torque = float(reading.efforts[index])
        self._error = reading.errors[index]
        self.raw_tension = self.transmission.tension(self.torque)
        if math.isfinite(self.tension) and math.isfinite(self.raw_tension):
            share = -math.expm1(-dt / self._filter) if self._filter > 0.0 else 1.0
            self.tension += share * (self.raw_tension - self.tension)
        else:
            self.tension = self.raw_tension

    def check_limits(self) -> Fault | None:
        """Return a tension or a measured pull beyond its limit."""
        return self._limits.check(self.pull, self.tension)

    def check_tension(self) -> Fault | None:
        """Return a tension beyond its limit, wherever the cable is."""
        return self._limits.check(math.nan, self.tension)

    def check_progress(self, now: float) -> Fault | None:
        """Return a stall, if the servo is in one."""
        per_pull = self.transmission.angle_per_pull
        setpoint, measured = self.setpoint / per_pull, self.angle / per_pull
        if not self._stall.stalled(setpoint, measured, now):
            return None
        reason = f"no progress, {1e3 * (setpoint - measured):.3g} mm of cable from its setpoint"
        return Fault(FaultCode.STALL, self.joint.name, reason)

    def check_servo(self) -> Fault | None:
        """Return what is wrong with the servo itself: temperature or an error of its own."""
        return self._limits.check_servo(self.temperature, self._error)

    # Leading

    def checked(self, pull: float) -> float:
        """Return a wanted pull [m] that may be commanded.

        Raises:
            InvalidValue: It is not finite, or beyond the travel.
            DriverError: The zero is not known.
        """
        low, high = self.joint.travel
        place = f"pulls.{self.joint.cable}"
        if not (math.isfinite(pull) and low <= pull <= high):
            raise InvalidValue(place, pull, f"a finite number in the travel {low:g}..{high:g} [m]")
        if not self.calibrated:
            raise DriverError(f"the zero of {self.joint.name} is not known; calibrate it first")
        return float(pull)

    def adopt(self, angle: float) -> None:
        """Hold at an angle [rad], at which the servo is sent already."""
        self.setpoint = angle
        self._forget()

    def follow(self, pull: float) -> None:
        """Go to a pull [m] (see `checked`), starting where the servo is sent now."""
        if not self._following:
            self._trajectory.reset(self.pull_setpoint)
            self._following = True
        self.command, self._stale = pull, False

    def freeze(self, ease: bool = False) -> None:
        """Stop at once and hold.

        A setpoint that runs ahead of the servo comes back to within the tolerance; within it, the
        lead is what holds against the load, and stays.

        Args:
            ease: Leave no lead that pulls at the cable.
        """
        self._forget()
        per_pull = self.transmission.angle_per_pull
        lead = (self.setpoint - self.angle) / per_pull
        if math.isfinite(lead):
            most = 0.0 if ease else self.joint.tolerance
            kept = min(max(lead, -self.joint.tolerance), most)
            if kept != lead:
                self.setpoint = self.angle + kept * per_pull

    def resume(self) -> None:
        """Bear what is beyond its limits now, as it is known, and watch from here on."""
        self._limits.accept(self.pull, self.tension)
        self._stall.reset()

    def expire(self) -> None:
        """Slow down and hold: commands have stopped coming."""
        if self._following and not self._stale:
            self._stale = True

    def advance(self, dt: float) -> None:
        """Let the setpoint go on for a time dt [s]."""
        if not self._following or self.command is None:
            return
        trajectory = self._trajectory
        if self._stale:
            if trajectory.velocity:
                trajectory.brake()
            else:
                trajectory.reset(trajectory.position)
        elif self._limits.strained(self.tension):
            trajectory.target = min(self.command, trajectory.position)
        else:
            trajectory.target = self.command
        self.setpoint = self.transmission.angle(trajectory.step(dt), self.tension)
        if self._stale and trajectory.done:
            self._following = False

    def wind(self, angle: float) -> None:
        """Send the servo to an angle [rad], whatever the pull: for calibration."""
        self.setpoint = angle

    def set_zero(self, zero: float) -> None:
        """Let another angle [rad] be where the cable is just taut; nothing moves."""
        self.transmission = Transmission(self.joint, zero)

    def _forget(self) -> None:
        self.command, self._following, self._stale = None, False, False
        self._stall.reset()
