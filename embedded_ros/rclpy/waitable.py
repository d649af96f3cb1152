# SPDX-License-Identifier: Apache-2.0
"""Things other than timers and topics that an executor can run."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any


class NumberOfEntities:
    """How many entities of each kind a waitable has; wait sets of this runtime do not need it."""

    __slots__ = (
        "num_clients",
        "num_events",
        "num_guard_conditions",
        "num_services",
        "num_subscriptions",
        "num_timers",
    )

    def __init__(
        self,
        num_subs: int = 0,
        num_gcs: int = 0,
        num_timers: int = 0,
        num_clients: int = 0,
        num_services: int = 0,
        num_events: int = 0,
    ) -> None:
        self.num_subscriptions = num_subs
        self.num_guard_conditions = num_gcs
        self.num_timers = num_timers
        self.num_clients = num_clients
        self.num_services = num_services
        self.num_events = num_events

    def __add__(self, other: NumberOfEntities) -> NumberOfEntities:
        result = NumberOfEntities()
        for name in self.__slots__:
            setattr(result, name, getattr(self, name) + getattr(other, name))
        return result

    def __repr__(self) -> str:
        counts = ", ".join(f"{name}={getattr(self, name)}" for name in self.__slots__)
        return f"<{type(self).__name__}({counts})>"


class Waitable:
    """Base of what :meth:`Node.add_waitable` takes.

    The executor calls :meth:`add_to_wait_set` before it waits and :meth:`is_ready` afterwards, and
    if so :meth:`take_data` and :meth:`execute`.
    """

    def __init__(self, callback_group: Any) -> None:
        self.callback_group = callback_group
        callback_group.add_entity(self)
        self._executor_event = False
        self._futures: list[Any] = []

    def add_future(self, future: Any) -> None:
        """Keep a future until it is done."""
        self._futures.append(future)
        future.add_done_callback(self.remove_future)

    def remove_future(self, future: Any) -> None:
        """Forget a future."""
        self._futures.remove(future)

    def is_ready(self, wait_set: Any) -> bool:
        """Whether there is something to do."""
        raise NotImplementedError("Must be implemented by subclass")

    def take_data(self) -> Any:
        """Fetch what :meth:`execute` is to work on."""
        raise NotImplementedError("Must be implemented by subclass")

    def take_work(self) -> Callable[[], Any]:
        """Fetch data, and return what is to be run for it."""
        return partial(self.execute, self.take_data())

    async def execute(self, taken_data: Any) -> None:
        """Do the work."""
        raise NotImplementedError("Must be implemented by subclass")

    def get_num_entities(self) -> NumberOfEntities:
        """How many entities :meth:`add_to_wait_set` adds; not used by executors of this runtime."""
        return NumberOfEntities()

    def add_to_wait_set(self, wait_set: Any) -> None:
        """Add what to wait for: ``wait_set.add_subscription(...)`` and so on give the index that
        ``wait_set.is_ready("subscription", index)`` takes.
        """
