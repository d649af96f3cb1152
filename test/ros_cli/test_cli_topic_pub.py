# SPDX-License-Identifier: Apache-2.0
import io
import time

import pytest
from geometry_msgs.msg import PoseArray
from std_msgs.msg import Header, Int32, String

from ccr_ros.cli.ros.topic_hz import Rate

SECOND = 1_000_000_000


class Received:
    """The messages of a topic, as they come to a node that runs in another thread."""

    def __init__(self, node, kind, topic):
        self.messages = []
        node.create_subscription(kind, topic, self.messages.append, 10)

    def all(self, count):
        """Wait until so many have come; the limit is only there to end a failing test."""
        end = time.monotonic() + 60
        while len(self.messages) < count and time.monotonic() < end:
            time.sleep(0.01)
        return self.messages


@pytest.fixture
def received(peer):
    """Subscribe to a topic."""
    return lambda kind, topic: Received(peer, kind, topic)


def test_one_message_reaches_a_subscription(ccr, received):
    heard = received(String, "/chatter")
    done = ccr("topic", "pub", "--once", "/chatter", "std_msgs/msg/String", "data: hello")
    text = "publisher: beginning loop\npublishing #1: std_msgs.msg.String(data='hello')\n\n"
    assert done.code == 0 and done.out.endswith(text)
    assert heard.all(1) == [String(data="hello")]


def test_as_many_as_asked_for_and_every_second_printed(ccr, received):
    heard = received(String, "/chatter")
    done = ccr("topic", "pub", "-t", "4", "-r", "50", "-p", "2", "/chatter", "std_msgs/String")
    assert heard.all(4) == [String()] * 4
    assert [line[:13] for line in done.out.splitlines() if "#" in line] == [
        "publishing #2",
        "publishing #4",
    ]


def test_headers_and_stamps_get_the_time(ccr, received):
    poses, headers = received(PoseArray, "/poses"), received(Header, "/headers")
    values = "{header: auto, poses: [{position: {x: 1}}, {}]}"
    assert ccr("topic", "pub", "-1", "/poses", "geometry_msgs/PoseArray", values).code == 0
    assert ccr("topic", "pub", "-1", "/headers", "std_msgs/Header", "stamp: now").code == 0
    (array,), (header,) = poses.all(1), headers.all(1)
    assert array.header.stamp.sec > 0 and header.stamp.sec > 0
    assert [pose.position.x for pose in array.poses] == [1.0, 0.0]
    assert array.poses[1].orientation.w == 1.0


def test_values_come_from_standard_input(ccr, received, monkeypatch):
    heard = received(String, "/chatter")
    monkeypatch.setattr("sys.stdin", io.StringIO("data: from a pipe\n"))
    ccr("topic", "pub", "-1", "/chatter", "std_msgs/msg/String", "--stdin")
    assert heard.all(1) == [String(data="from a pipe")]


@pytest.mark.processes
def test_the_node_has_the_name_asked_for(start_ccr, peer):
    process = start_ccr("topic", "pub", "-n", "my_talker", "/chatter", "std_msgs/msg/String")
    assert process.stdout.readline() == "publisher: beginning loop\n"
    end = time.monotonic() + 60
    while "my_talker" not in peer.get_node_names() and time.monotonic() < end:
        time.sleep(0.01)
    assert "my_talker" in peer.get_node_names()


@pytest.mark.processes
def test_one_message_from_another_process_is_not_lost(start_ccr, received):
    """However late the subscription finds its publisher, which ends right after the message."""
    for number in range(2):
        heard = received(Int32, f"/number_{number}")
        words = (f"/number_{number}", "std_msgs/msg/Int32", f"data: {number}")
        process = start_ccr("topic", "pub", "-1", "--keep-alive", "0.001", *words)
        assert process.wait(timeout=60) == 0
        assert heard.all(1) == [Int32(data=number)]


def test_without_subscriptions_it_gives_up_when_told_to(ccr):
    done = ccr("topic", "pub", "-1", "--max-wait-time-secs", "0.3", "/none", "std_msgs/msg/String")
    assert done.code == 2
    assert done.out == "Waiting for at least 1 matching subscription(s)...\n"
    assert done.err == (
        "ccr: error: topic '/none' has 0 matching subscriptions after 0.3 s, and 1 are awaited\n"
    )


def test_nothing_awaited_nothing_to_give_up(ccr):
    done = ccr("topic", "pub", "--max-wait-time-secs", "1", "/none", "std_msgs/msg/String")
    assert done.code == 2 and "--max-wait-time-secs needs" in done.err


def test_rate_reports_once_a_second_of_messages():
    rate = Rate(window=100)
    assert rate.report() is None
    reports = []
    for tenth in range(1, 31):
        rate.add(tenth * SECOND // 10)
        reports.append(rate.report())
    assert [i for i, text in enumerate(reports) if text] == [10, 20]
    assert reports[10] == (
        "average rate: 10.000\n\tmin: 0.100s max: 0.100s std dev: 0.00000s window: 10"
    )


def test_rate_looks_at_its_window_only():
    rate = Rate(window=2)
    for moment in (1, 2, 12, 14):
        rate.add(moment * SECOND)
    assert rate.report() == (
        "average rate: 0.167\n\tmin: 2.000s max: 10.000s std dev: 4.00000s window: 2"
    )


def test_rate_starts_anew_when_time_jumps_back(capsys):
    rate = Rate(window=10)
    for moment in (10, 11, 5, 6):
        rate.add(moment * SECOND)
    assert capsys.readouterr().out == "time has reset, resetting counters\n"
    report = rate.report()
    assert report.startswith("average rate: 1.000\n") and report.endswith("window: 1")
