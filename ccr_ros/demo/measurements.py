# SPDX-License-Identifier: Apache-2.0
"""What the demo measures: counts, rates and percentiles of what arrived; no ROS here."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field

import numpy as np


@dataclass
class _FingerCount:
    pulls: int = 0
    first_pulls: int | None = None  # stamps [ns] of pulls heard
    last_pulls: int = 0
    newest: int = 0  # stamp of the newest pose
    arrivals: list[int] = field(default_factory=list)  # [ns]
    latencies: list[int] = field(default_factory=list)  # [ns]
    solve_times: list[float] = field(default_factory=list)  # [s]
    waiting: list[int] = field(default_factory=list)  # stamps of pulls that await a pose [ns]
    stale: int = 0
    unstable: int = 0
    touching: frozenset[str] = frozenset()
    contacts: int = 0
    force: float = 0.0


class Measurements:
    """Counts what arrives about each finger, from its first pulls on.

    Stamps and arrivals are nanoseconds of the same clock; a pose bears the stamp of its pulls.
    """

    def __init__(self, fingers: Collection[str]) -> None:
        self._fingers = {name: _FingerCount() for name in fingers}
        self.markers = 0

    def add_pulls(self, finger: str, stamp: int) -> None:
        """Note pulls that were published at ``stamp`` [ns]."""
        count = self._fingers[finger]
        count.pulls += 1
        if stamp > count.newest:  # else its pose was heard before it
            count.waiting.append(stamp)
        if count.first_pulls is None:
            count.first_pulls = stamp
        count.last_pulls = max(count.last_pulls, stamp)

    def add_state(
        self,
        finger: str,
        stamp: int,
        arrival: int,
        *,
        solve_time: float,
        stable: bool = True,
        stale: bool = False,
        touching: Collection[str] = (),
        force: float = 0.0,
    ) -> None:
        """Note a state that has arrived.

        Args:
            finger: Its name.
            stamp: Of the pulls it is the answer to [ns].
            arrival: When it arrived [ns].
            solve_time: Of this pose [s].
            stable: What its certificate says.
            stale: Whether it is an old pose, sent again because newer pulls could not be solved.
            touching: Names of the obstacles the finger touches.
            force: Largest contact force.
        """
        count = self._fingers[finger]
        count.stale += stale
        if count.first_pulls is None or stamp < count.first_pulls or stamp <= count.newest:
            return  # the rest pose, or one that has been counted
        count.newest = stamp
        count.arrivals.append(arrival)
        count.latencies.append(arrival - stamp)
        count.solve_times.append(solve_time)
        count.waiting = [pulls for pulls in count.waiting if pulls > stamp]
        count.unstable += not stable
        count.contacts += len(set(touching) - count.touching)
        count.touching = frozenset(touching)
        count.force = max(count.force, force)

    @property
    def caught_up(self) -> bool:
        """Whether the newest pulls of every finger have been answered by a pose."""
        return all(c.newest >= c.last_pulls for c in self._fingers.values())

    @property
    def unanswered(self) -> list[str]:
        """Fingers of which no pose has come yet that answers pulls."""
        return [name for name, count in self._fingers.items() if not count.arrivals]

    def report(self) -> Report:
        """Sum up.

        At least one pose must have come (see `unanswered`).
        """
        counts = [c for c in self._fingers.values() if c.arrivals]
        latencies = np.concatenate([c.latencies for c in counts]) * 1e-9
        solve_times = np.concatenate([c.solve_times for c in counts])
        spans = [(len(c.arrivals) - 1, (c.arrivals[-1] - c.arrivals[0]) * 1e-9) for c in counts]
        return Report(
            pulls=sum(c.pulls for c in self._fingers.values()),
            poses=sum(len(c.arrivals) for c in counts),
            lost=sum(len(c.waiting) for c in self._fingers.values()),
            rate=float(np.mean([n / span if span > 0 else 0.0 for n, span in spans])),
            latency=(_percentile(latencies, 50), _percentile(latencies, 99)),
            solve_time=(_percentile(solve_times, 50), _percentile(solve_times, 99)),
            contacts=sum(c.contacts for c in counts),
            force=max(c.force for c in counts),
            stale=sum(c.stale for c in counts),
            unstable=sum(c.unstable for c in counts),
            markers=self.markers,
        )


@dataclass(frozen=True)
class Report:
    """What was measured in a run.

    Attributes:
        pulls: Messages of measured pulls that were heard, all fingers together.
        poses: Poses that arrived, each the answer to one of these.
        lost: Pulls that no pose answered, neither theirs nor that of newer ones.
        rate: Poses per second of a finger [Hz].
        latency: Median and 99th percentile from pulls published to pose received [s].
        solve_time: Median and 99th percentile of the solves behind these poses [s].
        contacts: How often a finger came to touch an object.
        force: Largest contact force.
        stale: States that said that the newest pulls could not be solved.
        unstable: Poses that are no minimum of energy.
        markers: Marker messages that arrived.
    """

    pulls: int
    poses: int
    lost: int
    rate: float
    latency: tuple[float, float]
    solve_time: tuple[float, float]
    contacts: int
    force: float
    stale: int
    unstable: int
    markers: int

    @property
    def superseded(self) -> int:
        """Pulls that were not solved as newer ones, or the same again, came first."""
        return max(0, self.pulls - self.poses - self.lost)

    def lines(self, force_unit: str) -> list[str]:
        """Return the report as lines for people."""
        fate = f"{self.poses} answered by a pose, {self.superseded} superseded by newer ones"
        if self.lost:
            fate += f", {self.lost} not answered"
        contacts = f"{self.contacts} made"
        if self.contacts:
            contacts += f", up to {self.force:.3g} {force_unit}"
        if self.stale or self.unstable:
            verdict = f"{self.stale} times not solved, {self.unstable} poses not stable"
        else:
            verdict = "every pose converged and stable"
        rows = (
            ("pulls", f"{self.pulls} measured; {fate}"),
            ("poses", f"{self.rate:.1f} per second and finger; {verdict}"),
            ("latency", f"{_ms(self.latency)}, pulls published to pose received"),
            ("solve time", _ms(self.solve_time)),
            ("contacts", contacts),
            ("markers", f"{self.markers} messages"),
        )
        return [f"{name:<12}{text}" for name, text in rows]


def _percentile(values: np.ndarray, percent: float) -> float:
    return float(np.percentile(values, percent))


def _ms(times: tuple[float, float]) -> str:
    return f"median {times[0] * 1e3:.2f} ms, 99th percentile {times[1] * 1e3:.2f} ms"
