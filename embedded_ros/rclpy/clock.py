# SPDX-License-Identifier: Apache-2.0
"""Clocks: system, steady and ROS time, the last of which a simulation may drive."""

from __future__ import annotations

import threading
import time as _time
from collections.abc import Callable
from enum import IntEnum
from typing import Any

from .clock_type import ClockType
from .destroyable import Destroyable
from .duration import Duration
from .exceptions import NotInitializedException
from .time import Time
from .utilities import get_default_context

__all__ = [
    "Clock",
    "ClockChange",
    "ClockType",
    "JumpHandle",
    "JumpThreshold",
    "ROSClock",
    "TimeJump",
]


class ClockChange(IntEnum):
    """What a time jump did to the source of ROS time."""

    ROS_TIME_NO_CHANGE = 1
    ROS_TIME_ACTIVATED = 2
    ROS_TIME_DEACTIVATED = 3
    SYSTEM_TIME_NO_CHANGE = 4


class JumpThreshold:
    """How far time must jump before a callback hears of it."""

    def __init__(
        self,
        *,
        min_forward: Duration | None,
        min_backward: Duration | None,
        on_clock_change: bool = True,
    ) -> None:
        """Set the smallest forward (positive) and backward (negative) jump; None: that direction is
        ignored.

        :raises ValueError: a duration has the wrong sign, or nothing is asked for.
        """
        if min_forward is not None and min_forward.nanoseconds <= 0:
            raise ValueError("min_forward must be a positive non-zero duration")
        if min_backward is not None and min_backward.nanoseconds >= 0:
            raise ValueError("min_backward must be a negative non-zero duration")
        if min_forward is None and min_backward is None and not on_clock_change:
            raise ValueError("At least one jump threshold must be enabled")
        self.min_forward = min_forward
        self.min_backward = min_backward
        self.on_clock_change = on_clock_change


class TimeJump:
    """A jump that happened: what changed, and by how much."""

    def __init__(self, clock_change: ClockChange, delta: Duration) -> None:
        if not isinstance(clock_change, ClockChange):
            raise TypeError("clock_change must be an instance of rclpy.clock.ClockChange")
        self._clock_change = clock_change
        self._delta = delta

    @property
    def clock_change(self) -> ClockChange:
        return self._clock_change

    @property
    def delta(self) -> Duration:
        return self._delta


class JumpHandle:
    """A registered jump callback; unregister it, or use it as a context manager."""

    def __init__(
        self,
        *,
        clock: Clock,
        threshold: JumpThreshold,
        pre_callback: Callable[[], Any] | None,
        post_callback: Callable[[TimeJump], Any] | None,
    ) -> None:
        if pre_callback is None and post_callback is None:
            raise ValueError("One of pre_callback or post_callback must be callable")
        if pre_callback is not None and not callable(pre_callback):
            raise ValueError("pre_callback must be callable if given")
        if post_callback is not None and not callable(post_callback):
            raise ValueError("post_callback must be callable if given")
        self._clock: Clock | None = clock
        self.threshold = threshold
        self.pre_callback = pre_callback
        self.post_callback = post_callback
        clock._jump_handles.append(self)

    def unregister(self) -> None:
        """Stop hearing of jumps."""
        if self._clock is not None:
            self._clock._jump_handles.remove(self)
            self._clock = None

    def __enter__(self) -> JumpHandle:
        return self

    def __exit__(self, *args: object) -> None:
        self.unregister()


