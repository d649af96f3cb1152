# SPDX-License-Identifier: Apache-2.0
"""Lets in what waits before a solve, so that the newest is solved; but not for ever."""

from __future__ import annotations

import math
import time

# s that taking in a backlog may delay a solve by: at least, and at most. Between them it is what
# the solve before took: where solves take long, more messages wait, and would be more each time.
_LOOKING, _MOST_LOOKING = 0.005, 0.1


class Backlog:
    """Tells at every turn of the executor whether more messages have come since the turn before.

    An executor hands over one message per turn, so a backlog shows as one more at every look.
    """

    def __init__(self) -> None:
        self.growing = False  # whether the last look found newer messages
        self._seen = 0
        self._since: float | None = None  # when it was first looked at
        self._settled_at = -math.inf
        self._limit = _LOOKING

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
            self._limit = min(max(now - self._settled_at, _LOOKING), _MOST_LOOKING)
        if quiet or now - self._since > self._limit:
            self._since, self._settled_at = None, now
        return self._since is None

    def mark_seen(self, received: int) -> None:
        """Take so many messages for seen: the next look is settled, unless more come."""
        self._seen = received
