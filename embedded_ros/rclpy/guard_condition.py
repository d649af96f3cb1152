# SPDX-License-Identifier: Apache-2.0
"""Guard conditions: callbacks that other threads can cause to run."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from .destroyable import Destroyable
from .impl.queued import Work, await_or_execute
from .utilities import get_default_context


class GuardCondition(Destroyable):
    """Runs its callback in the executor after :meth:`trigger`."""

    def __init__(
        self, callback: Callable[[], Any] | None, callback_group: Any, context: Any = None
    ) -> None:
        self._context = get_default_context() if context is None else context
        self.callback = callback
        self.callback_group = callback_group
        self._executor_event = False
        self._executor_triggered = False
        self._wake: Callable[[], None] | None = None

    def trigger(self) -> None:
        """Have the callback run once, from any thread.

        :raises InvalidHandle: the guard condition was destroyed.
        """
        self.handle._executor_triggered = True
        if self._wake is not None:
            self._wake()

    trigger_guard_condition = trigger

    def has_work(self) -> bool:
        """Whether it was triggered."""
        return self._executor_triggered

    def take_work(self) -> Work | None:
        """Forget the trigger, and return what is to be run."""
        self._executor_triggered = False
        return None if self.callback is None else partial(await_or_execute, self.callback)
