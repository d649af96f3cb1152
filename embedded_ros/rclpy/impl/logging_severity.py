# SPDX-License-Identifier: Apache-2.0
"""Log levels."""

from enum import IntEnum


class LoggingSeverity(IntEnum):
    """How bad it is; UNSET inherits from the parent logger."""

    UNSET = 0
    DEBUG = 10
    INFO = 20
    WARN = 30
    ERROR = 40
    FATAL = 50
