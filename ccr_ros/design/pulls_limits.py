# SPDX-License-Identifier: Apache-2.0
"""What the cables of a finger may be asked for: tensions and pulls within limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np

from ccr_ros.model import checks
from ccr_ros.model.errors import InvalidValue, UnknownName
from ccr_ros.model.finger import Finger

#: By cable name (a cable not named has no limit), or one for each cable in order.
PerCable = Mapping[str, float] | Sequence[float] | np.ndarray


@dataclass(frozen=True, eq=False)
class PullLimits:
    """Limits of the m cables; a tension is never negative, whatever the limits.

    Attributes:
        tension: (m,) largest tensions [N, or 1/m^2 per EI]; inf: none.
        low, high: (m,) least and largest pulls [m], -inf and inf: none. The rest pull, 0, is
            within them.
    """

    tension: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @classmethod
    def of(
        cls,
        finger: Finger,
        tension: PerCable | None = None,
        low: PerCable | None = None,
        high: PerCable | None = None,
    ) -> PullLimits:
        """Return checked limits of a finger.

        Raises:
            UnknownName: A cable that the finger has not.
            InvalidValue: Wrong count, a NaN, a tension limit that is not positive, or limits of
                pulls that leave out 0.
        """
        return cls(
            _per_cable(finger, "limits.tension", tension, math.inf, "> 0"),
            _per_cable(finger, "limits.low", low, -math.inf, "<= 0"),
            _per_cable(finger, "limits.high", high, math.inf, ">= 0"),
        )


_ALLOWED: dict[str, Callable[[float], bool]] = {
    "> 0": lambda number: number > 0,
    "<= 0": lambda number: number <= 0,
    ">= 0": lambda number: number >= 0,
}


def _per_cable(
    finger: Finger, place: str, given: PerCable | None, absent: float, allowed: str
) -> np.ndarray:
    names = finger.cable_names
    if given is None:
        values: list[Any] = [absent] * len(names)
    elif isinstance(given, Mapping):
        for key in given:
            if key not in names:
                raise UnknownName("cable", key, names)
        values = [given.get(name, absent) for name in names]
    elif checks.is_list(given) and len(given) == len(names):
        values = list(given)
    else:
        raise InvalidValue(place, given, f"{len(names)} numbers, one per cable")
    for name, value in zip(names, values, strict=True):
        number = isinstance(value, Real) and not isinstance(value, bool)
        if not number or not _ALLOWED[allowed](float(value)):  # which a NaN fails
            raise InvalidValue(f"{place}.{name}", value, f"a number {allowed}")
    limits = np.array([float(value) for value in values])
    limits.setflags(write=False)
    return limits
