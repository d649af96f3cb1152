# SPDX-License-Identifier: Apache-2.0
"""What publishers, subscriptions, timers, services and the like have in common."""

from __future__ import annotations

from typing import Any

from .exceptions import InvalidHandle


class Destroyable:
    """Something that is given up once. It is its own ``handle``, for ``with x.handle:``."""

    _destroyed = False

    @property
    def handle(self) -> Any:
        """This object.

        :raises InvalidHandle: it was destroyed.
        """
        if self._destroyed:
            raise InvalidHandle("cannot use Destroyable because destruction was requested")
        return self

    def __enter__(self) -> Any:
        return self.handle

    def __exit__(self, *args: object) -> None:
        pass

    def destroy(self) -> None:
        """Give it up."""
        self._destroyed = True

    def destroy_when_not_in_use(self) -> None:
        """Give it up."""
        self.destroy()
