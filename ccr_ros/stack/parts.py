# SPDX-License-Identifier: Apache-2.0
"""A node to be started, and what is known of one that was."""

from __future__ import annotations

import signal
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Protocol

from ccr_ros.model import CcrError

_TAIL = 8  # lines of its output that are shown when it fails


class StackFailed(CcrError):
    """Nodes started together could not do what they were started for; its text says why."""


@dataclass(frozen=True)
class Part:
    """A node and the two ways to start it.

    Attributes:
        name: Of the node.
        program: What follows ``python -m`` to run it as a process.
        function: ``module:name`` of the node's class, or of a function that runs it in a given
            context until its end, and may return what the program prints.
    """

    name: str
    program: tuple[str, ...]
    function: str


class Started(ABC):
    """A node that was started.

    Attributes:
        name: Of the node.
        where: It runs.
    """

    name: str
    where: str

    @property
    @abstractmethod
    def exit_code(self) -> int | None:
        """The exit code, ``None`` while it runs; minus the signal's number if one ended it."""

    @property
    @abstractmethod
    def output(self) -> str:
        """What it has written so far."""

    def failure(self, what: str) -> StackFailed:
        """Return an error that says what went wrong with it, with the end of its output."""
        return StackFailed(f"{self.name} {what}; {self.last_words()}")

    def last_words(self) -> str:
        """Return the last lines of its output, introduced and indented."""
        lines = [line for line in self.output.splitlines() if line.strip()][-_TAIL:]
        said = "\n".join(f"     {line}" for line in lines) or "     (nothing)"
        return f"the last it said:\n{said}"

    def ended(self) -> StackFailed:
        """Return an error that says that, and how, it ended."""
        code = self.exit_code
        how = f"exit code {code}"
        if code is not None and code < 0:
            how = f"killed by {signal.Signals(-code).name}"
        return self.failure(f"({self.where}) ended too early ({how})")


class Starter(Protocol):
    """Starts nodes, all in the same way."""

    def start(self, part: Part, *ros_args: str) -> Started:
        """Start a node with a command line."""
