# SPDX-License-Identifier: Apache-2.0
"""Racks for the tests: two servos, and a bridge over simulated ones."""

from __future__ import annotations

import math
from pathlib import Path

from ccr_ros.actuation.bridge import ServoBridge
from ccr_ros.actuation.calibrator import CalibrationSettings
from ccr_ros.actuation.drivers.loopback import LoopbackDriver, LoopbackSettings
from ccr_ros.actuation.rack import ServoJoint, ServoRack
from ccr_ros.actuation.states import BridgeSettings
from ccr_ros.actuation.zeros import load_zeros, save_zeros

PERIOD = 0.02  # s


def joint(finger="thumb", cable="main", **values) -> ServoJoint:
    standard = {
        "spool_radius": 0.01,
        "travel": (-0.002, 0.012),
        "max_rate": 0.02,
        "max_acceleration": 0.1,
        "max_tension": 10.0,
    }
    return ServoJoint(finger=finger, cable=cable, **{**standard, **values})


def rack(**values) -> ServoRack:
    """Two joints; the second winds the other way, through a gear, with a stretchy cable."""
    other = {"direction": -1, "gear": 2.0, "cable_stiffness": 5e3, **values}
    return ServoRack("pair", (joint(**values), joint("index", **other)))


class Bench:
    """A bridge over simulated servos, and the time that passes for both."""

    def __init__(
        self,
        settings: BridgeSettings | None = None,
        servos: LoopbackSettings | None = None,
        true_zeros: tuple[float, ...] | None = None,
        zeros: dict[str, float] | None = None,
        store: Path | None = None,
        of: ServoRack | None = None,
    ) -> None:
        self.now = 100.0
        self.servos = servos or LoopbackSettings(spring=400.0)
        self.rack = of or rack()
        self.driver = LoopbackDriver(self.rack, self.servos, true_zeros=true_zeros)
        self.driver.open()
        self.stored: list[dict[str, float]] = []

        def keep(found: dict[str, float]) -> None:
            if store is not None:
                save_zeros(store, self.rack, "loopback", found)
            self.stored.append(found)

        if zeros is None:
            known = self.driver.own_zeros or (math.nan,) * len(self.rack.joints)
            zeros = dict(zip(self.rack.names, known, strict=True))
        if store is not None:
            zeros = {**zeros, **load_zeros(store, self.rack, "loopback")}
        quick = CalibrationSettings(rate=0.02)
        self.bridge = ServoBridge(
            self.driver, settings or BridgeSettings(calibration=quick), zeros, keep
        )

    def active(self) -> Bench:
        """Activate and return itself."""
        self.bridge.cycle(self.now)
        self.bridge.activate(self.now)
        return self

    def run(self, seconds: float, **pulls: float) -> None:
        """Let time pass; pulls of fingers are commanded again and again."""
        for _ in range(round(seconds / PERIOD)):
            self.step(**pulls)

    def step(self, **pulls: float) -> None:
        if pulls:
            self.command(**pulls)
        self.now += PERIOD
        self.bridge.cycle(self.now)

    def command(self, **pulls: float) -> None:
        places = {self.rack.index(f"{finger}_main"): pull for finger, pull in pulls.items()}
        self.bridge.command(places, self.now, self.now)

    def until(self, condition, seconds: float = 60.0, **pulls: float):
        """Let time pass until the condition is true and return its value."""
        end = self.now + seconds
        while not (value := condition()):
            assert self.now < end, "did not come"
            self.step(**pulls)
        return value

    @property
    def pulls(self) -> list[float]:
        return [axis.pull for axis in self.bridge.axes]
