# SPDX-License-Identifier: Apache-2.0
"""How executors say why they stopped waiting, and what they count."""

from __future__ import annotations

import threading


class TimeoutException(Exception):
    """A timeout passed."""


class ShutdownException(Exception):
    """The executor was shut down."""


class ExternalShutdownException(Exception):
    """The context was shut down, by a signal or another thread."""

    def __init__(self) -> None:
        super().__init__("context was shut down")


class ConditionReachedException(Exception):
    """The future that was waited for is done."""


class TimeoutObject:
    """A timeout that may be shortened while waiting for it, s."""

    def __init__(self, timeout: float) -> None:
        self.timeout = timeout


class WorkTracker:
    """Counts what is being executed."""

    def __init__(self) -> None:
        self._running = 0
        self._condition = threading.Condition()

    def __enter__(self) -> None:
        with self._condition:
            self._running += 1

    def __exit__(self, *args: object) -> None:
        with self._condition:
            self._running -= 1
            self._condition.notify_all()

    def wait(self, timeout_sec: float | None = None) -> bool:
        if timeout_sec is not None and timeout_sec < 0.0:
            timeout_sec = None
        with self._condition:
            return self._condition.wait_for(lambda: self._running == 0, timeout_sec)
