# SPDX-License-Identifier: Apache-2.0
import pytest
from geometry_msgs.msg import PoseStamped
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import Float64MultiArray, Header, Int32, String

LATCHED = QoSProfile(depth=3, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def repeat(node, kind, topic, message, qos=10):
    """Publish a message over and over."""
    publisher = node.create_publisher(kind, topic, qos)
    node.create_timer(0.05, lambda: publisher.publish(message))
    return publisher


def test_list_shows_what_is_there_but_hidden_topics(ccr, peer):
    peer.create_publisher(String, "/chatter", 10)
    peer.create_subscription(Int32, "_secret/count", print, 10)
    lines = ccr("topic", "list").out.splitlines()
    assert "/chatter" in lines
    assert not any("_secret" in line for line in lines)
    shown = ccr("topic", "list", "-t", "--include-hidden-topics").out.splitlines()
    assert "/chatter [std_msgs/msg/String]" in shown
    assert "/ns/_secret/count [std_msgs/msg/Int32]" in shown
    assert ccr("topic", "list", "-c", "--no-daemon").out == f"{len(lines)}\n"


def test_verbose_list_counts_users(ccr, peer):
    for _ in range(2):
        peer.create_publisher(String, "/chatter", 10)
    peer.create_subscription(String, "/chatter", print, 10)
    published, subscribed = ccr("topic", "list", "-v").out.split("Subscribed topics:")
    assert published.startswith("Published topics:\n")
    assert " * /chatter [std_msgs/msg/String] 2 publishers\n" in published
    assert " * /chatter [std_msgs/msg/String] 1 subscriber\n" in subscribed


def test_info_type_and_find(ccr, peer):
    peer.create_publisher(String, "/chatter", LATCHED)
    peer.create_subscription(String, "/chatter", print, 10)
    text = "Type: std_msgs/msg/String\nPublisher count: 1\nSubscription count: 1\n"
    assert ccr("topic", "info", "/chatter").out == text
    assert ccr("topic", "type", "chatter").out == "std_msgs/msg/String\n"
    assert ccr("topic", "find", "std_msgs/msg/String").out == "/chatter\n"
    assert ccr("topic", "find", "std_msgs/msg/Empty").out == ""
    verbose = ccr("topic", "info", "/chatter", "--verbose").out
    assert "Node name: peer\nNode namespace: /ns\n" in verbose
    assert "Durability: TRANSIENT_LOCAL" in verbose


def test_echo_finds_type_and_qos_itself(ccr, peer):
    publisher = peer.create_publisher(Header, "/heads", LATCHED)
    publisher.publish(Header(frame_id="kept"))  # only a transient-local subscription gets it
    done = ccr("topic", "echo", "/heads", "--once")
    assert done == (0, "stamp:\n  sec: 0\n  nanosec: 0\nframe_id: kept\n---\n", "")


def test_echo_falls_back_to_what_all_publishers_offer(ccr, make_peer):
    reliable, lossy = make_peer("a"), make_peer("b")
    repeat(reliable, String, "/chatter", String(data="hello"))
    qos = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    lossy.create_publisher(String, "/chatter", qos)
    done = ccr("topic", "echo", "/chatter", "--once")
    assert done.out == "data: hello\n---\n"
    assert "Some, but not all, publishers are offering reliability RELIABLE" in done.err


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ((), "layout:\n  dim: []\n  data_offset: 7\ndata:\n- 1.0\n- 2.0\n- 3.0\n---\n"),
        (("-l", "1"), "layout:\n  dim: []\n  data_offset: 7\ndata:\n- 1.0\n- '...'\n---\n"),
        (
            ("--no-arr",),
            "layout:\n  dim: '<sequence type: std_msgs/msg/MultiArrayDimension, length: 0>'\n"
            "  data_offset: 7\ndata: '<sequence type: double, length: 3>'\n---\n",
        ),
        (("--csv",), "7,1.0,2.0,3.0\n"),
        (("--field", "layout.data_offset"), "7\n---\n"),
        (("--field", "layout"), "dim: []\ndata_offset: 7\n---\n"),
        (("--filter", "len(m.data) == 3", "--csv"), "7,1.0,2.0,3.0\n"),
    ],
)
def test_echo_prints_as_asked(ccr, peer, options, expected):
    message = Float64MultiArray(data=[1.0, 2.0, 3.0])
    message.layout.data_offset = 7
    repeat(peer, Float64MultiArray, "/values", message)
    out = ccr("topic", "echo", "/values", "--once", *options).out
    # The layout has an empty list of dimensions, which is an empty value in CSV.
    assert out.removeprefix(",") == expected


def test_echo_gives_times_and_bytes(ccr, peer):
    repeat(peer, String, "/chatter", String(data="hello"))
    times, body = ccr("topic", "echo", "/chatter", "--once", "-i").out.split("---\n")[:2]
    assert "source_timestamp: " in times and body == "data: hello\n"
    raw = ccr("topic", "echo", "/chatter", "--once", "--raw").out
    assert raw.startswith("b'") and "hello" in raw


@pytest.mark.processes
def test_echo_waits_for_a_topic_and_says_so(start_ccr, peer):
    process = start_ccr("topic", "echo", "/late", "--once")
    line = process.stderr.readline()
    assert line == "WARNING: topic [/late] does not appear to be published yet\n"
    repeat(peer, Int32, "/late", Int32())
    assert process.communicate(timeout=60) == ("data: 0\n---\n", "")
    assert process.returncode == 0


def test_echo_ends_at_its_timeout(ccr, peer):
    peer.create_publisher(PoseStamped, "/silent", 10)
    assert ccr("topic", "echo", "/silent", "--timeout", "0.3") == (0, "", "")
    done = ccr("topic", "echo", "/silent", "--timeout", "0.3", "--once")
    assert (done.code, done.err) == (2, "ccr: error: no message on topic '/silent' in 0.3 s\n")


@pytest.mark.not_fast_dds("one type per topic in a participant")
def test_a_topic_of_two_types_needs_one_named(ccr, make_peer):
    repeat(make_peer("a"), String, "/both", String(data="hello"))
    make_peer("b").create_publisher(Int32, "/both", 10)
    done = ccr("topic", "echo", "/both", "--once")
    assert done.err == (
        "ccr: error: topic '/both' has more than one type: std_msgs/msg/Int32, "
        "std_msgs/msg/String\n"
    )
    assert ccr("topic", "echo", "/both", "std_msgs/String", "--once").out == "data: hello\n---\n"
