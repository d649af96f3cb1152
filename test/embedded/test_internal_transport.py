# SPDX-License-Identifier: Apache-2.0
"""What the seam promises, on both transports."""

import os
import signal
import threading
import time

import pytest

from embedded_ros.transport import INFINITE, Qos, available_transports
from embedded_ros.transport.local import LocalParticipant

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


@pytest.fixture(params=["cyclone", "local"])
def participant_class(request):
    if request.param == "local":
        return LocalParticipant
    if "cyclone" not in available_transports():
        pytest.skip("cyclonedds is not installed")
    from embedded_ros.transport.cyclone import CycloneParticipant

    return CycloneParticipant


@pytest.fixture
def join(participant_class):
    """Return a function that makes participants, which leave with the test."""
    made = []

    def join(domain_id=None):
        domain_id = int(os.environ["ROS_DOMAIN_ID"]) if domain_id is None else domain_id
        made.append(participant_class(domain_id))
        return made[-1]

    yield join
    for participant in made:
        participant.close()


@pytest.fixture
def ends(join):
    """Return a function that makes a writer and a reader of two participants."""
    one, two = join(), join()

    def ends(offered=None, wanted=None, topic=TOPIC, type_hash=HASH):
        writer = one.create_writer(topic, TYPE, HASH, offered or Qos(), "clientid=1;")
        reader = two.create_reader(topic, TYPE, type_hash, wanted or offered or Qos())
        return writer, reader

    return ends


def connected(ends):
    return until(lambda: all(end.matched() == 1 for end in ends))


def received(reader, count):
    """Take until so many samples have come."""
    samples = []
    until(lambda: samples.extend(reader.take(100)) or len(samples) >= count)
    return samples


def test_payloads_are_carried_with_who_and_when(ends):
    writer, reader = pair = ends()
    assert connected(pair)
    before = time.time_ns()
    for number in range(3):
        writer.write(payload(number))
    assert writer.wait_for_acked(20_000 * MS)
    samples = received(reader, 3)
    assert numbers(samples) == [0, 1, 2]
    for sample in samples:
        assert sample.writer == writer.handle
        assert before <= sample.source_timestamp <= sample.received_timestamp <= time.time_ns()


def test_peers_announce_user_data(ends):
    writer, reader = pair = ends()
    assert connected(pair)
    assert reader.peers() == {writer.handle: f"clientid=1;typehash={HASH};".encode()}
    (data,) = writer.peers().values()
    assert data == f"typehash={HASH};".encode()


def test_topics_are_kept_apart(join):
    participant = join()
    writer = participant.create_writer(TOPIC, TYPE, HASH, Qos())
    other = participant.create_reader("rt/other", TYPE, HASH, Qos())
    reader = participant.create_reader(TOPIC, TYPE, HASH, Qos())
    assert connected([writer, reader])
    assert other.matched() == 0


def test_a_reader_keeps_the_newest(ends):
    writer, reader = pair = ends(Qos(keep_all=True), Qos(depth=4))
    assert connected(pair)
    for number in range(10):
        writer.write(payload(number))
    assert until(lambda: writer.wait_for_acked(0))
    assert numbers(reader.take(3)) == [6, 7, 8]
    assert numbers(reader.take(100)) == [9]
    assert reader.take(100) == []


def test_who_takes_nothing_stops_nobody(ends):
    writer, reader = pair = ends(Qos(keep_all=True))
    assert connected(pair)
    for number in range(3000):
        writer.write(payload(number))
    assert numbers(received(reader, 3000)) == list(range(3000))


def test_late_readers_get_the_history_if_they_want_it(join):
    participant = join()
    writer = participant.create_writer(TOPIC, TYPE, HASH, LATCHED)
    for number in range(5):
        writer.write(payload(number))
    latched = participant.create_reader(TOPIC, TYPE, HASH, LATCHED)
    volatile = participant.create_reader(TOPIC, TYPE, HASH, Qos())
    assert until(lambda: writer.matched() == 2)
    assert numbers(received(latched, 3)) == [2, 3, 4]
    writer.write(payload(5))
    assert numbers(received(latched, 1)) == [5]
    assert numbers(received(volatile, 1)) == [5]


