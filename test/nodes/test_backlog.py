# SPDX-License-Identifier: Apache-2.0
"""What waits is let in before a solve, but not for ever."""

import pytest

from ccr_ros.nodes import backlog
from ccr_ros.nodes.backlog import Backlog


@pytest.fixture
def clock(monkeypatch):
    """A clock that is set by hand."""
    now = [100.0]
    monkeypatch.setattr(backlog.time, "monotonic", lambda: now[0])
    return now


def test_it_is_settled_when_a_look_finds_no_more(clock):
    looks = Backlog()
    assert not looks.settled(1)
    assert looks.growing
    assert not looks.settled(3)
    assert looks.settled(3)
    assert not looks.growing


def test_what_was_marked_as_seen_is_not_waited_for(clock):
    looks = Backlog()
    looks.mark_seen(1)
    assert looks.settled(1)
    assert not looks.settled(2)


def test_a_flood_is_looked_at_for_a_few_milliseconds_only(clock):
    looks = Backlog()
    received = 0
    for _ in range(5):
        received += 1
        assert not looks.settled(received)
        clock[0] += 0.001
    clock[0] += 0.001
    assert looks.settled(received + 1)
    assert not looks.settled(received + 2)  # the time begins anew
