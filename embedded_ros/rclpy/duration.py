# SPDX-License-Identifier: Apache-2.0
"""Durations."""

from __future__ import annotations

from typing import Any

import builtin_interfaces.msg

from .constants import S_TO_NS

_LIMIT = 2**63


class Duration:
    """A signed span of time with nanosecond resolution."""

    def __init__(self, *, seconds: float = 0, nanoseconds: int = 0) -> None:
        """Add up seconds and nanoseconds.

        :raises OverflowError: the sum does not fit 64 bits.
        """
        total = int(seconds * S_TO_NS) + int(nanoseconds)
        if not -_LIMIT <= total < _LIMIT:
            raise OverflowError(
                f"Total nanoseconds value is too large to store in C duration: {total}"
            )
        self._nanoseconds = total

    @property
    def nanoseconds(self) -> int:
        """The whole span in nanoseconds."""
        return self._nanoseconds

    def __repr__(self) -> str:
        return f"Duration(nanoseconds={self._nanoseconds})"

    def __str__(self) -> str:
        if self == Infinite:
            return "Infinite"
        return f"{self._nanoseconds} nanoseconds"

    def __eq__(self, other: object) -> bool:
        if isinstance(other, Duration):
            return self._nanoseconds == other._nanoseconds
        return NotImplemented

    def __lt__(self, other: Duration) -> bool:
        if isinstance(other, Duration):
            return self._nanoseconds < other._nanoseconds
        return NotImplemented

    def __le__(self, other: Duration) -> bool:
        if isinstance(other, Duration):
            return self._nanoseconds <= other._nanoseconds
        return NotImplemented

    def __gt__(self, other: Duration) -> bool:
        if isinstance(other, Duration):
            return self._nanoseconds > other._nanoseconds
        return NotImplemented

    def __ge__(self, other: Duration) -> bool:
        if isinstance(other, Duration):
            return self._nanoseconds >= other._nanoseconds
        return NotImplemented

    __hash__ = None  # type: ignore[assignment]

    def get_c_duration(self) -> Duration:
        """This duration, which needs no other form here."""
        return self

    def to_msg(self) -> Any:
        """As builtin_interfaces/msg/Duration; an infinite duration becomes the largest message
        value.
        """
        if self == Infinite:
            return builtin_interfaces.msg.Duration(sec=2147483647, nanosec=4294967295)
        seconds, nanoseconds = divmod(self._nanoseconds, S_TO_NS)
        return builtin_interfaces.msg.Duration(sec=seconds, nanosec=nanoseconds)

    @classmethod
    def from_msg(cls, msg: Any) -> Duration:
        """From builtin_interfaces/msg/Duration.

        :raises TypeError: `msg` is no such message.
        """
        if not isinstance(msg, builtin_interfaces.msg.Duration):
            raise TypeError("Must pass a builtin_interfaces.msg.Duration object")
        return cls(seconds=msg.sec, nanoseconds=msg.nanosec)


# What rmw calls infinite: nine quintillion nanoseconds, just below the 64-bit limit.
Infinite = Duration(seconds=9223372036, nanoseconds=854775807)