def test_a_history_may_have_no_limit(join):
    participant = join()
    everything = Qos(transient_local=True, keep_all=True)
    writer = participant.create_writer(TOPIC, TYPE, HASH, everything)
    for number in range(50):
        writer.write(payload(number))
    reader = participant.create_reader(TOPIC, TYPE, HASH, everything)
    assert numbers(received(reader, 50)) == list(range(50))


@pytest.mark.parametrize(
    ("offered", "wanted", "policy"),
    [
        (Qos(reliable=False), Qos(), 11),
        (Qos(), LATCHED, 2),
        (Qos(), Qos(deadline=10 * MS), 4),
        (Qos(deadline=20 * MS), Qos(deadline=10 * MS), 4),
        (Qos(), Qos(manual_liveliness=True), 8),
        (Qos(liveliness_lease=INFINITE), Qos(liveliness_lease=500 * MS), 8),
        (Qos(reliable=False), LATCHED, 11),
    ],
)
def test_incompatible_qos_is_told_to_both(ends, offered, wanted, policy):
    pair = ends(offered, wanted)
    for end in pair:
        told = []

        def tell(end=end, told=told):
            told.append(end.status("incompatible_qos"))
            return told[-1].total

        assert until(tell)
        assert told[-1] == (1, 1, policy)
        assert end.status("incompatible_qos") == (1, 0, policy)
        assert end.matched() == 0
        assert end.status("matched") == (0, 0, 0)


@pytest.mark.parametrize(
    ("offered", "wanted"),
    [
        (Qos(), Qos(reliable=False)),
        (LATCHED, Qos()),
        (Qos(deadline=10 * MS), Qos(deadline=20 * MS)),
        (Qos(deadline=10 * MS), Qos()),
        (Qos(manual_liveliness=True, liveliness_lease=500 * MS), Qos()),
        (Qos(lifespan=MS, depth=1), Qos(keep_all=True)),
    ],
)
def test_more_than_is_wanted_will_do(ends, offered, wanted):
    assert connected(ends(offered, wanted))


def test_other_types_do_not_match_and_say_so(ends):
    writer, reader = ends(type_hash="RIHS01_" + "b" * 64)
    assert until(lambda: reader.status("incompatible_qos").total)
    assert reader.status("incompatible_qos").detail == 24
    assert (writer.matched(), reader.matched()) == (0, 0)


def test_matches_are_counted(join):
    participant = join()
    writer = participant.create_writer(TOPIC, TYPE, HASH, Qos())
    readers = [participant.create_reader(TOPIC, TYPE, HASH, Qos()) for _ in range(2)]
    assert until(lambda: writer.matched() == 2)
    assert writer.status("matched") == (2, 2, 2)
    assert writer.status("matched") == (2, 0, 2)
    readers[0].close()
    readers[0].close()
    assert readers[0].take(10) == []
    assert until(lambda: writer.matched() == 1)
    assert writer.status("matched") == (2, 0, 1)
    writer.close()
    assert until(lambda: readers[1].matched() == 0)
    assert readers[1].status("matched") == (1, 1, 0)


def test_ends_that_nobody_holds_are_gone(ends):
    writer, reader = pair = ends()
    assert connected(pair)
    del reader, pair
    assert until(lambda: writer.matched() == 0)


def test_everybody_sees_all_endpoints(join):
    one, two = join(), join()
    qos = Qos(reliable=False, transient_local=True, depth=7, deadline=50 * MS, lifespan=60 * MS)
    writer = one.create_writer(TOPIC, TYPE, HASH, qos, "clientid=1;")
    reader = two.create_reader(TOPIC, TYPE, HASH, Qos())
    for participant in (one, two):
        known = {}

        def both(participant=participant, known=known):
            known.update({end.guid: end for end in participant.endpoints()})
            return {writer.guid, reader.guid} <= known.keys()

        assert until(both)
        seen = known[writer.guid]
        assert (seen.topic, seen.type_name, seen.is_reader) == (TOPIC, TYPE, False)
        assert seen.participant == one.guid
        assert seen.user_data == f"clientid=1;typehash={HASH};".encode()
        assert (seen.qos.reliable, seen.qos.transient_local) == (False, True)
        assert (seen.qos.deadline, seen.qos.lifespan) == (50 * MS, 60 * MS)
        assert known[reader.guid].is_reader
        assert known[reader.guid].participant == two.guid
    guids = [one.guid, two.guid, writer.guid, reader.guid]
    assert [len(guid) for guid in guids] == [16] * 4 and len(set(guids)) == 4


