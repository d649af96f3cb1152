# SPDX-License-Identifier: Apache-2.0
"""What only a process of its own shows: signals, pipes, and what is loaded."""

import signal
import subprocess
import sys
import threading

import pytest
from std_msgs.msg import String
from std_srvs.srv import SetBool

pytestmark = pytest.mark.processes


@pytest.fixture
def talking(peer):
    publisher = peer.create_publisher(String, "/chatter", 10)
    peer.create_timer(0.05, lambda: publisher.publish(String(data="hello")))


def complaints(err):
    """Lines of standard error; on a busy machine a command can look before the talker is found."""
    return [line for line in err.splitlines() if "not appear to be published yet" not in line]


@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)], ids=["int", "term"]
)
@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("echo", "/chatter"), "data: hello\n"),
        (("hz", "/chatter", "-w", "5"), "average rate: "),
        (("pub", "/other", "std_msgs/msg/String", "-r", "20"), "publisher: beginning loop\n"),
    ],
    ids=["echo", "hz", "pub"],
)
def test_signals_end_endless_commands_quietly(start_ccr, talking, words, line, number, code):
    process = start_ccr("topic", *words)
    assert process.stdout.readline().startswith(line)  # reaches a pipe while the command runs
    process.send_signal(number)
    _, err = process.communicate(timeout=60)
    assert (process.returncode, complaints(err)) == (code, [])


def test_a_signal_ends_a_call_that_gets_no_answer(start_ccr, peer):
    released = threading.Event()
    peer.create_service(SetBool, "/slow", lambda request, response: released.wait() and response)
    process = start_ccr("service", "call", "/slow", "std_srvs/srv/SetBool")
    lines = iter(process.stdout.readline, "")  # at first it may have to wait for the service
    assert any(line.startswith("requester: making request: ") for line in lines)
    process.send_signal(signal.SIGTERM)
    out, err = process.communicate(timeout=60)
    released.set()
    assert (process.returncode, out.strip(), err) == (143, "", "")


def test_hz_counts_what_passes_its_filter(start_ccr, talking):
    process = start_ccr("topic", "hz", "/chatter", "--filter", "m.data == 'hello'", "--wall-time")
    assert process.stdout.readline().startswith("average rate: ")
    assert "min: " in process.stdout.readline()


def test_hz_waits_for_its_topic(start_ccr):
    process = start_ccr("topic", "hz", "/nobody")
    line = process.stderr.readline()
    assert line == "WARNING: topic [/nobody] does not appear to be published yet\n"


def test_a_reader_that_goes_ends_echo_quietly(start_ccr, talking):
    process = start_ccr("topic", "echo", "/chatter")
    process.stdout.readline()
    process.stdout.close()
    assert process.wait(timeout=60) == 0
    assert complaints(process.stderr.read()) == []


def test_help_loads_neither_ros_nor_the_model(start_ccr):
    code = (
        "import sys\nfrom ccr_ros.cli.main import main\n"
        "try: main(['topic', 'echo', '--help'])\nexcept SystemExit: pass\n"
        "print({'rclpy', 'numpy', 'casadi'} & set(sys.modules), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stderr == "set()\n"


def test_a_list_loads_no_model(start_ccr):
    code = (
        "import sys\nfrom ccr_ros.cli.main import main\n"
        "assert main(['node', 'list']) == 0\n"
        "print({'casadi', 'matplotlib', 'scipy'} & set(sys.modules), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stderr == "set()\n"
