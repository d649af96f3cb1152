# SPDX-License-Identifier: Apache-2.0
"""The straight way of a finger's pulls from open to closed, and places on it in metres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ccr_ros.model import Finger, InvalidValue

# Contact of the gripper that comes with this package begins at 2.9 % of the finger's length, and
# its poses are stable up to 3.45 %.
CLOSED_FRACTION = 0.034


@dataclass(frozen=True, eq=False)
class PullPath:
    """Pulls of all cables of a finger as a function of one place in [0, length].

    Attributes:
        open: Pulls (m,) [m] at 0.
        closed: Pulls (m,) [m] at ``length``, beyond which the finger is never pulled.
    """

    open: np.ndarray
    closed: np.ndarray

    @property
    def length(self) -> float:
        """Pull of the cable that moves most on the way [m]; one metre of way is one metre of it."""
        return float(np.abs(self.closed - self.open).max())

    def pulls(self, place: float) -> np.ndarray:
        """Return the pulls (m,) [m] at a place [m]."""
        return self.open + place / self.length * (self.closed - self.open)

    def place(self, pulls: np.ndarray) -> float:
        """Return the place [m] nearest to pulls (m,) [m]; it may lie beyond both ends."""
        way = self.closed - self.open
        return float(way @ (pulls - self.open) / (way @ way) * self.length)


def pull_path(
    finger: Finger, open_pulls: Sequence[float] | None, closed_pulls: Sequence[float] | None
) -> PullPath:
    """Return the path of a finger, from what its parameters say.

    Args:
        finger: The finger.
        open_pulls: One pull per cable [m]; nothing: all 0, the rest shape.
        closed_pulls: One pull per cable [m]; nothing: 3.4 % of the length of a finger with one
            cable.

    Raises:
        InvalidValue: A count that does not fit, a pull out of range, the same pulls twice, or no
            closed pulls for a finger of several cables; the place is the parameter's name.
    """
    name, count = finger.name, len(finger.cables)
    if not closed_pulls and count > 1:
        raise InvalidValue(
            f"{name}.closed_pulls",
            closed_pulls,
            f"{count} pulls [m], one per cable: how the finger's cables close it together",
        )
    start = _pulls(finger, "open_pulls", open_pulls or [0.0] * count)
    end = _pulls(finger, "closed_pulls", closed_pulls or [CLOSED_FRACTION * finger.length])
    if np.abs(end - start).max() < 1e-6 * finger.length:
        raise InvalidValue(f"{name}.closed_pulls", end, "unlike open_pulls")
    return PullPath(start, end)


def _pulls(finger: Finger, key: str, values: Any) -> np.ndarray:
    try:
        return finger.pulls_array(list(values))
    except InvalidValue as error:
        inner = error.place.removeprefix("pulls")
        raise InvalidValue(f"{finger.name}.{key}{inner}", error.value, error.allowed) from None
