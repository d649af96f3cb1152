# SPDX-License-Identifier: Apache-2.0
"""Messages recorded as an MCAP file, as rosbag2 writes them: for Foxglove and `ros2 bag play`."""

from __future__ import annotations

import time
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import yaml

from ccr_ros.model.errors import CcrError, InvalidFile, InvalidValue

from .message_text import definition, type_name

if TYPE_CHECKING:
    from rclpy.node import Node
    from rclpy.qos import QoSProfile

SUFFIX = ".mcap"
_NEVER = {"sec": 9223372036, "nsec": 854775807}  # rmw's infinite duration


class MissingMcap(CcrError):
    """A recording was asked for, and mcap, an optional dependency, is not installed."""

    def __init__(self) -> None:
        super().__init__(
            "recording needs mcap, which is not installed: install it (pip install mcap, or this"
            " package with its extra 'record')"
        )


def checked_bag_path(path: str | Path) -> Path:
    """Return the path if a file could be recorded there; called before any work is done.

    Raises:
        MissingMcap: The library is not installed.
        InvalidValue: It does not end in .mcap.
        InvalidFile: It is a directory, or its directory does not exist.
    """
    out = Path(path)
    if out.suffix != SUFFIX:
        raise InvalidValue("--record", str(path), f"a name that ends in {SUFFIX}")
    if out.is_dir():
        raise InvalidFile(path, "cannot be written: is a directory")
    if not out.parent.is_dir():
        raise InvalidFile(path, f"cannot be written: there is no directory {out.parent}")
    try:
        import mcap.writer  # noqa: F401
    except ImportError:
        raise MissingMcap from None
    return out


class BagWriter:
    """Writes messages as they come, each with its type and QoS; close it, or the file is cut off.

    Args:
        path: The file; replaced if it is there.

    Attributes:
        count: Messages written.

    Raises:
        MissingMcap, InvalidValue, InvalidFile: As `checked_bag_path`, or the file cannot be made.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = checked_bag_path(path)
        from mcap.writer import CompressionType, Writer

        try:
            self._file = self.path.open("wb")
        except OSError as error:
            raise InvalidFile(path, f"cannot be written: {error.strerror or error}") from None
        self._writer = Writer(self._file, compression=CompressionType.ZSTD)
        self._writer.start(profile="ros2", library="ccr_ros")
        self._schemas: dict[type, int] = {}
        self._channels: dict[str, int] = {}
        self.count = 0

    def __enter__(self) -> BagWriter:
        """Return itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close."""
        self.close()

    def add_topic(self, topic: str, kind: type, qos: QoSProfile) -> None:
        """Declare a topic before its first message.

        Args:
            topic: Its full name.
            kind: Class of its messages.
            qos: What its publishers offer; it is played back with it.
        """
        if kind not in self._schemas:
            self._schemas[kind] = self._writer.register_schema(
                name=type_name(kind), encoding="ros2msg", data=definition(kind).encode()
            )
        self._channels[topic] = self._writer.register_channel(
            topic=topic,
            message_encoding="cdr",
            schema_id=self._schemas[kind],
            metadata={"offered_qos_profiles": yaml.safe_dump([_offered(qos)], sort_keys=False)},
        )

    def write(self, topic: str, data: bytes) -> None:
        """Write a serialized message (CDR) of a topic that was added, as of now."""
        now = time.time_ns()
        self._writer.add_message(
            channel_id=self._channels[topic], log_time=now, publish_time=now, data=data
        )
        self.count += 1

    def close(self) -> None:
        """Write the index and close the file; a second time does nothing."""
        if not self._file.closed:
            self._writer.finish()
            self._file.close()


def record_topic(node: Node, writer: BagWriter, kind: type, topic: str, qos: QoSProfile) -> None:
    """Subscribe to a topic and write what comes, undecoded.

    Args:
        node: Subscribes.
        writer: Writes.
        kind: Class of the messages.
        topic: Name, relative to the node's namespace or full.
        qos: What publishers offer, and what is asked for.
    """
    name = node.resolve_topic_name(topic)
    writer.add_topic(name, kind, qos)
    node.create_subscription(kind, topic, lambda data: writer.write(name, data), qos, raw=True)


def _offered(qos: QoSProfile) -> dict[str, Any]:
    """A QoS profile in the form of rosbag2's metadata from version 9 (Jazzy) on."""
    return {
        "history": qos.history.name.lower(),
        "depth": qos.depth,
        "reliability": qos.reliability.name.lower(),
        "durability": qos.durability.name.lower(),
        "deadline": dict(_NEVER),
        "lifespan": dict(_NEVER),
        "liveliness": "automatic",
        "liveliness_lease_duration": dict(_NEVER),
        "avoid_ros_namespace_conventions": False,
    }