class Clock(Destroyable):
    """A source of time. ``Clock(clock_type=ClockType.ROS_TIME)`` gives a :class:`ROSClock`."""

    def __new__(cls, *, clock_type: ClockType = ClockType.SYSTEM_TIME) -> Clock:
        if not isinstance(clock_type, ClockType):
            raise TypeError("Clock type must be a ClockType enum")
        return super().__new__(ROSClock if clock_type is ClockType.ROS_TIME else cls)

    def __init__(self, *, clock_type: ClockType = ClockType.SYSTEM_TIME) -> None:
        self._clock_type = clock_type
        self._jump_handles: list[JumpHandle] = []
        self._lock = threading.Lock()

    @property
    def clock_type(self) -> ClockType:
        """The kind of this clock."""
        return self._clock_type

    def __repr__(self) -> str:
        return f"Clock(clock_type={self._clock_type.name})"

    def _now(self) -> int:
        """Nanoseconds since this clock's epoch."""
        if self._clock_type is ClockType.STEADY_TIME:
            return _time.monotonic_ns()
        return _time.time_ns()

    def now(self) -> Time:
        """The present time."""
        return Time(nanoseconds=self._now(), clock_type=self._clock_type)

    def create_jump_callback(
        self,
        threshold: JumpThreshold,
        *,
        pre_callback: Callable[[], Any] | None = None,
        post_callback: Callable[[TimeJump], Any] | None = None,
    ) -> JumpHandle:
        """Have callbacks called before and after jumps beyond `threshold`."""
        return JumpHandle(
            clock=self, threshold=threshold, pre_callback=pre_callback, post_callback=post_callback
        )

    def sleep_until(self, until: Time, context: Any = None) -> bool:
        """Sleep until a time on this clock; False when the context was shut down or the time source
        changed.

        :raises ValueError: `until` is on a clock of another kind.
        :raises NotInitializedException: the context is not initialised.
        """
        context = get_default_context() if context is None else context
        if not context.ok():
            raise NotInitializedException()
        if until.clock_type != self._clock_type:
            raise ValueError("until's clock type does not match this clock's type")
        changed = threading.Event()
        threshold = JumpThreshold(min_forward=None, min_backward=None, on_clock_change=True)
        with self.create_jump_callback(threshold, post_callback=lambda jump: changed.set()):
            while context.ok() and not changed.is_set():
                left = (until.nanoseconds - self._now()) * 1e-9
                if left <= 0:
                    return True
                # ROS time may run at any rate and shutdown sets no event here: look again now and
                # then.
                changed.wait(min(left, 0.02))
        return False

    def sleep_for(self, rel_time: Duration, context: Any = None) -> bool:
        """Sleep for a duration; see :meth:`sleep_until`."""
        return self.sleep_until(self.now() + rel_time, context)


class ROSClock(Clock):
    """System time, or what a simulation publishes once the override is active."""

    def __new__(cls) -> ROSClock:
        return super().__new__(cls, clock_type=ClockType.ROS_TIME)  # type: ignore[return-value]

    def __init__(self, *, clock_type: ClockType = ClockType.ROS_TIME) -> None:
        super().__init__(clock_type=ClockType.ROS_TIME)
        self._active = False
        self._override = 0

    @property
    def ros_time_is_active(self) -> bool:
        """Whether time comes from outside."""
        return self._active

    def _now(self) -> int:
        return self._override if self._active else _time.time_ns()

    def _set_ros_time_is_active(self, enabled: bool) -> None:
        if enabled == self._active:
            return
        change = ClockChange.ROS_TIME_ACTIVATED if enabled else ClockChange.ROS_TIME_DEACTIVATED
        handles = [h for h in self._jump_handles if h.threshold.on_clock_change]
        self._announce(handles)
        self._active = enabled
        self._report(handles, TimeJump(change, Duration()))

    def set_ros_time_override(self, time: Time) -> None:
        """Set the time that :meth:`now` gives while the override is active.

        :raises TypeError: `time` is no Time.
        """
        if not isinstance(time, Time):
            raise TypeError(
                "Time must be specified as rclpy.time.Time. Received type: " + str(type(time))
            )
        delta = time.nanoseconds - self._override
        handles = []
        if self._active:
            for handle in self._jump_handles:
                forward, backward = handle.threshold.min_forward, handle.threshold.min_backward
                if (forward is not None and delta >= forward.nanoseconds) or (
                    backward is not None and delta <= backward.nanoseconds
                ):
                    handles.append(handle)
        self._announce(handles)
        self._override = time.nanoseconds
        self._report(handles, TimeJump(ClockChange.ROS_TIME_NO_CHANGE, Duration(nanoseconds=delta)))

    @staticmethod
    def _announce(handles: list[JumpHandle]) -> None:
        for handle in handles:
            if handle.pre_callback is not None:
                handle.pre_callback()

    @staticmethod
    def _report(handles: list[JumpHandle], jump: TimeJump) -> None:
        for handle in handles:
            if handle.post_callback is not None:
                handle.post_callback(jump)
