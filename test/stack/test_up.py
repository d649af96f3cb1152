# SPDX-License-Identifier: Apache-2.0
"""Keeping nodes up, with small programs in their place; the real ones: test_stack_processes.py."""

import os
import signal
import time

import pytest

from ccr_ros.cli.main import main
from ccr_ros.stack import up
from ccr_ros.stack.parts import Part
from ccr_ros.stack.processes import Children, SignalGuard
from ccr_ros.stack.up import Plan, Stack, arguments_for, keep_up, node_part

SLEEPER = """
import signal, sys, time
signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
print("with", *sys.argv[1:], flush=True)
while True:
    time.sleep(0.05)
"""


@pytest.fixture
def stack(tmp_path):
    """Return a function that makes a stack of programs, and what it says, line by line."""
    env = {**os.environ, "PYTHONPATH": str(tmp_path)}
    said = []

    def make(restart=False, **programs):
        for name, text in programs.items():
            (tmp_path / f"{name}.py").write_text(text)
        children = Children(tmp_path, env, lambda name, line: said.append(f"{name}| {line}"))
        opened.append(children)
        parts = tuple(Part(name, (name,), "") for name in programs)
        plan = Plan(parts, {name: ("--word", name) for name in programs}, restart)
        return Stack(plan, children, said.append)

    opened = []
    yield make, said
    for children in opened:
        children.__exit__(None, None, None)


def until(condition, stack=None):
    deadline = time.monotonic() + 30
    while not condition() and time.monotonic() < deadline:
        if stack is not None:
            stack.look()
        time.sleep(0.02)
    assert condition()


def pid_of(said, name):
    return int(next(t for t in reversed(said) if f"started {name} " in t).split()[-1].rstrip(")"))


def test_all_are_started_and_heard(stack):
    make, said = stack
    both = make(one=SLEEPER, two=SLEEPER)
    both.start()
    until(lambda: {"one| with --word one", "two| with --word two"} <= set(said))
    both.look()
    assert both.alive and not both.failed


def test_one_that_ends_is_told_of_and_the_others_go_on(stack):
    make, said = stack
    both = make(one=SLEEPER, two=SLEEPER)
    both.start()
    until(lambda: "one| with --word one" in said)
    os.kill(pid_of(said, "one"), signal.SIGKILL)
    until(lambda: both.failed, both)
    assert any("ended: killed by SIGKILL; still running: two" in text for text in said)
    assert both.alive and not any("restarted" in text for text in said)


def test_restarts_are_told_of(stack):
    make, said = stack
    one = make(restart=True, one=SLEEPER)
    one.start()
    until(lambda: "one| with --word one" in said)
    first = pid_of(said, "one")
    os.kill(first, signal.SIGKILL)
    until(lambda: any(text.startswith("restarted one") for text in said), one)
    assert pid_of(said, "one") != first and one.alive and one.failed


def test_when_all_have_ended_it_ends(stack):
    make, said = stack
    quick = make(one="print('gone')", two="raise SystemExit(3)")
    with SignalGuard() as signals:
        assert keep_up(quick, signals) == 1
    assert any("two (process" in t and "exit code 3" in t for t in said)
    until(lambda: "one| gone" in said)


def test_a_node_is_given_its_arguments():
    words = arguments_for("/left", {"gripper_file": "1e3", "rate": 2.5}, ["p.yaml"], ["--x"])
    assert words[:5] == ("--ros-args", "-r", "__ns:=/left", "--params-file", "p.yaml")
    assert words[5:] == ("-p", 'gripper_file:="1e3"', "-p", "rate:=2.5", "--x")
    assert node_part("solver_node").program == ("ccr_ros.cli", "run", "solver_node")


@pytest.mark.parametrize("words", [[], ["--mode", "gripper"]])
def test_the_mode_reaches_the_solver(words, monkeypatch):
    plans = []
    real = up.Plan
    monkeypatch.setattr(up, "Plan", lambda **parts: plans.append(real(**parts)) or plans[-1])
    monkeypatch.setattr(up, "keep_up", lambda stack, signals: 0)
    assert main(["up", *words]) == 0
    (plan,) = plans
    assert ('mode:="gripper"' in plan.arguments["solver_node"]) == bool(words)
    others = (name for name in plan.arguments if name != "solver_node")
    assert not any("mode:=" in word for name in others for word in plan.arguments[name])


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["none.yaml"], "none.yaml"),
        (["--without", "node"], "unknown node 'node'"),
        (["--driver", "magic"], "unknown driver 'magic'; valid: loopback"),
        (["--mode", "hand"], "unknown mode 'hand'; valid: fingers, gripper"),
        (["--params", "none.yaml"], "there is no such file"),
        (["helical"], "gripper file is wanted"),
        (["--servos", "nowhere"], "nowhere"),
        (
            [w for n in ("solver_node", "servo_bridge_node", "gripper_coordinator_node")
             for w in ("--without", n)],
            "not all of the nodes",
        ),
    ],
)  # fmt: skip
def test_bad_words_start_nothing(words, complaint, capsys):
    assert main(["up", *words]) == 2
    err = capsys.readouterr().err
    assert complaint in err and err.count("\n") == 1
