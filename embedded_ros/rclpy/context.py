# SPDX-License-Identifier: Apache-2.0
"""Contexts: what lies between init and shutdown."""

from __future__ import annotations

import atexit
import contextlib
import inspect
import os
import sys
import threading
import weakref
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from embedded_ros.transport import Participant, open_participant
from embedded_ros.transport.graph import Graph

from ._rclpy_pybind11 import RCLError
from .destroyable import Destroyable
from .impl.arguments import RosArguments, parse_arguments

if TYPE_CHECKING:
    from .node import Node

#: contexts between init and shutdown, for the signal handlers
live_contexts: weakref.WeakSet[Context] = weakref.WeakSet()

_MAX_DOMAIN = 232


def _domain_from_environment() -> int:
    text = os.environ.get("ROS_DOMAIN_ID", "").strip() or "0"
    if not text.isdigit() or int(text) > _MAX_DOMAIN:
        raise RCLError(
            f"ROS_DOMAIN_ID is {text!r}; it must be a whole number from 0 to {_MAX_DOMAIN}"
        )
    return int(text)


class ContextHandle(Destroyable):
    """An initialised context."""

    def __init__(self, context: Context) -> None:
        self.context = context

    def ok(self) -> bool:
        """Whether it is not shut down."""
        return self.context.ok()


class Context:
    """One use of ROS: command line, domain participant, nodes.

    Not to be used again after shutdown.
    """

    def __init__(self) -> None:
        # Re-entrant: a signal handler may shut the context down on top of any of its methods.
        self._lock = threading.RLock()
        self._callbacks: list[Any] = []
        self._initialized = False
        self._is_ok = False
        self._closed = False
        self._participant: Participant | None = None
        self._graph: Graph | None = None
        self._domain_id = 0
        self.arguments = RosArguments()
        self.non_ros_args: list[str] = []
        self._wakers: weakref.WeakSet[Any] = weakref.WeakSet()
        self.nodes: weakref.WeakSet[Node] = weakref.WeakSet()

    @property
    def handle(self) -> ContextHandle | None:
        """What stands for the context once it is initialised."""
        return ContextHandle(self) if self._initialized else None

    def init(
        self,
        args: list[str] | None = None,
        *,
        initialize_logging: bool = True,
        domain_id: int | None = None,
    ) -> None:
        """Join the ROS domain.

        :param args: command line, default sys.argv.
        :param domain_id: default ROS_DOMAIN_ID or 0.
        :raises RuntimeError: the context is initialised already, the domain is out of range, or it
            cannot be joined with the discovery settings of the environment.
        """
        from .impl.rcutils_logger import configure

        with self._lock:
            if domain_id is not None and domain_id < 0:
                raise RuntimeError(f"Domain id ({domain_id}) should not be lower than zero.")
            if self._initialized:
                raise RuntimeError("Context.init() must only be called once")
            self.arguments, self.non_ros_args = parse_arguments(sys.argv if args is None else args)
            if domain_id is not None and domain_id > _MAX_DOMAIN:
                raise RCLError(f"domain id {domain_id} is above {_MAX_DOMAIN}")
            self._domain_id = _domain_from_environment() if domain_id is None else domain_id
            self._initialized = self._is_ok = True
            try:
                # Not only with the first node, so that a bad setting is an error here.
                self._participant = open_participant(self._domain_id)
            except Exception:
                self._initialized = self._is_ok = False
                raise
            if initialize_logging:
                configure(self.arguments)
            live_contexts.add(self)

    @property
    def participant(self) -> Participant:
        """The DDS participant.

        :raises RCLError: the context is shut down.
        """
        with self._lock:
            self.check()
            assert self._participant is not None
            return self._participant

    def check(self) -> None:
        """Check that the context can be used.

        :raises RCLError: it was not initialised, or is shut down.
        """
        if not self._is_ok or self._participant is None:
            raise RCLError(
                "the given context is not valid, either rcl_init() was not called or it was "
                "shut down"
            )

    @property
    def graph(self) -> Graph:
        """The ROS graph as seen from here."""
        with self._lock:
            if self._graph is None:
                self._graph = Graph(self.participant)
            return self._graph

    def ok(self) -> bool:
        """Whether the context is initialised and not shut down."""
        return self._is_ok

    def add_waker(self, waker: Any) -> None:
        """Have ``waker.wake()`` called at shutdown, signal or not."""
        self._wakers.add(waker)

    def _invalidate(self) -> None:
        """End the context as far as a signal handler may: no locks of others, no callbacks, nothing
        closed.
        """
        self._is_ok = False
        for waker in list(self._wakers):
            waker.wake()

    def _end(self) -> None:
        was_ok = self._is_ok
        self._invalidate()
        if was_ok:
            callbacks, self._callbacks = self._callbacks, []
            for reference in callbacks:
                callback = reference() if isinstance(reference, weakref.WeakMethod) else reference
                if callback is not None:
                    callback()
        self._close()

    def _close(self) -> None:
        if self._closed:
            return
        self._closed = True
        live_contexts.discard(self)
        for node in list(self.nodes):
            with contextlib.suppress(Exception):
                node._ros_release()
        if self._graph is not None:
            self._graph.close()
        if self._participant is not None:
            self._participant.close()
        self._graph = self._participant = None

    def shutdown(self) -> None:
        """End the context.

        :raises RuntimeError: it was never initialised, or is shut down already.
        """
        with self._lock:
            if not self._initialized:
                raise RuntimeError("Context must be initialized before it can be shutdown")
            if not self._is_ok:
                self._close()
                raise RCLError(
                    "failed to shutdown: rcl_shutdown already called on the given context"
                )
            self._end()

    def try_shutdown(self) -> None:
        """End the context unless that has happened already."""
        with self._lock:
            if self._initialized:
                self._end()

    def destroy(self) -> None:
        """Give up everything the context holds."""
        self.try_shutdown()

    def on_shutdown(self, callback: Callable[[], None]) -> None:
        """Have ``callback`` called at shutdown; at once when that is past.

        :raises TypeError: ``callback`` cannot be called.
        """
        if not callable(callback):
            raise TypeError(f"callback should be a callable, got {type(callback)}")
        with self._lock:
            if self._initialized and not self._is_ok:
                callback()
            elif inspect.ismethod(callback):
                self._callbacks.append(weakref.WeakMethod(callback))
            else:
                self._callbacks.append(callback)

    def get_domain_id(self) -> int:
        """The domain of this context.

        :raises RuntimeError: it is not initialised.
        """
        if not self._initialized:
            raise RuntimeError("Context must be initialized before it can have a domain id")
        return self._domain_id

    def __enter__(self) -> Context:
        self.init()
        return self

    def __exit__(self, *args: object) -> None:
        self.try_shutdown()


def _close_all() -> None:
    """Leave the domain in order: endpoints that vanish with the process keep haunting the others
    for seconds.
    """
    for context in list(live_contexts):
        context.try_shutdown()


atexit.register(_close_all)
