# SPDX-License-Identifier: Apache-2.0
"""Who waits is woken, by samples, other threads and signal handlers; threads share all there is."""

import signal
import threading
import time

import pytest
from transport_ends import (
    HASH,
    LATCHED,
    MS,
    TOPIC,
    TYPE,
    connected,
    numbers,
    payload,
    received,
    until,
)

from embedded_ros.transport import Qos
from embedded_ros.transport.local import LocalParticipant


@pytest.fixture
def endless(monkeypatch, participant_class):
    """Waits without an end of their own: who is not woken hangs, and the test fails."""
    import embedded_ros.transport.local as local

    monkeypatch.setattr(local, "_SLICE", 1e4)
    if participant_class is not LocalParticipant:
        monkeypatch.setattr("embedded_ros.transport.cyclone.SLICE", 10_000_000 * MS)


@pytest.mark.timeout(40)
def test_samples_end_a_wait(join, endless):
    participant = join()
    writer = participant.create_writer(TOPIC, TYPE, HASH, Qos(keep_all=True))
    reader = participant.create_reader(TOPIC, TYPE, HASH, Qos(keep_all=True))
    assert connected([writer, reader])
    waiter = participant.create_waiter()
    waiter.set_readers({reader})

    def write():
        for number in range(50):
            time.sleep(0.002 * (number % 3))
            writer.write(payload(number))

    thread = threading.Thread(target=write)
    thread.start()
    got = []
    while len(got) < 50:
        waiter.wait(None)
        got += numbers(reader.take(1))  # what is left ends the next wait
    thread.join()
    assert got == list(range(50))
    waiter.close()


def test_a_wait_tells_which_readers_have_samples(join):
    participant = join()
    topics = ("rt/one", "rt/two", "rt/three")
    writers = [participant.create_writer(topic, TYPE, HASH, Qos()) for topic in topics]
    readers = [participant.create_reader(topic, TYPE, HASH, Qos()) for topic in topics]
    assert connected([*writers, *readers])
    waiter = participant.create_waiter()
    waiter.set_readers({readers[0], readers[1]})
    waiter.set_readers(set(readers))
    assert waiter.wait(0) == []
    writers[1].write(payload(1))
    assert until(lambda: waiter.wait(None) == [readers[1]])
    assert waiter.wait(None) == [readers[1]]  # until they are taken
    writers[2].write(payload(2))
    assert until(lambda: set(waiter.wait(None)) == set(readers[1:]))
    waiter.set_readers({readers[0], readers[2]})
    assert waiter.wait(None) == [readers[2]]
    readers[2].take(1)
    assert waiter.wait(0) == []
    waiter.close()


@pytest.mark.timeout(40)
def test_a_wake_ends_the_present_or_the_next_wait(join, endless):
    waiter = join().create_waiter()
    waiter.wake()
    waiter.wake()
    waiter.wait(None)
    waiter.wait(0)
    timer = threading.Timer(0.05, waiter.wake)
    timer.start()
    waiter.wait(None)
    timer.join()
    waiter.wait(5 * MS)
    waiter.close()
    waiter.wake()


def test_threads_write_while_others_come_and_go(join):
    participant, other = join(), join()
    qos = Qos(keep_all=True)
    reader = participant.create_reader(TOPIC, TYPE, HASH, qos)
    writers = [other.create_writer(TOPIC, TYPE, HASH, qos) for _ in range(4)]
    assert until(lambda: reader.matched() == 4)
    assert until(lambda: all(writer.matched() == 1 for writer in writers))
    done = threading.Event()

    def write(writer):
        for number in range(500):
            writer.write(payload(number))

    def come_and_go():
        while not done.is_set():
            passing = other.create_reader(TOPIC, TYPE, HASH, Qos(reliable=False))
            waiter = other.create_waiter()
            waiter.set_readers({passing})
            passing.close()
            waiter.close()

    threads = [threading.Thread(target=write, args=(writer,)) for writer in writers]
    passer = threading.Thread(target=come_and_go)
    passer.start()
    for thread in threads:
        thread.start()
    samples = received(reader, 2000)
    done.set()
    for thread in [*threads, passer]:
        thread.join()
    for writer in writers:
        mine = [sample for sample in samples if sample.writer == writer.handle]
        assert numbers(mine) == list(range(500))
    assert until(lambda: all(writer.matched() == 1 for writer in writers))


def test_a_writer_may_be_closed_while_others_use_it(join):
    participant = join()
    failed = []

    def use(writer, closed):
        try:
            while not closed.is_set():
                writer.write(payload(1))
                writer.status("matched")
                writer.assert_liveliness()
                writer.wait_for_acked(0)
        except Exception as error:
            failed.append(error)

    for _ in range(50):
        writer, closed = participant.create_writer(TOPIC, TYPE, HASH, Qos()), threading.Event()
        users = [threading.Thread(target=use, args=(writer, closed)) for _ in range(3)]
        for user in users:
            user.start()
        writer.close()
        closed.set()
        for user in users:
            user.join()
    assert not failed


@pytest.mark.parametrize("participant_class", [LocalParticipant])
@pytest.mark.timeout(40)
def test_signal_handlers_end_a_wait(join, endless):
    waiter = join().create_waiter()
    before = signal.signal(signal.SIGALRM, lambda *_: waiter.wake())
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.05)
        waiter.wait(None)
    finally:
        signal.signal(signal.SIGALRM, before)


@pytest.mark.parametrize("participant_class", [LocalParticipant])
@pytest.mark.timeout(60)
def test_signal_handlers_may_do_anything_on_top_of_anything(join):
    participant = join()
    writer = participant.create_writer(TOPIC, TYPE, HASH, LATCHED)
    waiter = participant.create_waiter()
    handled = []
    depth, done = 0, False

    def arm(most):
        # Not at an even rate: where a handler takes longer, the next would always be on top of
        # it, without end.
        if depth < most and not done:
            signal.setitimer(signal.ITIMER_REAL, 1e-4)

    def handle(*_):
        nonlocal depth
        depth += 1
        arm(4)
        writer.write(payload(len(handled)))
        waiter.wake()
        participant.create_reader(TOPIC, TYPE, HASH, LATCHED).close()
        handled.append(participant.endpoints())
        depth -= 1
        arm(4)

    before = signal.signal(signal.SIGALRM, handle)
    arm(1)
    try:
        while len(handled) < 300:
            reader = participant.create_reader(TOPIC, TYPE, HASH, LATCHED)
            waiter.set_readers({reader})
            writer.write(payload(0))
            waiter.wait(0)
            reader.take(10)
            reader.close()
    finally:
        done = True
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    waiter.close()
    assert until(lambda: writer.matched() == 0)
    assert [end.guid for end in participant.endpoints()] == [writer.guid]
