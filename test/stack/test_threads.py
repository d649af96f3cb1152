# SPDX-License-Identifier: Apache-2.0
"""The demo's nodes as threads of one process, with whichever transport there is."""

import time

import pytest

from ccr_ros.model import UnknownName
from ccr_ros.stack.parts import Part, StackFailed
from ccr_ros.stack.threads import Threads

NODE = """
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from ccr_ros.model import UnknownName

def run(context):
    node = rclpy.create_node("part", context=context)
    seen.append(node.get_namespace())
    try:
        rclpy.spin(node, SingleThreadedExecutor(context=context))
    except ExternalShutdownException:
        seen.append("ended")

def say(context):
    return "first\\nlast"

def refuse(context):
    raise UnknownName("node", "x", ["y"])

def crash(context):
    raise ZeroDivisionError("a bug")

seen = []
"""


@pytest.fixture
def part(tmp_path, monkeypatch):
    """Return a function that makes a part of one of the functions above, and what they saw."""
    (tmp_path / "part_of_a_test.py").write_text(NODE)
    monkeypatch.syspath_prepend(tmp_path)
    import part_of_a_test

    part_of_a_test.seen.clear()
    return lambda name: Part("talker", (), f"part_of_a_test:{name}"), part_of_a_test.seen


def finished(node):
    node.wait(time.monotonic() + 60)
    assert node.exit_code is not None
    return node.exit_code


def test_nodes_end_with_the_block(part):
    make, seen = part
    with pytest.raises(RuntimeError, match="left"), Threads("quiet") as threads:
        node = threads.start(make("run"), "--ros-args", "-r", "__ns:=/some")
        while not seen:
            assert node.exit_code is None
            time.sleep(0.01)
        raise RuntimeError("left")
    assert seen == ["/some", "ended"]
    assert finished(node) == 0


def test_a_node_that_ends_leaves_what_it_says(part):
    make, _ = part
    with Threads("quiet") as threads:
        node = threads.start(make("say"))
        assert (finished(node), node.output) == (0, "first\nlast")
    assert isinstance(node.ended(), StackFailed)
    assert str(node.ended()) == (
        "talker (in this process) ended too early (exit code 0); the last it said:\n"
        "     first\n     last"
    )


@pytest.mark.parametrize(
    ("function", "last"),
    [
        ("refuse", f"talker: error: {UnknownName('node', 'x', ['y'])}"),
        ("crash", "ZeroDivisionError: a bug"),
    ],
)
def test_a_node_that_fails_tells_how(part, function, last):
    make, _ = part
    with Threads("quiet") as threads:
        node = threads.start(make(function))
        assert finished(node) == 1
    assert node.output.strip().splitlines()[-1] == last
    assert "exit code 1" in str(node.ended())
