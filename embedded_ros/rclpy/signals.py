# SPDX-License-Identifier: Apache-2.0
"""SIGINT and SIGTERM end all contexts, after which spinning raises or returns.

The handler that was there before is called as well: for SIGINT that is Python's, which raises
KeyboardInterrupt. A second signal within a second of the first means the same and does nothing, as
it would only break into the program's cleaning up.
"""

from __future__ import annotations

import atexit
import signal
import threading
import time
from enum import IntFlag
from functools import partial
from types import FrameType
from typing import Any

from embedded_ros.interrupts import deliver

from .context import live_contexts
from .guard_condition import GuardCondition


class SignalHandlerOptions(IntFlag):
    """Which signals are handled."""

    NO = 0
    SIGINT = 1
    SIGTERM = 2
    ALL = 3


#: how long a program that was told to end is not told again, s
_GRACE = 1.0

_previous: dict[int, Any] = {}
_told: float | None = None


def _handle(number: int, frame: FrameType | None) -> None:
    global _told
    for context in list(live_contexts):
        context._invalidate()
    now = time.monotonic()
    if _told is not None and now - _told < _GRACE:
        return
    _told = now
    previous = _previous.get(number)
    if callable(previous):
        deliver(partial(previous, number, frame))


def install_signal_handlers(options: SignalHandlerOptions = SignalHandlerOptions.ALL) -> None:
    """Handle the given signals.

    Python allows this in the main thread only; elsewhere nothing is done.
    """
    if threading.current_thread() is not threading.main_thread():
        return
    for option, number in (
        (SignalHandlerOptions.SIGINT, signal.SIGINT),
        (SignalHandlerOptions.SIGTERM, signal.SIGTERM),
    ):
        if option & options and number not in _previous:
            _previous[number] = signal.signal(number, _handle)


def uninstall_signal_handlers() -> None:
    """Put the former handlers back."""
    if threading.current_thread() is not threading.main_thread():
        return
    for number, previous in list(_previous.items()):
        if signal.getsignal(number) is _handle:
            signal.signal(number, signal.SIG_DFL if previous is None else previous)
        del _previous[number]


def get_current_signal_handlers_options() -> SignalHandlerOptions:
    """Which signals are handled now."""
    result = SignalHandlerOptions.NO
    if signal.SIGINT in _previous:
        result |= SignalHandlerOptions.SIGINT
    if signal.SIGTERM in _previous:
        result |= SignalHandlerOptions.SIGTERM
    return result


def _ignore_signals() -> None:
    """While the interpreter ends it has no handlers any more, and a late signal would kill it."""
    if _told is not None:
        for number in _previous:
            signal.signal(number, signal.SIG_IGN)


atexit.register(_ignore_signals)


class SignalHandlerGuardCondition(GuardCondition):
    """A guard condition that triggers when a context ends."""

    def __init__(self, context: Any = None) -> None:
        super().__init__(callback=None, callback_group=None, context=context)
        self._context.add_waker(self)

    def wake(self) -> None:
        """Trigger, unless destroyed."""
        if not self._ros_destroyed:
            self.trigger()
