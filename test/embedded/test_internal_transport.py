# SPDX-License-Identifier: Apache-2.0
"""What the seam promises, on both transports: samples, histories, matches and endpoints."""

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


@pytest.mark.parametrize("participant_class", [LocalParticipant])
def test_domains_are_kept_apart(join):
    writer = join(1).create_writer(TOPIC, TYPE, HASH, LATCHED)
    far, near = (join(number).create_reader(TOPIC, TYPE, HASH, LATCHED) for number in (2, 1))
    writer.write(payload(1))
    assert numbers(near.take(10)) == [1]
    assert far.take(10) == [] and far.matched() == 0
