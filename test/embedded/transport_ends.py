# SPDX-License-Identifier: Apache-2.0
"""Small things for tests of the transports: a topic, payloads, and waiting for what must come."""

import time

from embedded_ros.transport import Qos

TOPIC, TYPE, HASH = "rt/thing", "std_msgs::msg::dds_::String_", "RIHS01_" + "a" * 64
LATCHED = Qos(transient_local=True, depth=3)
MS = 1_000_000  # ns


def payload(number):
    """An encoded message: the header of little-endian CDR and a number."""
    return b"\x00\x01\x00\x00" + number.to_bytes(4, "little")


def numbers(samples):
    return [int.from_bytes(sample.payload[4:8], "little") for sample in samples]


def until(condition, limit=20.0):
    """Wait for the condition; the limit only ends a failing test."""
    end = time.monotonic() + limit
    while not (value := condition()) and time.monotonic() < end:
        time.sleep(0.002)
    return value


def connected(ends):
    return until(lambda: all(end.matched() == 1 for end in ends))


def received(reader, count):
    """Take until so many samples have come."""
    samples = []
    until(lambda: samples.extend(reader.take(100)) or len(samples) >= count)
    return samples
