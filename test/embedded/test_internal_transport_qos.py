# SPDX-License-Identifier: Apache-2.0
"""Which ends match, and what they are told when a promise of the other is not kept."""

import time

import pytest
from transport_ends import HASH, LATCHED, MS, TOPIC, TYPE, connected, payload, until

from embedded_ros.transport import INFINITE, Qos
from embedded_ros.transport.local import LocalParticipant


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


@pytest.mark.parametrize("participant_class", [LocalParticipant])
def test_a_writer_may_come_to_life_without_a_message(ends):
    # Cyclone DDS 11.0.1 does not tell readers of the same process.
    writer, reader = ends(Qos(manual_liveliness=True, liveliness_lease=60 * MS))
    assert until(lambda: reader.status("liveliness").total == 0)
    assert until(lambda: writer.assert_liveliness() or reader.status("liveliness").total == 1)
