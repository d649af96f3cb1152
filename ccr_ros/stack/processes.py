# SPDX-License-Identifier: Apache-2.0
"""Other programs run for a while: started together, watched, and surely ended."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType, TracebackType
from typing import Any

from .parts import Part, Started

_GRACE = 3.0  # s that a program has to end by itself when it is told to
_PR_SET_PDEATHSIG = 1


#: Is given the name of a program and a line that it has written.
Show = Callable[[str, str], object]


class Child(Started):
    """One running program, in a process group of its own, its output in a file.

    Args:
        name: What it is called.
        command: Its command line.
        log: File for its output.
        env: Its environment.
        show: Told each line of its output when it comes, from a thread; default: nobody.
    """

    def __init__(
        self,
        name: str,
        command: Sequence[str],
        log: Path,
        env: Mapping[str, str],
        show: Show | None = None,
    ) -> None:
        self.name = name
        self._log = log
        with log.open("wb") as output:
            # A session of its own: a Ctrl-C in the terminal reaches this process alone, which
            # then ends its children in order.
            self._process = subprocess.Popen(
                command,
                env=dict(env),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE if show else output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                preexec_fn=_end_with_parent(),
            )
        self.pid = self._process.pid
        self.where = f"process {self.pid}"
        self._teller: threading.Thread | None = None
        if show:
            self._teller = threading.Thread(target=self._tell, args=(show,), daemon=True)
            self._teller.start()

    def _tell(self, show: Show) -> None:
        assert self._process.stdout is not None  # as `show` is given
        with self._log.open("wb", buffering=0) as log:
            for line in self._process.stdout:
                log.write(line)
                show(self.name, line.decode(errors="replace").rstrip())

    @property
    def exit_code(self) -> int | None:
        return self._process.poll()

    @property
    def output(self) -> str:
        return self._log.read_text(encoding="utf-8", errors="replace")

    def signal_group(self, number: int) -> None:
        """Send a signal to the program and all it has started, if it still runs."""
        # Not after it was waited for: the number could be another's by then.
        if self.exit_code is None:
            os.killpg(self.pid, number)

    def wait(self, deadline: float) -> None:
        """Wait until it has ended, or until a moment of the monotonic clock [s]."""
        try:
            self._process.wait(timeout=max(0.0, deadline - time.monotonic()))
        except subprocess.TimeoutExpired:
            return
        if self._teller is not None:  # its last words are still to be told
            self._teller.join(_GRACE)


class Children:
    """Programs that end when the ``with`` block does, however it is left.

    Args:
        logs: Folder for their output.
        env: Their environment.
        show: Told what they write, line by line; see `Child`.
    """

    def __init__(self, logs: Path, env: Mapping[str, str], show: Show | None = None) -> None:
        self._logs = logs
        self._env = env
        self._show = show
        self._children: list[Child] = []

    def __enter__(self) -> Children:
        """Start with none."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End all: politely at first, then surely, even if interrupted meanwhile."""
        try:
            for child in self._children:
                child.signal_group(signal.SIGTERM)
            deadline = time.monotonic() + _GRACE
            for child in self._children:
                child.wait(deadline)
        finally:
            for child in self._children:
                child.signal_group(signal.SIGKILL)
                child.wait(time.monotonic() + _GRACE)

    def start(self, part: Part, *ros_args: str) -> Child:
        """Start a program with this interpreter."""
        # -P: not whatever lies in the current folder.
        command = [sys.executable, "-P", "-m", *part.program, *ros_args]
        log = self._logs / f"{part.name}.log"
        self._children.append(Child(part.name, command, log, self._env, self._show))
        return self._children[-1]


class SignalGuard:
    """Lets SIGINT, SIGTERM and SIGHUP leave a ``with`` block through its ``finally`` clauses.

    An exception in the middle of foreign code (a DDS library that calls back, say) can leave it in
    an unsound state. So while signals are held, they only take effect in `check`. Those that were
    ignored before (nohup, a shell's background job) stay ignored.
    """

    _SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

    def __init__(self) -> None:
        self._before: dict[int, Any] = {}
        self._held = False
        self._pending: int | None = None

    def __enter__(self) -> SignalGuard:
        """Take the signals."""
        for number in self._SIGNALS:
            if signal.getsignal(number) is not signal.SIG_IGN:
                self._before[number] = signal.signal(number, self._receive)
        return self

    def __exit__(self, *error: object) -> None:
        """Give the signals back."""
        for number, handler in self._before.items():
            signal.signal(number, handler)

    @contextmanager
    def held(self) -> Iterator[None]:
        """Let signals take effect in `check` only, and when the block is left without an error."""
        self._held = True
        try:
            yield
        finally:
            self._held = False
        self.check()

    def check(self) -> None:
        """Raise KeyboardInterrupt for SIGINT, SystemExit for the others, if one has come."""
        number, self._pending = self._pending, None
        if number == signal.SIGINT:
            raise KeyboardInterrupt
        if number is not None:
            raise SystemExit(128 + number)  # as shells report it

    def _receive(self, number: int, _: FrameType | None) -> None:
        self._pending = number
        if not self._held:
            self.check()


def _end_with_parent() -> Callable[[], object] | None:
    """Return what a new process runs first, so that it ends even if this one is killed."""
    if not sys.platform.startswith("linux"):
        return None
    libc = ctypes.CDLL(None)  # here: loading it after the fork is not safe
    return lambda: libc.prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
