# SPDX-License-Identifier: Apache-2.0
"""Nodes run for a while in threads of this process, where nodes of others cannot be reached."""

from __future__ import annotations

import threading
import time
import traceback
from collections.abc import Callable
from functools import partial
from importlib import import_module
from types import TracebackType
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.signals import SignalHandlerOptions

from ccr_ros.model import CcrError
from ccr_ros.nodes.runner import spin

from .parts import Part, Started

_GRACE = 3.0  # s that a node has to end by itself when its context does


class NodeThread(Started):
    """A node in a thread and a context of its own."""

    where = "in this process"

    def __init__(self, part: Part, ros_args: tuple[str, ...]) -> None:
        module, _, name = part.function.partition(":")
        run = getattr(import_module(module), name)
        if isinstance(run, type):
            run = partial(spin, run)
        self.name = part.name
        self._output = ""
        self._exit_code: int | None = None
        self._context = Context()
        rclpy.init(
            args=list(ros_args),
            context=self._context,
            signal_handler_options=SignalHandlerOptions.NO,
        )
        # A daemon: one that does not end shall not keep the process.
        self._thread = threading.Thread(target=self._run, args=(run,), name=part.name, daemon=True)
        self._thread.start()

    def _run(self, run: Callable[[Any], str | None]) -> None:
        code = 1
        try:
            self._output = run(self._context) or ""
            code = 0
        except CcrError as error:
            self._output = f"{self.name}: error: {error}"
        except Exception:
            self._output = traceback.format_exc()
        finally:
            self._context.try_shutdown()
            self._exit_code = code

    @property
    def exit_code(self) -> int | None:
        return self._exit_code

    @property
    def output(self) -> str:
        return self._output

    def stop(self) -> None:
        """End its context, which ends it."""
        self._context.try_shutdown()

    def wait(self, deadline: float) -> None:
        """Wait until it has ended, or until a moment of the monotonic clock [s]."""
        self._thread.join(max(0.0, deadline - time.monotonic()))


class Threads:
    """Nodes that end when the ``with`` block does, however it is left.

    Args:
        logger: What their loggers are under. Of these only errors are shown, as the terminal is
            the demo's.
    """

    def __init__(self, logger: str) -> None:
        self._quiet = ("--ros-args", "--log-level", f"{logger}:=error")
        self._nodes: list[NodeThread] = []

    def __enter__(self) -> Threads:
        """Start with none."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End all."""
        for node in self._nodes:
            node.stop()
        deadline = time.monotonic() + _GRACE
        for node in self._nodes:
            node.wait(deadline)

    def start(self, part: Part, *ros_args: str) -> NodeThread:
        """Start a node in a thread; its module is imported here and now."""
        self._nodes.append(NodeThread(part, (*ros_args, *self._quiet)))
        return self._nodes[-1]
