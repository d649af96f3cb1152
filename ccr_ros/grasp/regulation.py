# SPDX-License-Identifier: Apache-2.0
"""Keeps a contact force at its target by slow integral control of the pull."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ForceLaw:
    """d(place)/dt = gain (target - force), limited.

    While a finger touches, its force follows its pull like a spring, F = k (place - touch), after
    a lag and a delay of servo and solver that are T seconds together. As the phase lost at a
    frequency w is at most w T, and the loop's gain is 1 at w <= gain k, the loop is stable while
    gain k T < pi/2, and well damped (60 deg of phase in hand) while gain k T < 1/2. The sphere
    gripper has k = 720 N/m: with the default gain T may be 0.23 s.

    `Grip.regulate` takes one step for each pose that is solved, which counts for 0.1 s at most.
    However slow the solver is, its delay is then d such steps, and the loop is stable while
    gain k 0.1 s < 2 sin(pi / (2 (2 d + 1))): with the defaults for a delay of up to 6 poses.

    Attributes:
        gain: [m/(N s)]
        max_rate: Fastest motion [m/s].
        dead_band: Differences no larger are let be [N], so that noise moves no servo.
    """

    gain: float
    max_rate: float
    dead_band: float = 0.0

    def step(self, force: float, target: float, seconds: float) -> float:
        """Return how far the place shall move [m] within a time [s]; forces are in newtons."""
        error = target - force
        if abs(error) <= self.dead_band:
            return 0.0
        rate = min(max(self.gain * error, -self.max_rate), self.max_rate)
        return rate * seconds