def test_a_participant_takes_its_own_along(join):
    one, two = join(), join()
    arguments = (TOPIC, TYPE, HASH, Qos())
    kept = [one.create_writer(*arguments), one.create_reader(*arguments)]
    reader = two.create_reader(TOPIC, TYPE, HASH, Qos())
    assert until(lambda: reader.matched() == 1)
    for end in kept:
        end.close()
    one.close()
    one.close()
    assert one.endpoints() == []
    assert until(lambda: reader.matched() == 0)
    kept_guids = {end.guid for end in kept}
    assert until(lambda: not kept_guids & {end.guid for end in two.endpoints()})


def test_samples_expire(join):
    participant = join()
    brief = Qos(transient_local=True, lifespan=30 * MS)
    writer = participant.create_writer(TOPIC, TYPE, HASH, brief)
    early = participant.create_reader(TOPIC, TYPE, HASH, Qos(transient_local=True))
    assert connected([writer, early])
    writer.write(payload(1))
    time.sleep(0.2)
    late = participant.create_reader(TOPIC, TYPE, HASH, Qos(transient_local=True))
    assert until(lambda: writer.matched() == 2)
    assert early.take(10) == []
    time.sleep(0.1)
    assert late.take(10) == []


def test_missed_deadlines_are_counted(ends):
    writer, reader = pair = ends(Qos(deadline=20 * MS))
    assert connected(pair)
    assert (writer.status("deadline").total, reader.status("deadline").total) == (0, 0)
    writer.write(payload(1))
    for end in pair:
        assert until(lambda end=end: end.status("deadline").total >= 3)
    assert until(lambda: reader.status("deadline").change == 1)


def test_silent_writers_are_not_alive(ends):
    qos = Qos(manual_liveliness=True, liveliness_lease=60 * MS)
    writer, reader = pair = ends(qos)
    assert connected(pair)
    states = []

    def reached(alive, not_alive):
        states.append(reader.status("liveliness"))
        return (states[-1].total, states[-1].detail) == (alive, not_alive)

    assert until(lambda: reached(0, 1)) and states[-1].change
    assert until(lambda: writer.status("liveliness").total == 1)
    # Again and again, as the machine may be slower than the lease.
    assert until(lambda: writer.write(payload(1)) or reached(1, 0))
    writer.close()
    assert until(lambda: reached(0, 0))


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
class TestLocal:
    """What only the transport within one process promises."""

    def test_domains_are_kept_apart(self, join):
        writer = join(1).create_writer(TOPIC, TYPE, HASH, LATCHED)
        far, near = (join(number).create_reader(TOPIC, TYPE, HASH, LATCHED) for number in (2, 1))
        writer.write(payload(1))
        assert numbers(near.take(10)) == [1]
        assert far.take(10) == [] and far.matched() == 0

    def test_a_writer_may_come_to_life_without_a_message(self, ends):
        # Cyclone DDS 11.0.1 does not tell readers of the same process.
        writer, reader = ends(Qos(manual_liveliness=True, liveliness_lease=60 * MS))
        assert until(lambda: reader.status("liveliness").total == 0)
        assert until(lambda: writer.assert_liveliness() or reader.status("liveliness").total == 1)

    @pytest.mark.timeout(40)
    def test_signal_handlers_end_a_wait(self, join, endless):
        waiter = join().create_waiter()
        before = signal.signal(signal.SIGALRM, lambda *_: waiter.wake())
        try:
            signal.setitimer(signal.ITIMER_REAL, 0.05)
            waiter.wait(None)
        finally:
            signal.signal(signal.SIGALRM, before)

    @pytest.mark.timeout(60)
    def test_signal_handlers_may_do_anything_on_top_of_anything(self, join):
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
