# SPDX-License-Identifier: Apache-2.0
"""Checks of a finger's rest curvature: constant along segments, or linear along their pieces."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import checks
from .errors import InvalidValue

MAX_PIECES = 8  # of a segment, along which the rest curvature is linear
_PLACE = "rest_curvature"


def checked_rest_curvature(value: Any, segments: int, bending: float, twist: float) -> np.ndarray:
    """Return a rest curvature (n, 3) or (n, 2 k, 3) [1/m] as a read-only array; ``None``: straight.

    Args:
        value: Nested lists or an array; see `Finger.rest_curvature`.
        segments: n.
        bending, twist: Limits that it must stay below everywhere [1/m].

    Raises:
        InvalidValue: Wrong counts, numbers that are not finite, or curvature beyond the limits.
    """
    if value is None:
        rest = np.zeros((segments, 3))
    else:
        rest = _numbers(value, segments)
    # A segment bent further than half a turn, or so tightly that the inner side of a disk
    # folds onto the next, is no finger.
    with np.errstate(over="ignore"):
        far = np.hypot(rest[..., 0], rest[..., 1]) >= bending
    far |= np.abs(rest[..., 2]) >= twist
    for index in np.argwhere(far):
        raise InvalidValue(
            _PLACE + "".join(f"[{i}]" for i in index),
            rest[tuple(index)],
            f"bending < {bending:.6g} 1/m and twist < {twist:.6g} 1/m"
            " (disks would meet, or a segment turn by more than half a turn)",
        )
    rest.setflags(write=False)
    return rest


def _numbers(value: Any, segments: int) -> np.ndarray:
    allowed = f"{segments} vectors of 3 numbers [1/m], one per segment"
    if not checks.is_list(value):
        raise InvalidValue(_PLACE, value, f"{allowed}, or {segments} lists of vectors")
    if len(value) != segments:
        raise InvalidValue(_PLACE, value, f"{allowed} (got {len(value)})")
    if _is_clean(value):
        return value.copy()
    if checks.is_list(value[0]) and len(value[0]) and checks.is_list(value[0][0]):
        ends = len(value[0])
        return np.array([_segment(f"{_PLACE}[{i}]", v, ends) for i, v in enumerate(value)])
    return np.array(
        [checks.vector(f"{_PLACE}[{i}]", v, 3, unit="1/m") for i, v in enumerate(value)]
    )


def _is_clean(value: Any) -> bool:
    """Whether all is as it shall be, seen at once: number by number takes milliseconds."""
    if not isinstance(value, np.ndarray) or value.dtype != np.float64:
        return False
    wanted = value.ndim == 2 or (
        value.ndim == 3 and value.shape[1] in range(2, 2 * MAX_PIECES + 1, 2)
    )
    return wanted and value.shape[-1] == 3 and bool(np.isfinite(value).all())


def _segment(place: str, value: Any, ends: int) -> np.ndarray:
    """Return the curvature (ends, 3) at the start and the end of each of a segment's pieces."""
    most = 2 * MAX_PIECES
    count = len(value) if checks.is_list(value) else 0
    if count != ends or not 2 <= ends <= most or ends % 2:
        number = str(ends) if 2 <= ends <= most and ends % 2 == 0 else f"2, 4, .. or {most}"
        raise InvalidValue(
            place,
            value,
            f"{number} vectors of 3 numbers [1/m], at the start and the end of each of its pieces,"
            " as many for each segment",
        )
    return np.array([checks.vector(f"{place}[{i}]", v, 3, unit="1/m") for i, v in enumerate(value)])
