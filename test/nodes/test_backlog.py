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


@pytest.mark.parametrize(("solve", "most"), [(0.0, 0.005), (0.03, 0.03), (3.0, 0.1)])
def test_a_flood_is_looked_at_for_a_few_milliseconds_or_as_long_as_a_solve_takes(
    clock, solve, most
):
    looks = Backlog()
    assert looks.settled(0)
    received = 0
    for _ in range(2):  # the time begins anew
        clock[0] += solve
        began = clock[0]
        while True:
            received += 1
            if looks.settled(received):
                break
            clock[0] += 0.001
        assert most < clock[0] - began < most + 0.002
