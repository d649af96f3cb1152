# SPDX-License-Identifier: Apache-2.0
"""Executors: they wait for work of their nodes and run the callbacks."""

from __future__ import annotations

import os
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

from embedded_ros.transport import Waiter

from .event_handler import POLL_PERIOD
from .exceptions import InvalidHandle
from .impl.executor_parts import (
    ConditionReachedException,
    Entities,
    ExternalShutdownException,
    ShutdownException,
    TimeoutException,
    TimeoutObject,
    WorkTracker,
)
from .impl.queued import Work, await_or_execute
from .task import Future, Task
from .utilities import get_default_context, timeout_sec_to_nsec

if TYPE_CHECKING:
    from .node import Node

__all__ = [
    "ConditionReachedException",
    "Executor",
    "ExternalShutdownException",
    "MultiThreadedExecutor",
    "ShutdownException",
    "SingleThreadedExecutor",
    "TimeoutException",
    "TimeoutObject",
    "await_or_execute",
]


#: how often news of the graph are taken in, s; what nobody takes piles up
GRAPH_PERIOD = 1.0


class Executor:
    """Base of executors; a subclass defines :meth:`spin_once` and
    :meth:`spin_once_until_future_complete`.
    """

    def __init__(self, *, context: Any = None) -> None:
        self._context = get_default_context() if context is None else context
        self._nodes: list[Node] = []
        self._nodes_lock = threading.RLock()
        self._tasks: list[tuple[Task, Any, Any]] = []
        self._tasks_lock = threading.Lock()
        self._waiter: Waiter | None = self._context.participant.create_waiter()
        self._is_shutdown = False
        self._work_tracker = WorkTracker()
        self._work: Iterator[tuple[Task, Any, Any]] | None = None
        self._work_arguments: Any = None
        self._changes = 0
        self._entities: Entities | None = None
        self._next_poll = self._next_graph_poll = 0.0
        self._context.add_waker(self)

    @property
    def context(self) -> Any:
        """The context of the executor."""
        return self._context

    def create_task(self, callback: Callable[..., Any] | Any, *args: Any, **kwargs: Any) -> Task:
        """Have a function or coroutine run while spinning; the task is a future of its result."""
        task = Task(callback, args, kwargs, executor=self)
        with self._tasks_lock:
            self._tasks.append((task, None, None))
        self._interrupt()
        return task

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        """Stop, and wait for callbacks that are running; False when they outlast the timeout."""
        self._is_shutdown = True
        self.wake()
        if not self._work_tracker.wait(timeout_sec):
            return False
        with self._nodes_lock:
            self._nodes = []
        waiter, self._waiter = self._waiter, None
        if waiter is not None:
            waiter.close()
        self._work = self._entities = None
        return True

    def add_node(self, node: Node) -> bool:
        """Take care of a node; it leaves the executor it was in. False when it is here already."""
        with self._nodes_lock:
            if node in self._nodes:
                return False
            self._nodes.append(node)
            node.executor = self  # type: ignore[assignment]
        self.wake()
        return True

    def remove_node(self, node: Node) -> None:
        """Take care of a node no longer."""
        with self._nodes_lock:
            if node in self._nodes:
                self._nodes.remove(node)
        self.wake()

    def wake(self) -> None:
        """Have the executor look for work again, and for entities that were added or removed."""
        self._changes += 1
        self._interrupt()

    def _interrupt(self) -> None:
        """Have the executor look for work again among what it knows."""
        waiter = self._waiter
        if waiter is not None:
            waiter.wake()

    def _progress(self) -> None:
        """An entity or callback group became free: threads of a pool tell the one that waits."""
        self._interrupt()

    def get_nodes(self) -> list[Node]:
        """The nodes in this executor."""
        with self._nodes_lock:
            return list(self._nodes)

    def spin(self) -> None:
        """Run callbacks until shutdown."""
        while self._context.ok() and not self._is_shutdown:
            self.spin_once()

    def spin_until_future_complete(self, future: Future, timeout_sec: float | None = None) -> None:
        """Run callbacks until ``future`` is done, the timeout passes or the context ends."""
        future.add_done_callback(lambda _: self._interrupt())
        end = None if timeout_sec is None or timeout_sec < 0 else time.monotonic() + timeout_sec
        left = None if end is None else TimeoutObject(timeout_sec or 0.0)
        while self._context.ok() and not future.done() and not self._is_shutdown:
            self.spin_once_until_future_complete(future, left)
            if end is not None and left is not None:
                left.timeout = end - time.monotonic()
                if left.timeout <= 0:
                    return

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Wait for one callback and run it; None or a negative timeout waits forever."""
        self._spin_once_impl(timeout_sec)

    def spin_once_until_future_complete(
        self, future: Future, timeout_sec: float | TimeoutObject | None = None
    ) -> None:
        """As :meth:`spin_once`, but return as soon as ``future`` is done."""
        self._spin_once_impl(timeout_sec, future.done)

    def _spin_once_impl(
        self,
        timeout_sec: float | TimeoutObject | None = None,
        wait_condition: Callable[[], bool] = lambda: False,
    ) -> None:
        raise NotImplementedError()

    def can_execute(self, entity: Any) -> bool:
        """Whether a callback of the entity may run now."""
        return not entity._executor_event and entity.callback_group.can_execute(entity)

    def _claim(self, entity: Any, node: Node) -> tuple[Task, Any, Any]:
        """A task that claims the callback group, takes the entity's work and runs it."""
        entity._executor_event = True

        async def run() -> None:
            group = entity.callback_group
            if self._is_shutdown or not group.beginning_execution(entity):
                entity._executor_event = False
                self._progress()
                return
            try:
                try:
                    work: Work | None = entity.take_work()
                except InvalidHandle:
                    # Destroyed between becoming ready and being run.
                    work = None
                entity._executor_event = False
                self._progress()
                if work is not None:
                    result = work()
                    if hasattr(result, "__await__"):
                        await result
            finally:
                entity._executor_event = False
                group.ending_execution(entity)
                self._progress()

        task = Task(run, executor=self)
        task._queued = True
        with self._tasks_lock:
            self._tasks.append((task, entity, node))
        return task, entity, node

    def _gather(self, nodes: list[Node]) -> Entities:
        """The entities of the nodes, gathered anew only after a change."""
        entities, changes = self._entities, self._changes
        if entities is None or entities.changes != changes or entities.nodes != nodes:
            entities = self._entities = Entities(changes, nodes)
        return entities

    def _ready(self, entities: Entities) -> Iterator[tuple[Task, Any, Any]]:
        """Claim and yield what is ready now, at most one callback per entity: events, then node by
        node timers, messages and guard conditions.
        """
        waitables = entities.asked
        entities.wait_set.look()
        if (now := time.monotonic()) >= self._next_poll:
            self._next_poll = now + POLL_PERIOD
            waitables = entities.events + waitables
            entities.look_after()
        for waitable, node in waitables:
            if self.can_execute(waitable) and waitable.is_ready(entities.wait_set):
                yield self._claim(waitable, node)
        for place in entities.candidates():
            entity, node = entities.others[place]
            if entity.has_work() and self.can_execute(entity):
                yield self._claim(entity, node)

    def _pending_tasks(self, nodes: list[Node]) -> Iterator[tuple[Task, Any, Any]]:
        """Tasks made by users and coroutines that gave way."""
        with self._tasks_lock:
            self._tasks = [entry for entry in self._tasks if not entry[0].done()]
            pending = list(self._tasks)
        for task, entity, node in reversed(pending):  # newest first, as rclpy does
            if not task._queued and not task.done() and (node is None or node in nodes):
                task._queued = True
                yield task, entity, node

    def _next_timer(self, entities: Entities) -> int | None:
        """Nanoseconds until the next timer that may run, or None."""
        soonest = None
        for timer in entities.timers + entities.wait_set.members("timer"):
            if timer._ros_destroyed or (timer.callback_group and not self.can_execute(timer)):
                continue
            left = timer.time_until_next_call()
            if left is not None and (soonest is None or left < soonest):
                soonest = left
        return soonest

    def _wait(self, entities: Entities, timeout: int | None) -> None:
        waiter = self._waiter
        if waiter is None:
            return
        entities.set_readers(waiter)
        for reader in waiter.wait(timeout):
            place = entities.readers.get(reader)
            if place is not None:
                entities.others[place][0].drain()
                entities.queued.add(place)
        if (now := time.monotonic()) >= self._next_graph_poll:
            self._next_graph_poll = now + GRAPH_PERIOD
            if (graph := self._context._graph) is not None:
                graph.keep_up()

    def _wait_for_ready_callbacks(
        self,
        timeout_sec: float | TimeoutObject | None = None,
        nodes: list[Node] | None = None,
        condition: Callable[[], bool] = lambda: False,
    ) -> Iterator[tuple[Task, Any, Any]]:
        timeout = timeout_sec.timeout if isinstance(timeout_sec, TimeoutObject) else timeout_sec
        limit = timeout_sec_to_nsec(timeout)
        end = None if limit < 0 else time.monotonic_ns() + limit
        found = False
        while not found and not self._is_shutdown and not condition():
            if not self._context.ok():
                raise ExternalShutdownException()
            used = self.get_nodes() if nodes is None else nodes
            for item in self._pending_tasks(used):
                found = True
                yield item
            entities = self._gather(used)
            entities.fill_wait_set(self.can_execute, self._interrupt)
            wait = self._next_timer(entities)
            if any(e.has_work() and self.can_execute(e) for e in entities.waiting()) or any(
                member.has_work() for member in entities.wait_set.queued()
            ):
                wait = 0
            if end is not None:
                left = max(end - time.monotonic_ns(), 0)
                wait = left if wait is None else min(wait, left)
            self._wait(entities, wait)
            if self._is_shutdown:
                raise ShutdownException()
            if not self._context.ok():
                raise ExternalShutdownException()
            for item in self._ready(entities):
                found = True
                yield item
            if not found and end is not None and time.monotonic_ns() >= end:
                raise TimeoutException()
        if self._is_shutdown:
            raise ShutdownException()
        if condition():
            raise ConditionReachedException()

    def wait_for_ready_callbacks(self, *args: Any, **kwargs: Any) -> tuple[Task, Any, Any]:
        """The next task to run, with its entity and node. Arguments: timeout_sec, nodes, condition.

        :raises TimeoutException: the timeout passed.
        :raises ShutdownException: the executor was shut down.
        :raises ExternalShutdownException: the context was shut down.
        :raises ConditionReachedException: the condition holds.
        """
        while True:
            if self._work is None or self._work_arguments != (args, kwargs):
                self._work_arguments = (args, kwargs)
                self._work = self._wait_for_ready_callbacks(*args, **kwargs)
            try:
                return next(self._work)
            except StopIteration:
                self._work = None

    def __enter__(self) -> Executor:
        return self

    def __exit__(self, *args: object) -> None:
        self.shutdown()


