# SPDX-License-Identifier: Apache-2.0
"""Lets in what waits before a solve, so that the newest is solved; but not for ever."""

from __future__ import annotations

import time

_MOST_LOOKING = 0.005  # s that taking in a backlog may delay a solve by


class Backlog:
    """Tells at every turn of the executor whether more messages have come since the turn before.

    An executor hands over one message per turn, so a backlog shows as one more at every look.
    """

    def __init__(self) -> None:
        self.growing = False  # whether the last look found newer messages
        self._seen = 0
        self._since: float | None = None  # when it was first looked at

    def settled(self, received: int) -> bool:
        """Tell whether no more have come in, or it was looked at for long enough.

        Args:
            received: Messages so far.
        """
        quiet = self._seen == received
        self.growing = not quiet
        self._seen = received
        now = time.monotonic()
        if self._since is None:
            self._since = now
        if quiet or now - self._since > _MOST_LOOKING:
            self._since = None
        return self._since is None

    def mark_seen(self, received: int) -> None:
        """Take so many messages for seen: the next look is settled, unless more come."""
        self._seen = received
