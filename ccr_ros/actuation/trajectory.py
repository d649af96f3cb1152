# SPDX-License-Identifier: Apache-2.0
"""Setpoints on their way to a target within a rate and an acceleration."""

from __future__ import annotations

import math

_NEAR = 1e-12  # what is nearer is there


class Trajectory:
    """The time-optimal way of a double integrator to rest at a target, sampled.

    The motion is solved anew at every step from where it is (position and velocity), in closed
    form: accelerate, cruise, decelerate. So the target may change at any time, steps may be uneven,
    both limits hold at every instant, and a target that can be stopped at is never overshot.

    Args:
        max_rate: Largest velocity, either way.
        max_acceleration: Largest acceleration, either way.
        position: Where it is, at rest.
    """

    def __init__(self, max_rate: float, max_acceleration: float, position: float = 0.0) -> None:
        self._rate = max_rate
        self._acceleration = max_acceleration
        self.position = self.target = position
        self.velocity = 0.0

    @property
    def done(self) -> bool:
        """Whether it rests at the target."""
        return self.position == self.target and self.velocity == 0.0

    def reset(self, position: float) -> None:
        """Be at rest at a position, which becomes the target."""
        self.position = self.target = position
        self.velocity = 0.0

    def brake(self) -> None:
        """Make the target the place where it can come to rest soonest."""
        self.target = self.position + self._stopping_distance()

    def step(self, dt: float) -> float:
        """Go on for a time dt >= 0 and return the position."""
        a, v, way = self._acceleration, self.velocity, self.target - self.position
        if v == 0.0 and abs(way) < _NEAR:
            self.reset(self.target)
            return self.position
        ahead = way - self._stopping_distance()
        # Which way to accelerate first. Where braking leads right to the target, rounding must not
        # decide for a last swing to and fro: the way to go is then the one in which it moves.
        settled = abs(ahead) <= 1e-12 * max(abs(way), abs(self.position), abs(self.target))
        sign = math.copysign(1.0, v if settled and v else ahead)
        peak = min(self._rate, math.sqrt(max(0.0, a * sign * way + 0.5 * v * v)))
        peak = max(peak, sign * v)  # rounding again
        speeding = (peak - sign * v) / a
        braking = peak / a
        cruise = sign * way - (peak**2 - v**2) / (2 * a) - peak**2 / (2 * a)
        cruising = max(0.0, cruise / peak) if peak > 0.0 else 0.0

        if dt >= speeding + cruising + braking:
            self.reset(self.target)
            return self.position
        if dt <= speeding:
            moved, speed = sign * v * dt + 0.5 * a * dt * dt, sign * v + a * dt
        elif dt <= speeding + cruising:
            moved = (peak**2 - v**2) / (2 * a) + peak * (dt - speeding)
            speed = peak
        else:
            left = speeding + cruising + braking - dt
            moved, speed = sign * way - 0.5 * a * left * left, a * left
        if sign * v >= 0.0:  # else it has to come back first, from beyond the target perhaps
            moved = min(moved, sign * way)
        self.position += sign * moved
        self.velocity = sign * speed
        return self.position

    def _stopping_distance(self) -> float:
        return self.velocity * abs(self.velocity) / (2 * self._acceleration)
