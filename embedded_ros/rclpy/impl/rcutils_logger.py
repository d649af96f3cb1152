# SPDX-License-Identifier: Apache-2.0
"""Loggers: levels by name, console output in ROS's format, and a hook for /rosout."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from .log_filters import FILTERS, CallerId, filters_from_kwargs, find_caller
from .logging_severity import LoggingSeverity

if TYPE_CHECKING:
    from .arguments import RosArguments

_DEFAULT_FORMAT = "[{severity}] [{time}] [{name}]: {message}"
_COLORS = {10: "\x1b[32m", 30: "\x1b[33m", 40: "\x1b[31m", 50: "\x1b[31m"}

_levels: dict[str, LoggingSeverity] = {}
_default_level = LoggingSeverity.INFO
_stdout_logs = True
_lock = threading.Lock()

#: called with (name, severity, message, caller, time in ns) for every message that is logged
Sink = Callable[[str, LoggingSeverity, str, CallerId, int], None]
sinks: dict[str, list[Sink]] = {}


def configure(arguments: RosArguments) -> None:
    """Apply the log levels of a command line."""
    global _default_level, _stdout_logs
    for name, level in arguments.log_levels:
        if name:
            _levels[name] = LoggingSeverity[level]
        else:
            _default_level = LoggingSeverity[level]
    _stdout_logs = arguments.logs.get("stdout", True)


def clear_levels() -> None:
    """Forget all levels that were set."""
    global _default_level
    _levels.clear()
    _default_level = LoggingSeverity.INFO


def set_level(name: str, level: LoggingSeverity) -> None:
    """Set the level of one logger; the empty name is the root."""
    global _default_level
    if name:
        _levels[name] = level
    else:
        _default_level = level


def own_level(name: str) -> LoggingSeverity:
    """The level set for exactly this logger."""
    return _levels.get(name, LoggingSeverity.UNSET) if name else _default_level


def effective_level(name: str) -> LoggingSeverity:
    """The level of the logger, or of the nearest ancestor that has one."""
    while name:
        level = _levels.get(name)
        if level:
            return level
        name = name.rpartition(".")[0]
    return _default_level


def _use_color(stream: Any) -> bool:
    setting = os.environ.get("RCUTILS_COLORIZED_OUTPUT", "")
    return (
        setting == "1"
        if setting in ("0", "1")
        else bool(getattr(stream, "isatty", lambda: False)())
    )


def _print(
    name: str, severity: LoggingSeverity, message: str, caller: CallerId, stamp: int
) -> None:
    stream = sys.stdout if os.environ.get("RCUTILS_LOGGING_USE_STDOUT") == "1" else sys.stderr
    text = os.environ.get("RCUTILS_CONSOLE_OUTPUT_FORMAT") or _DEFAULT_FORMAT
    for key, value in (
        ("severity", severity.name),
        ("time", f"{stamp // 10**9}.{stamp % 10**9:09d}"),
        ("time_as_nanoseconds", str(stamp)),
        ("name", name),
        ("function_name", caller.function_name),
        ("file_name", caller.file_path),
        ("line_number", str(caller.line_number)),
        ("message", message),
    ):
        text = text.replace("{" + key + "}", value)
    color = _COLORS.get(severity) if _use_color(stream) else None
    if color:
        text = f"{color}{text}\x1b[0m"
    try:
        with _lock:
            stream.write(text + "\n")
            stream.flush()
    except (OSError, ValueError):
        # A closed stream (the interpreter ends, a pipe broke) is no reason to fail the caller.
        pass


class RcutilsLogger:
    """A named logger. Child loggers are named ``parent.child`` and inherit the level."""

    _contexts: dict[CallerId, dict[str, Any]]

    def __init__(self, name: str = "") -> None:
        self.name = name
        self._contexts = {}

    def get_child(self, name: str) -> RcutilsLogger:
        """The logger below this one.

        :raises ValueError: the name is empty.
        """
        if not name:
            raise ValueError("Child logger name must not be empty.")
        child = RcutilsLogger(f"{self.name}.{name}" if self.name else name)
        if self.name in sinks:
            sinks.setdefault(child.name, sinks[self.name])
        return child

    def set_level(self, level: LoggingSeverity | int) -> None:
        """Log nothing below ``level`` from now on."""
        set_level(self.name, LoggingSeverity(level))

    def get_effective_level(self) -> LoggingSeverity:
        """The level that counts."""
        return effective_level(self.name)

    def is_enabled_for(self, severity: LoggingSeverity | int) -> bool:
        """Whether messages of that severity are logged."""
        return LoggingSeverity(severity) >= self.get_effective_level()

    def log(self, message: str, severity: LoggingSeverity | int, **kwargs: Any) -> bool:
        """Log a message and return whether it came out.

        Keyword arguments: ``once``, ``skip_first``, ``throttle_duration_sec`` (seconds) with
        ``throttle_time_source_type`` (a clock, default steady time). They are bound to the calling
        line.

        :raises TypeError: an unknown or incomplete set of arguments, or the message is no str.
        :raises ValueError: the calling line was used with another severity or other filters before.
        """
        severity = LoggingSeverity(severity)
        if severity < self.get_effective_level():
            return False
        name = kwargs.pop("name", self.name)
        wanted = filters_from_kwargs(kwargs)
        caller = find_caller()
        context = self._contexts.get(caller)
        if context is None:
            context = {"severity": severity, "name": name, "filters": wanted}
            for wanted_filter in wanted:
                FILTERS[wanted_filter].initialize_context(context, **kwargs)
            self._contexts[caller] = context
        elif context["severity"] != severity:
            raise ValueError("Logger severity cannot be changed between calls.")
        elif context["name"] != name:
            raise ValueError("Logger name cannot be changed between calls.")
        elif context["filters"] != wanted:
            raise ValueError("Requested logging filters cannot be changed between calls.")
        elif any(
            context[param] != kwargs.get(param, default)
            for wanted_filter in wanted
            for param, default in FILTERS[wanted_filter].params.items()
        ):
            raise ValueError("Logging filter parameters cannot be changed between calls.")
        if not all(FILTERS[name].should_log(context) for name in wanted):
            return False
        if not isinstance(message, str):
            raise TypeError(f"a message to log must be a str, got {message!r}")
        stamp = time.time_ns()
        if _stdout_logs:
            _print(name, severity, message, caller, stamp)
        for sink in list(sinks.get(name, ())):
            sink(name, severity, message, caller, stamp)
        return True

    def debug(self, message: str, **kwargs: Any) -> bool:
        """Log at DEBUG; see :meth:`log`."""
        return self.log(message, LoggingSeverity.DEBUG, **kwargs)

    def info(self, message: str, **kwargs: Any) -> bool:
        """Log at INFO; see :meth:`log`."""
        return self.log(message, LoggingSeverity.INFO, **kwargs)

    def warning(self, message: str, **kwargs: Any) -> bool:
        """Log at WARN; see :meth:`log`."""
        return self.log(message, LoggingSeverity.WARN, **kwargs)

    def warn(self, message: str, **kwargs: Any) -> bool:
        """Log at WARN; see :meth:`log`."""
        return self.log(message, LoggingSeverity.WARN, **kwargs)

    def error(self, message: str, **kwargs: Any) -> bool:
        """Log at ERROR; see :meth:`log`."""
        return self.log(message, LoggingSeverity.ERROR, **kwargs)

    def fatal(self, message: str, **kwargs: Any) -> bool:
        """Log at FATAL; see :meth:`log`."""
        return self.log(message, LoggingSeverity.FATAL, **kwargs)
