# SPDX-License-Identifier: Apache-2.0
"""Fixtures of the runtime's tests. All but the tests of internals hold for real rclpy too."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

import embedded_ros

ROOT = Path(__file__).parents[2]
PROGRAMS = Path(__file__).parent / "programs"
EMBEDDED = embedded_ros.enable([Path(__file__).parent / "interfaces"])

if not EMBEDDED:
    collect_ignore_glob = ["test_internal_*.py"]

import rclpy  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402


@pytest.fixture
def context():
    """A context of its own, initialised without arguments."""
    chosen = rclpy.Context()
    rclpy.init(args=[], context=chosen)
    yield chosen
    chosen.try_shutdown()


@pytest.fixture
def make_node(context):
    """Make nodes that are destroyed with the test."""
    nodes = []

    def make(name="tester", **kwargs):
        nodes.append(rclpy.create_node(name, context=context, **kwargs))
        return nodes[-1]

    yield make
    for node in nodes:
        node.destroy_node()


@pytest.fixture
def node(make_node):
    """One node."""
    return make_node()


@pytest.fixture
def spin(context):
    """Spin nodes until a condition holds; the limit is only there to end a failing test."""

    def run(condition, *nodes, limit=60.0, executor=None):
        own = executor or SingleThreadedExecutor(context=context)
        for one in nodes:
            own.add_node(one)
        end = time.monotonic() + limit
        try:
            while not condition() and time.monotonic() < end:
                own.spin_once(timeout_sec=0.05)
        finally:
            for one in nodes:
                own.remove_node(one)
            if executor is None:
                own.shutdown()
        return condition()

    return run


@pytest.fixture
def executor(context):
    """A single-threaded executor."""
    chosen = SingleThreadedExecutor(context=context)
    yield chosen
    chosen.shutdown()


@pytest.fixture
def finish(spin, executor):
    """Spin the executor until a future is done, and give its result."""

    def run(future):
        assert spin(future.done, executor=executor)
        return future.result()

    return run


@pytest.fixture
def bench(make_node, executor, spin, finish):
    """An action server and a client."""
    from action_bench import Bench

    chosen = Bench(make_node, executor, spin, finish)
    yield chosen
    chosen.close()


class Program:
    """A test program in a process of its own."""

    def __init__(self, name, *arguments, prefix=(), **environment):
        path = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
        self.process = subprocess.Popen(
            [*prefix, sys.executable, "-u", str(PROGRAMS / name), *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONPATH": path, **environment},
        )

    def finish(self, limit=60):
        """Exit code, standard output and standard error."""
        try:
            out, err = self.process.communicate(timeout=limit)
        except subprocess.TimeoutExpired:
            self.process.kill()
            out, err = self.process.communicate()
            raise AssertionError(f"did not end in {limit} s\n{out}\n{err}") from None
        return self.process.returncode, out, err

    def wait_for_line(self, text):
        """Read standard output until a line holds ``text``."""
        for line in self.process.stdout:
            if text in line:
                return line
        raise AssertionError(f"ended without {text!r}: {self.process.stderr.read()}")


@pytest.fixture
def program():
    """Start test programs that are killed with the test."""
    started = []

    def start(name, *arguments, **options):
        started.append(Program(name, *arguments, **options))
        return started[-1]

    yield start
    for one in started:
        if one.process.poll() is None:
            one.process.kill()
            one.process.wait()


# For tests of the transports alone


@pytest.fixture(params=["cyclone", "local"])
def participant_class(request):
    """The participants of one transport after the other."""
    from embedded_ros.transport import available_transports
    from embedded_ros.transport.local import LocalParticipant

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
    from transport_ends import HASH, TOPIC, TYPE

    from embedded_ros.transport import Qos

    one, two = join(), join()

    def ends(offered=None, wanted=None, topic=TOPIC, type_hash=HASH):
        writer = one.create_writer(topic, TYPE, HASH, offered or Qos(), "clientid=1;")
        reader = two.create_reader(topic, TYPE, type_hash, wanted or offered or Qos())
        return writer, reader

    return ends
