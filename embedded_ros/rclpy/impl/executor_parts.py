# SPDX-License-Identifier: Apache-2.0
"""How executors say why they stopped waiting, and what they count."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from embedded_ros.transport import Reader, Waiter

from .._rclpy_pybind11 import RCLError
from ..event_handler import EventHandler
from ..exceptions import InvalidHandle
from ..timer import Timer
from .service_ends import ServiceEnd
from .wait_set import WaitSet

if TYPE_CHECKING:
    from ..node import Node


class TimeoutException(Exception):
    """A timeout passed."""


class ShutdownException(Exception):
    """The executor was shut down."""


class ExternalShutdownException(Exception):
    """The context was shut down, by a signal or another thread."""

    def __init__(self) -> None:
        super().__init__("context was shut down")


class ConditionReachedException(Exception):
    """The future that was waited for is done."""


class TimeoutObject:
    """A timeout that may be shortened while waiting for it, s."""

    def __init__(self, timeout: float) -> None:
        self.timeout = timeout


class WorkTracker:
    """Knows which threads execute something; a coroutine that gave way is not executed."""

    def __init__(self) -> None:
        self._threads: list[int] = []
        self._condition = threading.Condition()

    def run(self, task: Callable[[], None]) -> None:
        """Run a task or a step of it."""
        with self._condition:
            self._threads.append(threading.get_ident())
        try:
            task()
        finally:
            with self._condition:
                self._threads.remove(threading.get_ident())
                self._condition.notify_all()

    def wait(self, timeout_sec: float | None = None) -> bool:
        """Wait until no thread but the calling one executes anything; False after the timeout."""
        me = threading.get_ident()
        if timeout_sec is not None and timeout_sec < 0.0:
            timeout_sec = None
        with self._condition:
            return self._condition.wait_for(lambda: set(self._threads) <= {me}, timeout_sec)


class Entities:
    """What the executor looks after, in the order in which it serves it, so that a turn need only
    look at timers, guard conditions and what has messages.
    """

    def __init__(self, changes: int, nodes: list[Node]) -> None:
        self.changes = changes
        self.nodes = nodes
        self.waiter: Waiter | None = None
        waitables = [(waitable, node) for node in nodes for waitable in node.waitables]
        #: looked at now and then only
        self.events = [pair for pair in waitables if isinstance(pair[0], EventHandler)]
        self.waitables = [pair for pair in waitables if not isinstance(pair[0], EventHandler)]
        self.asked: list[tuple[Any, Node]] = []
        self.wait_set = WaitSet()
        self.foreign_readers: set[Reader] = set()
        #: all but waitables
        self.others: list[tuple[Any, Node]] = []
        self.readers: dict[Reader, int] = {}
        #: places in `others` of what may have messages, and of timers and guard conditions
        self.queued: set[int] = set()
        self._always: list[int] = []
        for node in nodes:
            for entity in (*node.timers, *node.queued_entities(), *node.guards):
                place = len(self.others)
                self.others.append((entity, node))
                reader = getattr(entity, "reader", None)
                if reader is None:
                    self._always.append(place)
                else:
                    self.readers[reader] = place
                    self.queued.add(place)
        self.timers = [entity for entity, _ in self.others if isinstance(entity, Timer)]
        self._service_ends = [end for end, _ in self.others if isinstance(end, ServiceEnd)]

    def fill_wait_set(self, can_execute: Callable[[Any], bool], wake: Callable[[], None]) -> None:
        """Ask the waitables that may run what to wait for."""
        self.wait_set.clear_entities()
        self.asked = [pair for pair in self.waitables if can_execute(pair[0])]
        for waitable, _ in self.asked:
            waitable.add_to_wait_set(self.wait_set)
        for guard in self.wait_set.members("guard_condition"):
            guard._wake = wake

    def waiting(self) -> list[Any]:
        """The entities that have messages."""
        self.queued = {place for place in self.queued if self.others[place][0].has_work()}
        return [self.others[place][0] for place in self.queued]

    def set_readers(self, waiter: Waiter) -> None:
        """Have the waiter wait for what is here."""
        foreign = {member.reader for member in self.wait_set.queued()} - {None}
        if self.waiter is not waiter or self.foreign_readers != foreign:
            self.waiter, self.foreign_readers = waiter, foreign
            waiter.set_readers(foreign.union(self.readers))

    def look_after(self) -> None:
        """Have services and clients see to what waits for others."""
        for end in self._service_ends:
            with suppress(InvalidHandle, RCLError):  # another thread has just destroyed it
                end.look_after()

    def candidates(self) -> list[int]:
        """The places of what may be ready."""
        return sorted((*self._always, *self.queued))
