# SPDX-License-Identifier: Apache-2.0
"""What subscriptions have in common with everything else that is fed by a reader (services,
clients).
"""

from __future__ import annotations

import inspect
from collections import deque
from collections.abc import Callable
from typing import Any

from embedded_ros.transport import Reader, Sample

from ..exceptions import InvalidHandle

#: what an executor runs: a coroutine function without arguments
Work = Callable[[], Any]


class QueuedEntity:
    """Moves samples from the middleware into a queue of its own as soon as they arrive.

    The executor drains all readers after every wake and runs :meth:`take_work` when the callback
    group is free; so a busy group leaves nothing in the middleware that would wake the executor
    again and again.
    """

    callback_group: Any

    def __init__(self, reader: Reader, depth: int | None) -> None:
        self._reader: Reader | None = reader
        self._queue: deque[Sample] = deque(maxlen=depth)
        self._executor_event = False

    @property
    def handle(self) -> Reader:
        """The reader.

        :raises InvalidHandle: the entity was destroyed.
        """
        if self._reader is None:
            raise InvalidHandle("cannot use Destroyable because destruction was requested")
        return self._reader

    @property
    def reader(self) -> Reader | None:
        """The reader, None once destroyed."""
        return self._reader

    def drain(self) -> None:
        """Fetch what has arrived."""
        reader = self._reader
        if reader is not None:
            samples = reader.take(256)
            if samples:
                self._queue.extend(samples)

    def has_work(self) -> bool:
        """Whether something waits to be taken."""
        return bool(self._queue)

    def take_work(self) -> Work | None:
        """Take the oldest sample and return what is to be run for it, or None when it came to
        nothing.
        """
        raise NotImplementedError

    def close_reader(self) -> None:
        """Leave the topic and drop what was queued."""
        if self._reader is not None:
            self._reader.close()
            self._reader = None
        self._queue.clear()


async def await_or_execute(callback: Callable[..., Any], *args: Any) -> Any:
    """Call a function, or await a coroutine function."""
    result = callback(*args)
    if inspect.iscoroutine(result):
        return await result
    return result