class SingleThreadedExecutor(Executor):
    """Runs callbacks in the thread that spins."""

    def _progress(self) -> None:
        pass

    def _spin_once_impl(
        self,
        timeout_sec: float | TimeoutObject | None = None,
        wait_condition: Callable[[], bool] = lambda: False,
    ) -> None:
        try:
            task, _, _ = self.wait_for_ready_callbacks(timeout_sec, None, wait_condition)
        except (ShutdownException, TimeoutException, ConditionReachedException):
            return
        self._work_tracker.run(task)
        if task.done():
            task.result()


class MultiThreadedExecutor(Executor):
    """Runs callbacks in a pool of threads."""

    def __init__(self, num_threads: int | None = None, *, context: Any = None) -> None:
        """Make a pool of ``num_threads`` threads; default: the CPUs this process may use."""
        super().__init__(context=context)
        if num_threads is None:
            affinity = getattr(os, "sched_getaffinity", None)
            num_threads = (len(affinity(0)) if affinity else os.cpu_count()) or 2
        if num_threads == 1:
            warnings.warn(
                "MultiThreadedExecutor is used with a single thread.\n"
                "Use the SingleThreadedExecutor instead.",
                stacklevel=2,
            )
        self._futures: list[Task] = []
        self._executor = ThreadPoolExecutor(num_threads)

    def _spin_once_impl(
        self,
        timeout_sec: float | TimeoutObject | None = None,
        wait_condition: Callable[[], bool] = lambda: False,
    ) -> None:
        try:
            task, _, _ = self.wait_for_ready_callbacks(timeout_sec, None, wait_condition)
        except (
            ExternalShutdownException,
            ShutdownException,
            TimeoutException,
            ConditionReachedException,
        ):
            return
        self._executor.submit(self._work_tracker.run, task)
        self._futures.append(task)
        for future in self._futures[:]:
            if future.done():
                self._futures.remove(future)
                future.result()

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        finished = super().shutdown(timeout_sec)
        self._executor.shutdown(wait=False)
        return finished
