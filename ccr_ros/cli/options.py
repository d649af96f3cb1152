# SPDX-License-Identifier: Apache-2.0
"""Numbers from the command line, checked."""

from __future__ import annotations

from ccr_ros.model import checks
from ccr_ros.model.errors import InvalidValue

_LONGEST = 50  # characters of a name to which others are added


def number(option: str, text: str, low: float, high: float) -> float:
    """Return the number that an option's text is, low <= number <= high.

    Raises:
        InvalidValue: It is no such number; the error names the option.
    """
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not low <= value <= high:
        raise InvalidValue(option, text, f"a number {low:g}..{high:g}")
    return value


def integer(option: str, text: str, low: int, high: int) -> int:
    """Return the integer that an option's text is, low <= integer <= high.

    Raises:
        InvalidValue: It is no such integer; the error names the option.
    """
    try:
        value = int(text)
    except ValueError:
        value = low - 1
    if not low <= value <= high:
        raise InvalidValue(option, text, f"an integer {low}..{high}")
    return value


def file_name(option: str, text: str) -> str:
    """Return a name that a gripper and its files may have.

    Raises:
        InvalidValue: It may be none, or leads out of the folder; the error names the option.
    """
    if len(text) > _LONGEST or text.startswith(".") or set(text) & set("/\\"):
        allowed = f"a name of at most {_LONGEST} characters, no '/' or '\\' and no '.' at its start"
        raise InvalidValue(option, text, allowed)
    return checks.label(option, text)
