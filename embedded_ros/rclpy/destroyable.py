# SPDX-License-Identifier: Apache-2.0
"""What publishers, subscriptions, timers, services and the like have in common."""

from __future__ import annotations

from typing import Any

from ._rclpy_pybind11 import RCLError
from .exceptions import InvalidHandle


class Destroyable:
    """Something that is given up once. It is its own ``handle``, for ``with x.handle:``."""

    _ros_destroyed = False
    #: its context was shut down: whatever needs no middleware still works
    _ros_orphaned = False

    @property
    def handle(self) -> Any:
        """This object.

        :raises InvalidHandle: it was destroyed.
        """
        if self._ros_destroyed and not self._ros_orphaned:
            raise InvalidHandle("cannot use Destroyable because destruction was requested")
        return self

    def __enter__(self) -> Any:
        return self.handle

    def __exit__(self, *args: object) -> None:
        pass

    def destroy(self) -> None:
        """Give it up."""
        self._ros_destroyed = True

    def destroy_when_not_in_use(self) -> None:
        """Give it up."""
        self.destroy()


class _Ended:
    """Stands in for the endpoints that a context took along."""

    guid = b""

    def close(self) -> None:
        pass

    def take(self, limit: int) -> list[Any]:
        return []

    def __getattr__(self, name: str) -> Any:
        raise RCLError("the context of this entity was shut down")


ENDED = _Ended()
