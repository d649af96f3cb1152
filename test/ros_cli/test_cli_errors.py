# SPDX-License-Identifier: Apache-2.0
"""Whatever is wrong: one line on standard error, that names it and what is right; no traceback."""

import pytest
from std_msgs.msg import String

from ccr_ros.cli.main import COMMANDS

NOUNS = [name for name, (module, _) in COMMANDS.items() if module.startswith("ccr_ros.cli.ros.")]
PUB = ("topic", "pub", "-1", "-w", "0", "/x")


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (("topic", "type", "/chater"), "no topic '/chater' (did you mean '/chatter'?)"),
        (("topic", "info", "/chater"), "no topic '/chater' (did you mean '/chatter'?)"),
        (("node", "info", "/ns/pear"), "no node '/ns/pear' (did you mean '/ns/peer'?)"),
        (("node", "info", "zzz"), "no node '/zzz'; there are: /ns/peer"),
        (
            ("topic", "echo", "/chatter", "--field", "dat"),
            "dat: unknown key (did you mean 'data'?); valid keys: data",
        ),
        (
            ("topic", "echo", "/chatter", "--field", "data.x"),
            "data.x: unknown key; valid keys: none",
        ),
        (
            ("topic", "echo", "/chatter", "--qos-reliability", "safe"),
            "unknown QoS reliability 'safe'; valid: system_default, reliable, best_effort",
        ),
        (
            ("topic", "echo", "/chatter", "--filter", "m.data ="),
            "--filter 'm.data =' is no Python expression: ",
        ),
        (
            (*PUB, "std_msgs/Strng"),
            "no message type 'Strng' in std_msgs (did you mean 'String'?)",
        ),
        (
            (*PUB, "String"),
            "message type: 'String' is not allowed; must be written as package/msg/Name",
        ),
        ((*PUB, "xyz/msg/Thing"), "no package 'xyz' with message types; there are: "),
        ((*PUB, "std_msgs/String", "dat: 1"), "dat: unknown key (did you mean 'data'?); valid"),
        ((*PUB, "std_msgs/UInt8", "data: 300"), "data: 300 is not allowed; must be uint8"),
        ((*PUB, "std_msgs/UInt8", "data: high"), "data: 'high' is not allowed; must be uint8"),
        ((*PUB, "std_msgs/Int32", "data: 3.7"), "data: 3.7 is not allowed; must be int32"),
        ((*PUB, "std_msgs/Bool", "data: maybe"), "data: 'maybe' is not allowed; must be boolean"),
        ((*PUB, "std_msgs/String", "data: null"), "data: None is not allowed; must be string"),
        ((*PUB, "std_msgs/String", "data: [a]"), "data: ['a'] is not allowed; must be string"),
        (
            (*PUB, "sensor_msgs/JointState", "name: elbow"),
            "name: 'elbow' is not allowed; must be sequence<string>",
        ),
        (
            (*PUB, "sensor_msgs/JointState", 'name: ["\\uD800"]'),
            "'\\ud800' is not Unicode text: surrogates not allowed",
        ),
        (
            (*PUB, "std_msgs/String", "&all {data: *all}"),
            "data: {'data': {'data': ",
        ),
        (
            (*PUB, "std_msgs/srv/Empty"),
            "message type: 'std_msgs/srv/Empty' is not allowed; must be written as package/msg/",
        ),
        ((*PUB, "std_msgs/Empty", "data: 1"), "data: unknown key; valid keys: none"),
        (
            (*PUB, "geometry_msgs/PoseArray", "poses: [{}, {position: {x: far}}]"),
            "poses[1].position.x: 'far' is not allowed; must be double",
        ),
        (
            (*PUB, "geometry_msgs/PoseArray", "poses: [1]"),
            "poses[0]: 1 is not allowed; must be a mapping (sequence<geometry_msgs/Pose>)",
        ),
        (
            (*PUB, "std_msgs/String", "hello"),
            "values: 'hello' is not allowed; must be a YAML mapping of fields, as '{data: 1}'",
        ),
        (
            (*PUB, "std_msgs/String", "{data: 1"),
            "not YAML at line 1, column 9: expected ',' or '}'",
        ),
        (("topic", "pub", "-1", "-n", "a b", "/x", "std_msgs/String"), "Invalid node name: "),
        (
            ("service", "call", "/x", "std_srvs/srv/SetBol"),
            "no service type 'SetBol' in std_srvs (did you mean 'SetBool'?)",
        ),
        (
            ("service", "call", "/x", "rcl_interfaces/srv/ListParameters", "{depth: far}"),
            "depth: 'far' is not allowed; must be uint64",
        ),
        (("service", "type", "/x"), "no service '/x'"),
    ],
)
def test_bad_input_is_told_in_one_line(ccr, peer, words, error):
    peer.create_publisher(String, "/chatter", 10)
    done = ccr(*words)
    assert done.code == 2 and done.out == ""
    assert done.err.startswith(f"ccr: error: {error}"), done.err
    assert done.err.count("\n") == 1


@pytest.mark.parametrize("verb", ["type", "info", "echo", "hz"])
def test_a_name_that_no_topic_can_have(ccr, verb):
    done = ccr("topic", verb, "bad topic")
    assert done.code == 2 and done.err.count("\n") == 1
    assert "topic name must not contain characters other than" in done.err
    assert "'bad topic'" in done.err


def test_a_filter_that_fails_on_a_message(ccr, peer):
    publisher = peer.create_publisher(String, "/chatter", 10)
    peer.create_timer(0.05, lambda: publisher.publish(String()))
    done = ccr("topic", "echo", "/chatter", "--filter", "m.dat")
    assert done.code == 2
    assert done.err == ("ccr: error: --filter 'm.dat': 'String' object has no attribute 'dat'\n")


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (("topic", "speak"), "invalid choice: 'speak'"),
        (("topic", "pub", "/x"), "required: message_type"),
        (("topic", "pub", "-r", "0", "/x", "y"), "'0' is not allowed; must be a number above 0"),
        (("topic", "hz", "-w", "1.5", "/x"), "'1.5' is not allowed; must be a whole number above"),
        (("node", "list", "--spin-time", "nan"), "'nan' is not allowed; must be a number above 0"),
    ],
)
def test_usage_errors(ccr, words, error):
    done = ccr(*words)
    assert done.code == 2 and error in done.err.splitlines()[-1]


@pytest.mark.parametrize("noun", NOUNS)
def test_a_noun_alone_shows_its_verbs(ccr, noun):
    done = ccr(noun)
    assert done.code == 0 and f"usage: ccr {noun}" in done.out and "verbs:" in done.out
    assert ccr(noun, "--help").out == done.out
