# SPDX-License-Identifier: Apache-2.0
"""One end of a measured connection: ``python -m benchmarks.transport_peer CARRIER CASE ROLE COUNT``.

The ``send``er publishes COUNT messages at 100 Hz, the ``receive``r notes how long each took from
the call of publish to the start of its callback. Both print what they measured as JSON.
"""

from __future__ import annotations

import itertools
import json
import struct
import sys
import time
from collections.abc import Callable
from typing import Any

from ccr_ros.runtime import enable_ros

enable_ros()

from .transport_cases import CASES, Case  # noqa: E402

PERIOD = 0.01  # s
WARM_UP = 50  # messages that are not counted
DEPTH = 2000  # nothing is lost however long one end is held up
SETTLE = 1.0  # s, after which an idle node has said all it had to say


class Meter:
    """Counts messages; after COUNT (and those for warming up) it prints its figures and ends."""

    def __init__(self, count: int) -> None:
        self._left = WARM_UP + count
        self._count = count
        self._cpu = 0.0
        self._ages: list[float] = []

    def note(self, age: float | None = None) -> None:
        """Count a message, `age` ms old."""
        if self._left == self._count:
            self._cpu = time.process_time()
            self._ages.clear()
        self._left -= 1
        if age is not None:
            self._ages.append(age)
        if self._left == 0:
            cpu = 1e3 * (time.process_time() - self._cpu) / self._count
            print(json.dumps({"cpu_ms": cpu, "ages_ms": self._ages}), flush=True)
            raise SystemExit


class Rclpy:
    """Ordinary nodes of whichever rclpy is installed: a timer, a subscription, spun."""

    def __init__(self, case: Case, role: str) -> None:
        import rclpy

        self._rclpy, self._case = rclpy, case
        rclpy.init(args=[])
        self._node = rclpy.create_node(f"bench_{role}")

    def send(self, meter: Meter) -> None:
        """Publish from a timer."""
        case, message = self._case, self._case.make()
        publisher = self._node.create_publisher(type(message), "bench", DEPTH)

        def publish() -> None:
            if publisher.get_subscription_count():
                case.stamp(message)
                publisher.publish(message)
                meter.note()

        self._node.create_timer(PERIOD, publish)
        self._rclpy.spin(self._node)

    def receive(self, meter: Meter) -> None:
        """Note the age of each message."""
        case = self._case
        kind = type(case.make())
        self._node.create_subscription(kind, "bench", lambda m: meter.note(case.age(m)), DEPTH)
        print("ready", flush=True)
        self._rclpy.spin(self._node)

    def idle(self, seconds: float) -> None:
        """Spin a node that has nothing to do."""
        executor = self._rclpy.executors.SingleThreadedExecutor()
        executor.add_node(self._node)

        def spin(until: float) -> None:
            while (left := until - time.monotonic()) > 0:
                executor.spin_once(timeout_sec=left)

        spin(time.monotonic() + SETTLE)
        before = time.process_time()
        spin(time.monotonic() + seconds)
        print(json.dumps({"cpu_ms": 1e3 * (time.process_time() - before) / seconds}), flush=True)


class Cyclone:
    """The same over the PyPI package cyclonedds alone, with its own message classes."""

    def __init__(self, case: Case, role: str) -> None:
        from cyclonedds.domain import DomainParticipant
        from cyclonedds.qos import Policy, Qos

        from .transport_cases import domain_from_environment

        self._case = case
        self._participant = DomainParticipant(domain_from_environment())
        self._qos = Qos(Policy.Reliability.Reliable(10**9), Policy.History.KeepLast(DEPTH))
        self._kind = self._make_kind()

    def _make_kind(self) -> Any:
        from .transport_cases import idl_struct

        return idl_struct(type(self._case.make()))

    def _messages(self) -> Callable[[], Any]:
        from .transport_cases import as_idl

        message = as_idl(self._case.make())

        def stamped() -> Any:
            self._case.stamp(message)
            return message

        return stamped

    def _age(self, sample: Any) -> float:
        return self._case.age(sample)

    def _topic(self) -> Any:
        from cyclonedds.topic import Topic

        return Topic(self._participant, "bench", self._kind, qos=self._qos)

    def send(self, meter: Meter) -> None:
        """Publish from a loop."""
        from cyclonedds.pub import DataWriter

        writer = DataWriter(self._participant, self._topic(), qos=self._qos)
        stamped = self._messages()
        while not writer.get_matched_subscriptions():
            time.sleep(PERIOD)
        begin = time.monotonic()
        for turn in itertools.count():
            time.sleep(max(0.0, begin + turn * PERIOD - time.monotonic()))
            writer.write(stamped())
            if turn == WARM_UP + meter._count - 1:
                time.sleep(0.5)
            meter.note()

    def receive(self, meter: Meter) -> None:
        """Wait in a wait set and take."""
        from cyclonedds.core import ReadCondition, ViewState, WaitSet
        from cyclonedds.sub import DataReader

        reader = DataReader(self._participant, self._topic(), qos=self._qos)
        waiter = WaitSet(self._participant)
        waiter.attach(ReadCondition(reader, ViewState.Any))
        print("ready", flush=True)
        while True:
            waiter.wait(10**9)
            for sample in reader.take(N=10):
                if sample.sample_info.valid_data:
                    meter.note(self._age(sample))


class Bytes(Cyclone):
    """The same with messages that were encoded beforehand and are not decoded."""

    def _make_kind(self) -> Any:
        from cyclonedds.idl import make_idl_struct, types

        kind: Any = make_idl_struct("Bytes", "bench.Bytes", {"octet": types.uint8})
        kind.serialize = lambda sample, **_: sample.octet
        kind.deserialize = classmethod(lambda cls, data, **_: cls(data))
        return kind

    def _messages(self) -> Callable[[], Any]:
        from rclpy.serialization import serialize_message

        payload = bytearray(serialize_message(self._case.make()))

        def stamped() -> Any:
            struct.pack_into("<q", payload, self._case.offset, time.monotonic_ns())
            return self._kind(bytes(payload))

        return stamped

    def _age(self, sample: Any) -> float:
        return (
            time.monotonic_ns() - struct.unpack_from("<q", sample.octet, self._case.offset)[0]
        ) * 1e-6


CARRIERS: dict[str, Any] = {"rclpy": Rclpy, "cyclonedds": Cyclone, "bytes": Bytes}


def main(carrier: str, case: str, role: str, count: int) -> None:
    """Be one end."""
    end = CARRIERS[carrier](CASES[case], role)
    if role == "idle":
        end.idle(count)
    else:
        getattr(end, role)(Meter(count))


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], sys.argv[3], int(sys.argv[4]))
