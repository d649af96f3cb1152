# SPDX-License-Identifier: Apache-2.0
"""Futures and tasks."""

from __future__ import annotations

import inspect
import sys
import threading
import warnings
import weakref
from collections.abc import Callable, Generator
from typing import Any


class _Unretrieved:
    """An exception that nobody has asked for yet: told when it goes.

    Futures themselves have no ``__del__``. They go all the time, and Python would swallow, with a
    traceback, the KeyboardInterrupt of a signal that comes while it calls that.
    """

    def __init__(self, exception: BaseException) -> None:
        self.exception = exception
        self.fetched = False

    def __del__(self) -> None:
        if not self.fetched:
            print(f"The following exception was never retrieved: {self.exception}", file=sys.stderr)


class Future:
    """A result to come.

    Done callbacks run in the executor when the future has one, else at once.
    """

    def __init__(self, *, executor: Any = None) -> None:
        self._done = False
        self._cancelled = False
        self._result: Any = None
        self._raised: _Unretrieved | None = None
        self._callbacks: list[Callable[[Future], Any]] = []
        self._lock = threading.Lock()
        self._executor: weakref.ref[Any] | None = None
        self._set_executor(executor)

    def __await__(self) -> Generator[None, None, Any]:
        while not self._done:
            yield
        return self.result()

    def cancel(self) -> None:
        """Ask for the work to be dropped; has no effect once done."""
        with self._lock:
            if not self._done:
                self._cancelled = True
        self._schedule_or_invoke_done_callbacks()

    def cancelled(self) -> bool:
        """Whether :meth:`cancel` came before the result."""
        return self._cancelled

    def done(self) -> bool:
        """Whether there is a result or an exception."""
        return self._done

    def result(self) -> Any:
        """The result (None before it is done), or the exception raised."""
        exception = self.exception()
        if exception is not None:
            raise exception
        return self._result

    def exception(self) -> BaseException | None:
        """The exception, if that is how it ended."""
        if self._raised is None:
            return None
        self._raised.fetched = True
        return self._raised.exception

    def set_result(self, result: Any) -> None:
        """Finish with a result."""
        with self._lock:
            self._result = result
            self._done = True
            self._cancelled = False
        self._schedule_or_invoke_done_callbacks()

    def set_exception(self, exception: BaseException) -> None:
        """Finish with an exception."""
        with self._lock:
            self._raised = _Unretrieved(exception)
            self._done = True
            self._cancelled = False
        self._schedule_or_invoke_done_callbacks()

    def _get_executor(self) -> Any:
        return self._executor() if self._executor is not None else None

    def _set_executor(self, executor: Any) -> None:
        with self._lock:
            self._executor = None if executor is None else weakref.ref(executor)

    def _schedule_or_invoke_done_callbacks(self) -> None:
        with self._lock:
            executor = self._get_executor()
            callbacks, self._callbacks = self._callbacks, []
        for callback in callbacks:
            if executor is not None:
                executor.create_task(callback, self)
                continue
            try:
                callback(self)
            except Exception as error:
                # The remaining callbacks must still be called.
                warnings.warn(f"Unhandled exception in done callback: {error}", stacklevel=3)

    def add_done_callback(self, callback: Callable[[Future], Any]) -> None:
        """Have `callback` called with this future when it is done, at once if it is already."""
        with self._lock:
            if not self._done:
                self._callbacks.append(callback)
                return
            executor = self._get_executor()
        if executor is not None:
            executor.create_task(callback, self)
        else:
            callback(self)


class Task(Future):
    """A function or coroutine that an executor runs; a coroutine is resumed until it ends."""

    def __init__(
        self,
        handler: Callable[..., Any] | Any,
        args: Any = None,
        kwargs: Any = None,
        executor: Any = None,
    ) -> None:
        super().__init__(executor=executor)
        self._args = () if args is None else args
        self._kwargs = {} if kwargs is None else kwargs
        self._handler = handler
        if inspect.iscoroutinefunction(handler):
            self._handler = handler(*self._args, **self._kwargs)
        self._executing = False
        #: handed out by an executor and not run since
        self._queued = False
        self._task_lock = threading.Lock()

    def __call__(self) -> None:
        """Run, or resume, unless another thread does."""
        if self._done or self._executing or not self._task_lock.acquire(blocking=False):
            return
        try:
            if self._done:
                return
            self._executing = True
            try:
                if inspect.iscoroutine(self._handler):
                    try:
                        self._handler.send(None)
                    except StopIteration as end:
                        self.set_result(end.value)
                else:
                    self.set_result(self._handler(*self._args, **self._kwargs))
            except Exception as error:
                self.set_exception(error)
            self._executing = False
            self._queued = False
            if self._done:
                self._handler = self._args = self._kwargs = None
        finally:
            self._task_lock.release()

    def executing(self) -> bool:
        """Whether the task runs at this moment."""
        return self._executing
