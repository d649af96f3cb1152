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

from ..destroyable import Destroyable

#: what an executor runs: a coroutine function without arguments
Work = Callable[[], Any]


class QueuedEntity(Destroyable):
    """Moves samples from the middleware into a queue of its own as soon as they arrive.

    The executor drains all readers after every wake and runs :meth:`take_work` when the callback
    group is free; so a busy group leaves nothing in the middleware that would wake the executor
    again and again.
    """

    callback_group: Any

    def __init__(self, reader: Reader, depth: int | None) -> None:
        self._endpoint = reader
        self._queue: deque[Sample] = deque(maxlen=depth)
        self._executor_event = False

    @property
    def reader(self) -> Reader | None:
        """The reader, None once destroyed."""
        return None if self._ros_destroyed else self._endpoint

    def drain(self) -> None:
        """Fetch what has arrived."""
        self._queue.extend(self._endpoint.take(256))

    def is_ready(self) -> bool:
        """Whether something has arrived, for a wait set."""
        self.drain()
        return bool(self._queue)

    def has_work(self) -> bool:
        """Whether something waits to be taken."""
        return bool(self._queue)

    def take_work(self) -> Work | None:
        """Take the oldest sample and return what is to be run for it, or None when it came to
        nothing.
        """
        raise NotImplementedError

    def destroy(self) -> None:
        """Leave the topic and drop what was queued."""
        super().destroy()
        self._endpoint.close()
        self._queue.clear()


async def await_or_execute(callback: Callable[..., Any], *args: Any) -> Any:
    """Call a function, or await a coroutine function."""
    result = callback(*args)
    if inspect.iscoroutine(result):
        return await result
    return result
