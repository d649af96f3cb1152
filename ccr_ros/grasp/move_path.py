# SPDX-License-Identifier: Apache-2.0
"""The pulls of all fingers along a planned motion, as a function of the way they have come."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ccr_ros.model.errors import InvalidValue

_SLACK = 1e-9  # m beyond a limit that rounding may be


@dataclass(frozen=True, eq=False)
class MovePath:
    """Pulls of every finger at waypoints, straight lines between them.

    Attributes:
        pulls: By finger (k, m) [m], a row per waypoint.
        reached: Whether the last waypoint is what was asked for.
        share: Of the way asked for that it has come.
        limiting: What kept it from going farther; empty if nothing did.

    Raises:
        InvalidValue: A pull is not finite, or the fingers have no or not as many waypoints.
    """

    pulls: Mapping[str, np.ndarray]
    reached: bool = True
    share: float = 1.0
    limiting: str = ""

    def __post_init__(self) -> None:
        counts = {len(rows) for rows in self.pulls.values()}
        if len(counts) != 1 or 0 in counts:
            raise InvalidValue("waypoints", sorted(counts), "as many for each finger, at least one")
        for name, rows in self.pulls.items():
            if not np.isfinite(rows).all():
                raise InvalidValue(f"waypoints.{name}", rows.tolist(), "finite pulls [m]")
        rows = np.hstack(list(self.pulls.values()))
        steps = np.abs(np.diff(rows, axis=0)).max(axis=1)
        object.__setattr__(self, "_ways", np.concatenate([[0.0], np.cumsum(steps)]))

    @property
    def ways(self) -> np.ndarray:
        """(k,) [m] to each waypoint: what the cable that moves most in each step has moved."""
        ways: np.ndarray = self.__dict__["_ways"]
        return ways

    @property
    def length(self) -> float:
        """Of the whole way [m]."""
        return float(self.ways[-1])

    def at(self, way: float) -> dict[str, np.ndarray]:
        """Return the pulls (m,) [m] by finger after a way [m]."""
        return {
            name: np.array([np.interp(way, self.ways, column) for column in rows.T])
            for name, rows in self.pulls.items()
        }

    def check_within(self, ranges: Mapping[str, np.ndarray]) -> None:
        """Check that no pull leaves its range, but for where it is outside at the beginning.

        Args:
            ranges: Lowest and highest pulls (m, 2) [m] by finger.

        Raises:
            InvalidValue: One does.
        """
        for name, rows in self.pulls.items():
            low = np.minimum(ranges[name][:, 0], rows[0]) - _SLACK
            high = np.maximum(ranges[name][:, 1], rows[0]) + _SLACK
            outside = (rows < low) | (rows > high)
            if outside.any():
                index = int(np.flatnonzero(outside.any(axis=1))[0])
                allowed = f"between {ranges[name][:, 0].tolist()} and {ranges[name][:, 1].tolist()}"
                raise InvalidValue(f"waypoints[{index}].{name}", rows[index].tolist(), allowed)
