# SPDX-License-Identifier: Apache-2.0
"""Finds where cables are just taut: winds one after the other until its tension rises."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from ccr_ros.model.errors import CcrError

from .axis import CableAxis

_LOW = 0.2  # share of the threshold below which a tension may be noise
_HIGH = 0.9  # share of the largest tension beyond which the servo may be turning


class CalibrationFailed(CcrError):
    """A zero could not be found; its text says of which joint, and why."""


@dataclass(frozen=True)
class CalibrationSettings:
    """How zeros are looked for.

    Attributes:
        rate: At which cable is wound [m/s]; slow, so that the finger follows at rest.
        threshold: Rise of the tension that says that the cable is taut [N].
        slack: Cable that is paid out beyond the point where the tension stops falling [m].
        search: Most cable that is paid out, and most that is wound [m].
    """

    rate: float = 0.004
    threshold: float = 0.3
    slack: float = 0.002
    search: float = 0.03


class _Phase(Enum):
    UNWIND = "pay out"
    WIND = "wind"
    UNLOAD = "pay out again"
    RETURN = "go to the zero"


class Calibrator:
    """Calibrates joints in turn.

    A cable is paid out until its tension falls no more (what is left is the zero of the effort),
    wound until the tension has risen by the threshold, and paid out again until it has fallen.
    Straight lines through rise and fall, carried on to the zero of the effort, give the place where
    the cable becomes taut, so that neither threshold nor stiffness shift it; the mean of the two
    rids it of friction and of efforts that are told late. The servo goes there.

    Args:
        axes: The joints to calibrate.
        settings: How.
    """

    def __init__(self, axes: Sequence[CableAxis], settings: CalibrationSettings) -> None:
        self._left = list(axes)
        self._settings = settings
        self.zeros: dict[str, float] = {}
        self._begin()

    @property
    def joint(self) -> str:
        """The joint whose turn it is; empty: done."""
        return self._left[0].joint.name if self._left else ""

    @property
    def done(self) -> bool:
        """Whether all zeros are found."""
        return not self._left

    def step(self, dt: float) -> None:
        """Move the joint whose turn it is for a time dt [s].

        Raises:
            CalibrationFailed: Its zero cannot be found.
        """
        if self.done:
            return
        axis = self._left[0]
        if not math.isfinite(axis.tension):
            raise CalibrationFailed(
                f"{self.joint}: the tension is not known, as the servo tells no effort"
            )
        self._samples.append((self._wound(axis), axis.raw_tension))
        getattr(self, f"_{self._phase.name.lower()}")(axis, self._settings.rate * dt)

    def _begin(self) -> None:
        self._phase = _Phase.UNWIND
        self._samples: list[tuple[float, float]] = []
        self._home = math.nan
        if self._left:
            self._start = self._left[0].setpoint / self._left[0].transmission.angle_per_pull

    def _wound(self, axis: CableAxis) -> float:
        """Return the length on the spool [m], from where the servo's angle is 0."""
        return axis.angle / axis.transmission.angle_per_pull

    def _move(self, axis: CableAxis, by: float) -> float:
        """Send the servo on by a length [m] and return how far it is from where it started [m]."""
        per_pull = axis.transmission.angle_per_pull
        axis.wind(axis.setpoint + by * per_pull)
        return axis.setpoint / per_pull - self._start

    def _unwind(self, axis: CableAxis, by: float) -> None:
        settings = self._settings
        wound, tensions = np.array(self._samples).T
        paid = (wound - wound[-1]) / settings.slack  # since then, in units of the slack
        last, before = tensions[np.abs(paid) <= 0.25], tensions[np.abs(paid - 1.125) <= 0.125]
        if len(before) and np.median(before) - np.median(last) < 0.1 * settings.threshold:
            self._ground = float(np.median(last))
            self._turn(axis, _Phase.WIND)
        elif -self._move(axis, -by) > settings.search:
            raise CalibrationFailed(
                f"{self.joint}: the tension still falls after {1e3 * settings.search:g} mm were "
                "paid out"
            )

    def _wind(self, axis: CableAxis, by: float) -> None:
        settings = self._settings
        if axis.tension - self._ground >= settings.threshold:
            self._taut_winding = self._taut(np.array(self._samples))
            self._turn(axis, _Phase.UNLOAD)
        elif self._move(axis, by) > settings.search:
            raise CalibrationFailed(
                f"{self.joint}: no tension after {1e3 * settings.search:g} mm were wound; is the "
                "cable broken or off its spool?"
            )

    def _unload(self, axis: CableAxis, by: float) -> None:
        settings = self._settings
        if axis.tension - self._ground < _LOW * settings.threshold:
            falling = self._taut(np.array(self._samples[::-1]))
            taut = 0.5 * (self._taut_winding + falling)
            self._home = taut * axis.transmission.angle_per_pull
            self._turn(axis, _Phase.RETURN)
        elif -self._move(axis, -by) > settings.search:
            raise CalibrationFailed(f"{self.joint}: the tension stays when cable is paid out")

    def _return(self, axis: CableAxis, by: float) -> None:
        per_pull = axis.transmission.angle_per_pull
        way = (self._home - axis.setpoint) / per_pull
        if abs(way) <= by:
            axis.wind(self._home)
            self.zeros[self.joint] = self._home
            del self._left[0]
            self._begin()
        else:
            axis.wind(axis.setpoint + math.copysign(by, way) * per_pull)

    def _turn(self, axis: CableAxis, phase: _Phase) -> None:
        self._phase = phase
        self._samples = []
        self._start = axis.setpoint / axis.transmission.angle_per_pull

    def _taut(self, samples: np.ndarray) -> float:
        """Return the wound length [m] where the tension leaves its ground.

        Args:
            samples: Wound lengths and tensions (k, 2) [m], [N], from slack to taut.
        """
        low_end, high_end = samples[:, 0].min(), samples[:, 0].max()
        top = int(np.argmax(samples[:, 1])) + 1  # beyond it the servo was turning
        wound, rise = samples[:top, 0], samples[:top, 1] - self._ground
        low = np.flatnonzero(rise < _LOW * self._settings.threshold)
        start = low[-1] + 1 if len(low) else 0
        used = np.arange(start, top)
        straight = used[rise[start:] < _HIGH * rise[-1]]
        used = straight if len(straight) > 2 else used
        wound, rise = wound[used], rise[used]
        if len(wound) < 2 or np.ptp(wound) < 1e-9:
            return float(wound[0])
        slope, _ = np.polyfit(wound, rise, 1)
        if slope <= 0.0:
            return float(wound[0])
        # Efforts that are told seldom make steps; a line along one of them leads anywhere.
        taut = wound.mean() - rise.mean() / slope
        return float(np.clip(taut, low_end - (high_end - low_end), high_end))
