# SPDX-License-Identifier: Apache-2.0
"""Publishes what a node logs on /rosout."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

from embedded_ros.interfaces.registry import registry

from ..duration import Duration
from ..qos import DurabilityPolicy, QoSProfile
from . import rcutils_logger
from .log_filters import CallerId
from .logging_severity import LoggingSeverity

if TYPE_CHECKING:
    from ..node import Node

_QOS = QoSProfile(
    depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL, lifespan=Duration(seconds=10)
)


class Rosout:
    """The sink of a node's logger and of the loggers below it."""

    def __init__(self, node: Node) -> None:
        self._message: Any = registry.message_class("rcl_interfaces/msg/Log")
        self._stamp: Any = registry.message_class("builtin_interfaces/msg/Time")
        self._node = node
        self._serialize = registry.serializer(self._message)
        # Not among the node's publishers, as in ROS.
        self._writer = node._ros_open(self._message, "/rosout", _QOS, writer=True)
        self._busy = threading.local()
        sinks = rcutils_logger.sinks.setdefault(node.get_logger().name, [])
        # Nodes of one name share the list; each publishes, as in ROS.
        sinks.append(self._publish)

    def _publish(
        self, name: str, severity: LoggingSeverity, message: str, caller: CallerId, stamp: int
    ) -> None:
        if getattr(self._busy, "inside", False):
            return
        self._busy.inside = True
        try:
            seconds, nanoseconds = divmod(stamp, 10**9)
            log = self._message(
                stamp=self._stamp(sec=seconds, nanosec=nanoseconds),
                level=int(severity),
                name=name,
                msg=message,
                file=caller.file_path,
                function=caller.function_name,
                line=caller.line_number,
            )
            self._writer.write(self._serialize(log))
        except Exception:
            # Logging goes on at the console while the middleware goes down.
            pass
        finally:
            self._busy.inside = False

    def close(self) -> None:
        """Publish no more."""
        for name, sinks in list(rcutils_logger.sinks.items()):
            if self._publish in sinks:
                sinks.remove(self._publish)
            if not sinks:
                del rcutils_logger.sinks[name]
        self._node._ros_announce(writer=self._writer, remove=True)
        self._writer.close()
