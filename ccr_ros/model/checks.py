# SPDX-License-Identifier: Apache-2.0
"""Checks of numbers that come from outside: each returns the clean value or raises InvalidValue."""

from __future__ import annotations

import math
import re
from numbers import Integral, Real
from typing import Any

import numpy as np

from .errors import InvalidValue

_LARGEST_FLOAT = float(np.finfo(float).max)
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}")


def real(
    place: str,
    value: Any,
    *,
    above: float = -math.inf,
    below: float = math.inf,
    low: float = -math.inf,
    high: float = math.inf,
    unit: str = "",
) -> float:
    """Return ``value`` as a finite float with above < value < below and low <= value <= high."""
    limits = [
        f"> {above:g}" if above > -math.inf else "",
        f">= {low:g}" if low > -math.inf else "",
        f"< {below:g}" if below < math.inf else "",
        f"<= {high:g}" if high < math.inf else "",
    ]
    words = ["a finite number", " and ".join(x for x in limits if x), f"[{unit}]" if unit else ""]
    allowed = " ".join(x for x in words if x)
    if isinstance(value, bool | np.bool_) or not isinstance(value, Real):
        raise InvalidValue(place, value, allowed)
    try:
        number = float(value)
    except OverflowError:  # an int beyond any float
        number = math.inf
    if not (math.isfinite(number) and above < number < below and low <= number <= high):
        raise InvalidValue(place, value, allowed)
    return number


def integer(place: str, value: Any, *, low: int, high: int | None = None) -> int:
    """Return ``value`` as an int with low <= value (<= high)."""
    allowed = f"an integer >= {low}" if high is None else f"an integer {low}..{high}"
    if isinstance(value, bool | np.bool_) or not isinstance(value, Integral):
        raise InvalidValue(place, value, allowed)
    number = int(value)
    if number < low or (high is not None and number > high):
        raise InvalidValue(place, value, allowed)
    return number


def is_list(value: Any) -> bool:
    """Tell whether ``value`` is a list, a tuple or an array of at least one dimension."""
    return isinstance(value, list | tuple) or (isinstance(value, np.ndarray) and value.ndim > 0)


def vector(
    place: str, value: Any, size: int, *, unit: str = "", largest: float = math.inf
) -> np.ndarray:
    """Return ``value`` as a read-only float vector of the given size, each |number| <= largest."""
    allowed = f"{size} finite numbers" + (f" [{unit}]" if unit else "")
    if not is_list(value):
        raise InvalidValue(place, value, allowed)
    if len(value) != size:
        raise InvalidValue(place, value, f"{allowed} (got {len(value)})")
    if _is_clean(value, largest):
        array = value.copy()
    else:
        array = np.array(
            [
                real(f"{place}[{i}]", v, low=-largest, high=largest, unit=unit)
                for i, v in enumerate(value)
            ]
        )
    array.setflags(write=False)
    return array


def _is_clean(value: Any, largest: float) -> bool:
    """Tell, in little time, that a value is a vector of finite floats, none above ``largest``."""
    return (
        isinstance(value, np.ndarray)
        and value.dtype == np.float64
        and value.ndim == 1
        and bool((np.abs(value) <= min(largest, _LARGEST_FLOAT)).all())  # false for nan
    )


def direction(place: str, value: Any) -> np.ndarray:
    """Return ``value`` as a read-only unit 3-vector; it may not be (nearly) zero."""
    array = vector(place, value, 3)
    norm = math.hypot(*array)  # unlike numpy's, does not overflow on the way
    if not 1e-9 < norm < math.inf:
        raise InvalidValue(place, value, "a non-zero 3-vector")
    unit = array / norm
    unit.setflags(write=False)
    return unit


def name(place: str, value: Any) -> str:
    """Return ``value`` as a name usable in a ROS topic: a letter, then letters, digits, ``_``."""
    if not isinstance(value, str) or not _NAME.fullmatch(value) or "__" in value:
        allowed = "a name of at most 64 letters, digits and single '_' that starts with a letter"
        raise InvalidValue(place, value, allowed)
    return value


def label(place: str, value: Any) -> str:
    """Return ``value`` as a name for people: 1 to 64 printable characters, no blanks around it."""
    if not isinstance(value, str) or not 0 < len(value) <= 64 or value != value.strip():
        raise InvalidValue(place, value, "a text of 1 to 64 characters without blanks around it")
    if not value.isprintable():
        raise InvalidValue(place, value, "a text of printable characters")
    return value


def quaternion(place: str, value: Any) -> np.ndarray:
    """Return ``value`` (x, y, z, w) as a read-only unit quaternion; within 1 % of unit length."""
    array = vector(place, value, 4)
    norm = math.hypot(*array)
    if not abs(norm - 1.0) <= 0.01:
        raise InvalidValue(
            place, value, f"a unit quaternion (x, y, z, w); its length is {norm:.6g}"
        )
    unit = array / norm
    unit.setflags(write=False)
    return unit


def rows(
    place: str, value: Any, width: int, *, unit: str = "", largest: float = math.inf
) -> np.ndarray:
    """Return ``value`` as a float array (n, width) of its own, each |number| <= largest."""
    allowed = f"a list of vectors of {width} finite numbers" + (f" [{unit}]" if unit else "")
    if not is_list(value):
        raise InvalidValue(place, value, allowed)
    clean = isinstance(value, np.ndarray) and value.dtype.kind == "f" and value.ndim == 2
    if clean and value.shape[1] == width and (np.abs(value) <= largest).all():
        return value.astype(float)  # at once: the rest takes a second for 100,000 numbers
    found = [
        vector(f"{place}[{i}]", v, width, unit=unit, largest=largest) for i, v in enumerate(value)
    ]
    return np.array(found).reshape(-1, width)


def index_rows(place: str, value: Any, width: int, count: int) -> np.ndarray:
    """Return ``value`` as an int array (n, width) of its own, each index in 0..count - 1."""
    allowed = f"a list of lists of {width} integers 0..{count - 1}"
    if not is_list(value):
        raise InvalidValue(place, value, allowed)
    clean = isinstance(value, np.ndarray) and value.dtype.kind in "iu" and value.ndim == 2
    if clean and value.shape[1] == width and ((value >= 0) & (value < count)).all():
        return value.astype(int)
    found = []
    for i, entry in enumerate(value):
        if not is_list(entry) or len(entry) != width:
            raise InvalidValue(f"{place}[{i}]", entry, f"{width} integers 0..{count - 1}")
        found.append(
            [integer(f"{place}[{i}][{k}]", v, low=0, high=count - 1) for k, v in enumerate(entry)]
        )
    return np.array(found, dtype=int).reshape(-1, width)
