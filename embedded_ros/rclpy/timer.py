# SPDX-License-Identifier: Apache-2.0
"""Timers and rates."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from typing import Any

from ._rclpy_pybind11 import RCLError
from .clock import Clock
from .destroyable import Destroyable
from .exceptions import ROSInterruptException
from .impl.queued import Work, await_or_execute
from .utilities import get_default_context


class Timer(Destroyable):
    """Calls back periodically. It keeps its phase and skips periods that were missed."""

    def __init__(
        self,
        callback: Callable[..., Any] | None,
        callback_group: Any,
        timer_period_ns: int,
        clock: Clock,
        *,
        context: Any = None,
        autostart: bool = True,
    ) -> None:
        """Start a timer with a period in nanoseconds.

        :raises RCLError: the period is negative.
        """
        self._context = get_default_context() if context is None else context
        self._clock = clock
        self._period = self._checked(timer_period_ns)
        self.callback = callback
        self.callback_group = callback_group
        self._executor_event = False
        self._canceled = not autostart
        self._lock = threading.Lock()
        self._last_call = clock._now()
        self._next_call = self._last_call + self._period
        self._wake: Callable[[], None] | None = None

    @staticmethod
    def _checked(period: int) -> int:
        period = int(period)
        if period < 0:
            raise RCLError(f"timer period must be non-negative, got {period} ns")
        return period

    @property
    def clock(self) -> Clock:
        """The clock that the period is measured on."""
        return self._clock

    @property
    def timer_period_ns(self) -> int:
        """The period in nanoseconds; a new one counts from the next call on."""
        return self.handle._period

    @timer_period_ns.setter
    def timer_period_ns(self, value: int) -> None:
        self.handle._period = self._checked(value)

    def is_ready(self) -> bool:
        """Whether the next call is due."""
        return not self.handle._canceled and self._next_call <= self._clock._now()

    def is_canceled(self) -> bool:
        """Whether the timer stands still."""
        return self.handle._canceled

    def cancel(self) -> None:
        """Stop until :meth:`reset`."""
        self.handle._canceled = True

    def reset(self) -> None:
        """Start again; the next call is one period from now."""
        with self.handle._lock:
            self._next_call = self._clock._now() + self._period
            self._canceled = False
        if self._wake is not None:
            self._wake()

    def time_since_last_call(self) -> int:
        """Nanoseconds since the last call, or since creation."""
        return self._clock._now() - self.handle._last_call

    def time_until_next_call(self) -> int | None:
        """Nanoseconds until the next call, negative when overdue, None when canceled."""
        return None if self.handle._canceled else self._next_call - self._clock._now()

    def has_work(self) -> bool:
        """Whether an executor is to call back."""
        return not self._ros_destroyed and self.is_ready()

    def take_work(self) -> Work | None:
        """Note that the callback is being called, and return what is to be run."""
        if self.handle._canceled:
            return None
        self.call_timer()
        return None if self.callback is None else partial(await_or_execute, self.callback)

    def call_timer(self) -> None:
        """Note that the callback is being called, and find the next time: the first multiple that
        lies ahead.
        """
        with self._lock:
            now = self._clock._now()
            self._last_call = now
            self._next_call += self._period
            if self._next_call <= now:
                if self._period == 0:
                    self._next_call = now
                else:
                    missed = 1 + (now - self._next_call) // self._period
                    self._next_call += missed * self._period

    def on_clock_jump(self) -> None:
        """Start the period anew after the time source changed or went back."""
        with self._lock:
            now = self._clock._now()
            if self._next_call - now > self._period or self._last_call > now:
                self._last_call = now
                self._next_call = now + self._period


class Rate:
    """Sleeps at a fixed rate; the timer behind it must be spun by another thread."""

    def __init__(self, timer: Timer, *, context: Any) -> None:
        self._timer = timer
        self._is_shutdown = False
        self._is_destroyed = False
        self._condition = threading.Condition()
        self._fired = 0
        timer.callback = self._fire
        context.on_shutdown(self._on_shutdown)

    def _fire(self) -> None:
        with self._condition:
            self._fired += 1
            self._condition.notify_all()

    def _on_shutdown(self) -> None:
        self._is_shutdown = True
        self.destroy()

    def destroy(self) -> None:
        """Wake all sleepers."""
        self._is_destroyed = True
        with self._condition:
            self._condition.notify_all()

    def sleep(self) -> None:
        """Block until the timer fires. In a callback of a single-threaded executor that is forever.

        :raises ROSInterruptException: the context was shut down.
        :raises RuntimeError: the rate was destroyed.
        """
        if self._is_destroyed and not self._is_shutdown:
            raise RuntimeError("Rate cannot sleep because it has been destroyed")
        with self._condition:
            fired = self._fired
            while True:
                if self._is_shutdown or not self._timer._context.ok():
                    raise ROSInterruptException()
                if self._is_destroyed or self._fired != fired:
                    return
                # A signal ends the context without a callback: look up now and then.
                self._condition.wait(0.1)
