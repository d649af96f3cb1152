# SPDX-License-Identifier: Apache-2.0
"""Progress for people: one line that changes on a terminal, a few lines elsewhere."""

from __future__ import annotations

import shutil
import time
from typing import TextIO

_SPARSE = 3.0  # s between lines where they are not replaced


class Progress:
    """Writes to a stream.

    Args:
        stream: Where to.
        sparse: Time between lines [s] where the stream is no terminal.
    """

    def __init__(self, stream: TextIO, sparse: float = _SPARSE) -> None:
        self._stream = stream
        self._terminal = stream.isatty()
        self._sparse = sparse
        self._shown = False
        self._last: tuple[str, float] = ("", float("-inf"))

    def say(self, text: str) -> None:
        """Write lines that stay."""
        self.clear()
        print(text, file=self._stream, flush=True)

    def update(self, phase: str, text: str) -> None:
        """Show how far it is; where lines stay, only in a new phase or after some time."""
        if self._terminal:
            width = shutil.get_terminal_size().columns - 1
            self._stream.write(f"\r\x1b[K{f'{phase:<7} {text}'[:width]}")
            self._stream.flush()
            self._shown = True
            return
        now = time.monotonic()
        if phase != self._last[0] or now - self._last[1] >= self._sparse:
            self._last = (phase, now)
            print(f"{phase:<7} {text}".rstrip(), file=self._stream, flush=True)

    def clear(self) -> None:
        """Remove the changing line."""
        if self._shown:
            self._stream.write("\r\x1b[K")
            self._stream.flush()
            self._shown = False
