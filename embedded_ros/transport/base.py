# SPDX-License-Identifier: Apache-2.0
"""What a transport offers: participants with writers, readers and waiters that carry encoded
messages.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

#: a duration that never ends, ns
INFINITE = 2**63 - 1


@dataclass(frozen=True)
class Qos:
    """Quality of service with every policy decided; durations in nanoseconds."""

    reliable: bool = True
    transient_local: bool = False
    keep_all: bool = False
    depth: int = 10
    deadline: int = INFINITE
    lifespan: int = INFINITE
    manual_liveliness: bool = False
    liveliness_lease: int = INFINITE


class Sample(NamedTuple):
    """A received message: CDR payload with header, when it was written and taken (ns since 1970),
    by whom.
    """

    payload: bytes
    source_timestamp: int
    received_timestamp: int
    writer: int


class StatusChange(NamedTuple):
    """A communication status: events so far, new ones since it was last read, a detail that depends
    on the kind.
    """

    total: int
    change: int
    detail: int = 0


@dataclass(frozen=True)
class Endpoint:
    """A writer or reader somewhere in the domain, this process included."""

    guid: bytes
    participant: bytes
    topic: str
    type_name: str
    is_reader: bool
    qos: Qos
    user_data: bytes


def user_data(type_hash: str, extra: str) -> bytes:
    """What an endpoint announces, as ROS 2 does."""
    return (extra + (f"typehash={type_hash};" if type_hash else "")).encode()


class Writer(ABC):
    """Sends payloads on one topic."""

    guid: bytes
    #: names this writer in :attr:`Sample.writer` and among the peers of readers of this process
    handle: int

    @abstractmethod
    def write(self, payload: bytes) -> None:
        """Send one payload.

        :raises TimeoutError: a keep-all history stayed full for half a second, as some reader's
            process stands still; the payload is dropped.
        """

    @abstractmethod
    def matched(self) -> int:
        """Number of readers that this writer sends to."""

    @abstractmethod
    def peers(self) -> dict[int, bytes]:
        """The readers that this writer sends to, by handle, with the user data they announce."""

    @abstractmethod
    def wait_for_acked(self, timeout: int) -> bool:
        """Wait up to `timeout` ns until every reliable reader has everything; False on timeout."""

    @abstractmethod
    def assert_liveliness(self) -> None:
        """Tell readers that the program behind this writer is alive."""

    @abstractmethod
    def status(self, kind: str) -> StatusChange:
        """Read and reset a status: ``matched``, ``incompatible_qos``, ``deadline`` or
        ``liveliness``.
        """

    @abstractmethod
    def close(self) -> None:
        """Leave the domain. Calling it again is harmless."""


class Reader(ABC):
    """Receives payloads of one topic."""

    guid: bytes

    @abstractmethod
    def take(self, limit: int) -> list[Sample]:
        """Up to `limit` samples that arrived, oldest first, without waiting."""

    @abstractmethod
    def matched(self) -> int:
        """Number of writers that this reader hears."""

    @abstractmethod
    def peers(self) -> dict[int, bytes]:
        """The writers that this reader hears, by handle (as in :attr:`Sample.writer`), with the
        user data they announce.
        """

    @abstractmethod
    def status(self, kind: str) -> StatusChange:
        """As for writers, and ``lost``."""

    @abstractmethod
    def close(self) -> None:
        """Leave the domain. Calling it again is harmless."""


class Waiter(ABC):
    """Waits until any of the attached readers has samples, or until somebody wakes it."""

    @abstractmethod
    def set_readers(self, readers: set[Reader]) -> None:
        """Wait for exactly these readers from now on."""

    @abstractmethod
    def wait(self, timeout: int | None) -> list[Reader]:
        """Return on samples, on a wake, or after `timeout` ns, and after about 100 ms at the
        latest: the readers that have samples.
        """

    @abstractmethod
    def wake(self) -> None:
        """End the present or the next wait.

        May be called from any thread and from signal handlers.
        """

    @abstractmethod
    def close(self) -> None:
        """Give up what the waiter holds."""


class Participant(ABC):
    """This process's presence in a domain."""

    guid: bytes
    domain_id: int

    @abstractmethod
    def create_writer(
        self, topic: str, type_name: str, type_hash: str, qos: Qos, extra_user_data: str = ""
    ) -> Writer:
        """Make a writer; `topic` and `type_name` are DDS names (``rt/chatter``)."""

    @abstractmethod
    def create_reader(
        self, topic: str, type_name: str, type_hash: str, qos: Qos, extra_user_data: str = ""
    ) -> Reader:
        """Make a reader; as for writers."""

    @abstractmethod
    def create_waiter(self) -> Waiter:
        """Make a waiter for readers of this participant."""

    @abstractmethod
    def endpoints(self) -> list[Endpoint]:
        """All writers and readers known at this moment."""

    @abstractmethod
    def close(self) -> None:
        """Leave the domain with everything made here."""
