# SPDX-License-Identifier: Apache-2.0
"""One end of a connection: ``python -m benchmarks.transport_peer CARRIER CASE ROLE COUNT``.

``send`` publishes COUNT messages, ``receive`` notes how long each took from the call of publish to
the start of its callback; ``call`` and ``serve`` are the ends of COUNT round trips; ``idle`` does
nothing for COUNT seconds. All print what they measured as JSON.
"""

from __future__ import annotations

import json
import struct
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

from ccr_ros.runtime import enable_ros

enable_ros()

from .transport_cases import CASES, Case  # noqa: E402

WARM_UP = 50  # messages that are not counted
DEPTH = 2000  # nothing is lost however long one end is held up
SETTLE = 1.0  # s, after which an idle node has said all it had to say


class Meter:
    """Counts messages; after COUNT (and those for warming up) it prints its figures and ends."""

    def __init__(self, count: int) -> None:
        self.left = WARM_UP + count
        self._count = count
        self._cpu = 0.0
        self._ages: list[float] = []

    def note(self, age: float | None = None) -> None:
        """Count a message, `age` ms old."""
        if self.left == self._count:
            self._cpu = time.process_time()
            self._ages.clear()
        self.left -= 1
        if age is not None:
            self._ages.append(age)
        if self.left == 0:
            cpu = 1e3 * (time.process_time() - self._cpu) / self._count
            print(json.dumps({"cpu_ms": cpu, "ages_ms": self._ages}), flush=True)
            raise SystemExit

    @property
    def total(self) -> int:
        """All messages, those for warming up included."""
        return WARM_UP + self._count


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

        self._node.create_timer(case.period, publish)
        self._rclpy.spin(self._node)

    def receive(self, meter: Meter) -> None:
        """Note the age of each message."""
        case = self._case
        kind = type(case.make())
        self._node.create_subscription(kind, "bench", lambda m: meter.note(case.age(m)), DEPTH)
        print("ready", flush=True)
        self._rclpy.spin(self._node)

    def call(self, meter: Meter) -> None:
        """Call a service and spin until it has answered, again and again."""
        from std_srvs.srv import Trigger

        client = self._node.create_client(Trigger, "bench")
        client.wait_for_service()
        while True:
            time.sleep(self._case.period)
            begin = time.monotonic_ns()
            future = client.call_async(Trigger.Request())
            self._rclpy.spin_until_future_complete(self._node, future)
            meter.note((time.monotonic_ns() - begin) * 1e-6)

    def serve(self, meter: Meter) -> None:
        """Answer."""
        from std_srvs.srv import Trigger

        def answer(_: Any, response: Any) -> Any:
            if meter.left > 1:
                meter.note()
            else:
                self._node.create_timer(0.2, meter.note)  # once the last answer has been sent
            return response

        self._node.create_service(Trigger, "bench", answer)
        print("ready", flush=True)
        self._rclpy.spin(self._node)

    def wait(self, seconds: float) -> None:
        """Spin a node that has nothing to do."""
        executor = self._rclpy.get_global_executor()
        executor.add_node(self._node)
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            executor.spin_once(timeout_sec=left)


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

    def _writer(self, topic: str = "bench") -> Any:
        from cyclonedds.pub import DataWriter
        from cyclonedds.topic import Topic

        topic = Topic(self._participant, topic, self._kind, qos=self._qos)
        return DataWriter(self._participant, topic, qos=self._qos)

    def _samples(self, topic: str = "bench") -> Iterator[Any]:
        """Samples as they come, out of a wait set."""
        from cyclonedds.core import ReadCondition, ViewState, WaitSet
        from cyclonedds.sub import DataReader
        from cyclonedds.topic import Topic

        topic = Topic(self._participant, topic, self._kind, qos=self._qos)
        reader = DataReader(self._participant, topic, qos=self._qos)
        waiter = WaitSet(self._participant)
        waiter.attach(ReadCondition(reader, ViewState.Any))
        yield None
        while True:
            waiter.wait(10**9)
            for sample in reader.take(N=10):
                if sample.sample_info.valid_data:
                    yield sample

    def send(self, meter: Meter) -> None:
        """Publish from a loop."""
        writer = self._writer()
        stamped = self._messages()
        while not writer.get_matched_subscriptions():
            time.sleep(0.01)
        begin = time.monotonic()
        for turn in range(meter.total):
            time.sleep(max(0.0, begin + turn * self._case.period - time.monotonic()))
            writer.write(stamped())
            if turn == meter.total - 1:
                time.sleep(0.5)  # for the last ones to arrive
            meter.note()

    def receive(self, meter: Meter) -> None:
        """Note the age of each message."""
        samples = self._samples()
        next(samples)
        print("ready", flush=True)
        for sample in samples:
            meter.note(self._age(sample))

    def call(self, meter: Meter) -> None:
        """Send, and wait for what comes back."""
        writer, answers, stamped = self._writer("ask"), self._samples("tell"), self._messages()
        next(answers)
        while not writer.get_matched_subscriptions():
            time.sleep(0.01)
        time.sleep(0.2)  # for the other direction to be connected too
        while True:
            time.sleep(self._case.period)
            writer.write(stamped())
            meter.note(self._age(next(answers)))

    def serve(self, meter: Meter) -> None:
        """Send back what comes."""
        writer, samples = self._writer("tell"), self._samples("ask")
        next(samples)
        print("ready", flush=True)
        for sample in samples:
            writer.write(sample)
            if meter.left == 1:
                time.sleep(0.2)  # for the last answer to arrive
            meter.note()

    def wait(self, seconds: float) -> None:
        """Wait for a message that does not come."""
        from cyclonedds.core import GuardCondition, WaitSet

        waiter = WaitSet(self._participant)
        waiter.attach(GuardCondition(self._participant))
        waiter.wait(int(seconds * 1e9))


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
        end.wait(SETTLE)
        before = time.process_time()
        end.wait(count)
        print(json.dumps({"cpu_ms": 1e3 * (time.process_time() - before) / count, "ages_ms": []}))
    else:
        getattr(end, role)(Meter(count))


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], sys.argv[3], int(sys.argv[4]))
