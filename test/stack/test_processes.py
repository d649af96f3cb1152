# SPDX-License-Identifier: Apache-2.0
import os
import signal
import subprocess
import sys
import time

import pytest

from ccr_ros.stack.environment import import_environment
from ccr_ros.stack.parts import Part, StackFailed
from ccr_ros.stack.processes import Children, SignalGuard


@pytest.fixture
def module(tmp_path):
    """Return a function that writes a program and returns its module name, and its environment."""

    def write(text):
        (tmp_path / "child_program.py").write_text(text)
        return "child_program"

    return write, {**os.environ, "PYTHONPATH": str(tmp_path)}


def gone(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return True
    return False


def wait_for_output(child, text):
    deadline = time.monotonic() + 60
    while text not in child.output and time.monotonic() < deadline:
        time.sleep(0.02)
    assert text in child.output


def test_children_end_with_the_block_even_if_they_refuse(module, tmp_path, monkeypatch):
    monkeypatch.setattr("ccr_ros.stack.processes._GRACE", 0.3)
    write, env = module
    stubborn = write(
        "import signal, time\n"
        "signal.signal(signal.SIGTERM, signal.SIG_IGN)\n"
        "print('ready', flush=True)\n"
        "time.sleep(60)\n"
    )
    with pytest.raises(RuntimeError, match="left"), Children(tmp_path, env) as children:
        child = children.start(Part("stubborn", (stubborn,), ""))
        wait_for_output(child, "ready")
        raise RuntimeError("left")
    assert gone(child.pid) and child.exit_code == -signal.SIGKILL


def test_an_ended_child_tells_how_and_what_it_said(module, tmp_path):
    write, env = module
    with Children(tmp_path, env) as children:
        program = write("print('early'); print(); raise SystemExit('too bad')")
        child = children.start(Part("talker", (program,), ""))
        child.wait(time.monotonic() + 60)
        error = child.ended()
    assert isinstance(error, StackFailed)
    assert "talker (process" in str(error) and "exit code 1" in str(error)
    assert str(error).endswith("     early\n     too bad") or str(error).endswith(
        "     too bad\n     early"
    )


def test_a_killed_child_tells_by_which_signal(module, tmp_path):
    write, env = module
    with Children(tmp_path, env) as children:
        child = children.start(Part("sleeper", (write("import time; time.sleep(60)"),), ""))
        os.kill(child.pid, signal.SIGKILL)
        child.wait(time.monotonic() + 60)
        assert "killed by SIGKILL" in str(child.ended())
        assert "(nothing)" in str(child.ended())


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="uses a call of Linux")
def test_children_end_if_their_parent_is_killed(module, tmp_path):
    write, env = module
    name = write("import time; print('ready', flush=True); time.sleep(60)")
    parent = (
        "import os, sys, time, pathlib\n"
        "from ccr_ros.stack.parts import Part\n"
        "from ccr_ros.stack.processes import Children\n"
        f"children = Children(pathlib.Path({str(tmp_path)!r}), os.environ)\n"
        f"child = children.start(Part('sleeper', ({name!r},), ''))\n"
        "while 'ready' not in child.output: time.sleep(0.02)\n"
        "print(child.pid, flush=True)\n"
        "time.sleep(60)\n"
    )
    env["PYTHONPATH"] += os.pathsep + import_environment({})["PYTHONPATH"]
    process = subprocess.Popen([sys.executable, "-c", parent], env=env, stdout=subprocess.PIPE)
    pid = int(process.stdout.readline())
    process.kill()
    process.wait()
    process.stdout.close()
    deadline = time.monotonic() + 60
    while not (gone(pid) or zombie(pid)) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert gone(pid) or zombie(pid)


def zombie(pid):
    try:
        with open(f"/proc/{pid}/stat") as stat:
            return stat.read().rsplit(")", 1)[1].split()[0] == "Z"
    except OSError:
        return True


@pytest.mark.parametrize(
    ("number", "error", "code"),
    [
        (signal.SIGINT, KeyboardInterrupt, None),
        (signal.SIGTERM, SystemExit, 143),
        (signal.SIGHUP, SystemExit, 129),
    ],
)
def test_signals_leave_at_once_or_when_checked(number, error, code):
    before = signal.getsignal(number)
    with pytest.raises(error) as left, SignalGuard():
        os.kill(os.getpid(), number)
        time.sleep(5)
    assert getattr(left.value, "code", None) == code
    reached = []
    with pytest.raises(error), SignalGuard() as signals, signals.held():
        signals.check()
        os.kill(os.getpid(), number)
        time.sleep(0.01)
        reached.append("held")
        signals.check()
        reached.append("checked")
    with pytest.raises(error), SignalGuard() as signals, signals.held():
        os.kill(os.getpid(), number)
    assert reached == ["held"]
    assert signal.getsignal(number) is before


def test_ignored_signals_stay_ignored():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with SignalGuard():
            os.kill(os.getpid(), signal.SIGHUP)
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)
