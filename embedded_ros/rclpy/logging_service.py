# SPDX-License-Identifier: Apache-2.0
"""The services through which others read and set logger levels."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcl_interfaces.msg import LoggerLevel, SetLoggerLevelsResult
from rcl_interfaces.srv import GetLoggerLevels, SetLoggerLevels

from .logging import get_logger_level, set_logger_level

if TYPE_CHECKING:
    from .node import Node


class LoggingService:
    """Serves ``~/get_logger_levels`` and ``~/set_logger_levels``. Nodes created with
    ``enable_logger_service=True`` have one; the levels are those of the whole process.
    """

    def __init__(self, node: Node) -> None:
        name = node.get_name()
        node.create_service(GetLoggerLevels, f"{name}/get_logger_levels", self._get)
        node.create_service(SetLoggerLevels, f"{name}/set_logger_levels", self._set)

    @staticmethod
    def _get(request: Any, response: Any) -> Any:
        response.levels = [
            LoggerLevel(name=name, level=get_logger_level(name)) for name in request.names
        ]
        return response

    @staticmethod
    def _set(request: Any, response: Any) -> Any:
        for level in request.levels:
            result = SetLoggerLevelsResult(successful=True)
            try:
                set_logger_level(level.name, level.level, detailed_error=True)
            except ValueError:
                result.successful = False
                result.reason = "Failed reason: Invalid logger level."
            response.results.append(result)
        return response
