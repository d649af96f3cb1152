# SPDX-License-Identifier: Apache-2.0
"""Logging by name."""

from __future__ import annotations

import os
from pathlib import Path

from .impl import rcutils_logger
from .impl.logging_severity import LoggingSeverity
from .impl.rcutils_logger import RcutilsLogger

__all__ = [
    "LoggingSeverity",
    "clear_config",
    "get_logger",
    "get_logger_effective_level",
    "get_logger_level",
    "get_logging_directory",
    "get_logging_severity_from_string",
    "initialize",
    "set_logger_level",
    "shutdown",
]

_root_logger = RcutilsLogger()


def get_logger(name: str) -> RcutilsLogger:
    """The logger of that name.

    :raises ValueError: the name is empty.
    """
    if not name:
        raise ValueError("Logger name must not be empty.")
    return _root_logger.get_child(name)


def initialize() -> None:
    """Start logging; there is nothing to start here."""


def shutdown() -> None:
    """Forget the levels that were set."""
    rcutils_logger.clear_levels()


def clear_config() -> None:
    """Forget the levels that were set."""
    rcutils_logger.clear_levels()


def set_logger_level(name: str, level: int | LoggingSeverity, detailed_error: bool = False) -> None:
    """Set the level of a logger; the empty name is the root."""
    rcutils_logger.set_level(name, LoggingSeverity(level))


def get_logger_effective_level(name: str) -> LoggingSeverity:
    """The level that counts for a logger."""
    return rcutils_logger.effective_level(name)


def get_logger_level(name: str) -> LoggingSeverity:
    """The level set for exactly this logger, UNSET if none."""
    return rcutils_logger.own_level(name)


def get_logging_severity_from_string(log_severity: str) -> LoggingSeverity:
    """The level of that name, in any case.

    :raises RuntimeError: there is none.
    """
    try:
        return LoggingSeverity[log_severity.upper()]
    except KeyError:
        raise RuntimeError(
            f"failed to get the severity level from the string {log_severity!r}"
        ) from None


def get_logging_directory() -> Path:
    """Where ROS keeps log files (this runtime writes none): ROS_LOG_DIR, or log in ROS_HOME."""
    if os.environ.get("ROS_LOG_DIR"):
        return Path(os.environ["ROS_LOG_DIR"]).expanduser()
    return Path(os.environ.get("ROS_HOME") or "~/.ros").expanduser() / "log"
