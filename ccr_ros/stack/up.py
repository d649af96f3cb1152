# SPDX-License-Identifier: Apache-2.0
"""The nodes of one gripper, kept running until they are told to end."""

from __future__ import annotations

import json
import signal
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from .parts import Part, Started, Starter
from .processes import SignalGuard

_LOOK_EVERY = 0.1  # s
_RESTART_AFTER = 1.0  # s, so that a node that cannot start does not keep the machine busy

#: The nodes of a gripper, in the order in which they are started.
NODES = ("solver_node", "servo_bridge_node", "gripper_coordinator_node")

Say = Callable[[str], object]


def node_part(name: str) -> Part:
    """Return how a node of this package is started."""
    kind = "".join(word.capitalize() for word in name.split("_"))
    return Part(name, ("ccr_ros.cli", "run", name), f"ccr_ros.nodes.{name}:{kind}")


@dataclass(frozen=True)
class Plan:
    """What is to run.

    Attributes:
        parts: The nodes, in the order in which they are started.
        arguments: What each is given on its command line, by name; a node that is absent: nothing.
        restart: Whether a node that has ended is started again; each time is told.
    """

    parts: tuple[Part, ...]
    arguments: dict[str, tuple[str, ...]] = field(default_factory=dict)
    restart: bool = False


class Stack:
    """Starts the nodes of a plan, tells of each that ends, and goes on with the others.

    A node that ends takes none with it: the servo bridge holds an object on its own.

    Args:
        plan: What is to run.
        starter: What starts it.
        say: Told what happens, one line at a time.
    """

    def __init__(self, plan: Plan, starter: Starter, say: Say) -> None:
        self._plan = plan
        self._starter = starter
        self._say = say
        self._running: dict[str, Started] = {}
        self._again: dict[str, float] = {}  # when a node is to be started again, monotonic [s]
        self.failed = False  # whether a node has ended without being told to

    def start(self) -> None:
        """Start all nodes."""
        for part in self._plan.parts:
            self._start(part)

    @property
    def alive(self) -> bool:
        """Whether a node runs, or will be started again."""
        return bool(self._running or self._again)

    def look(self) -> None:
        """Tell of nodes that have ended, and start those again that are to be."""
        for name, node in list(self._running.items()):
            if node.exit_code is None:
                continue
            del self._running[name]
            self.failed = True
            others = ", ".join(self._running) or "none"
            self._say(
                f"{name} ({node.where}) ended: {_how(node.exit_code)}; still running: {others}"
            )
            if self._plan.restart:
                self._again[name] = time.monotonic() + _RESTART_AFTER
        for part in self._plan.parts:
            if self._again.get(part.name, float("inf")) <= time.monotonic():
                del self._again[part.name]
                self._start(part, again=True)

    def _start(self, part: Part, again: bool = False) -> None:
        node = self._starter.start(part, *self._plan.arguments.get(part.name, ()))
        self._running[part.name] = node
        self._say(f"{'restarted' if again else 'started'} {part.name} ({node.where})")


def keep_up(stack: Stack, signals: SignalGuard) -> int:
    """Run a stack until a signal comes (KeyboardInterrupt, SystemExit), or until all have ended.

    Returns:
        The exit code where all nodes have ended by themselves: 1.
    """
    stack.start()
    nap = threading.Event()
    while stack.alive:
        stack.look()
        signals.check()
        nap.wait(_LOOK_EVERY)
    return 1


def _how(code: int) -> str:
    if code < 0:
        return f"killed by {signal.Signals(-code).name}"
    return f"exit code {code}"


def arguments_for(
    namespace: str, parameters: dict[str, object], files: Sequence[str], extra: Sequence[str]
) -> tuple[str, ...]:
    """Return a node's command line.

    Args:
        namespace: Of the node.
        parameters: Values by name.
        files: Parameter files.
        extra: Further ROS arguments, added at the end.
    """
    words = ["--ros-args", "-r", f"__ns:={namespace}"]
    for file in files:
        words += ["--params-file", file]
    for name, value in parameters.items():
        # JSON is YAML, and says of text that looks like a number that it is text.
        words += ["-p", f"{name}:={json.dumps(value)}"]
    return (*words, *extra)
