# SPDX-License-Identifier: Apache-2.0
"""Keeps exceptions of signal handlers out of calls that they would break.

The DDS binding calls Python from C while it takes samples and does not look whether that call has
raised: a KeyboardInterrupt just then crashes the process. Only the main thread runs handlers, so
one that is about to raise is put off until the main thread has left such a call.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

_depth = 0
_held: list[Callable[[], object]] = []


@contextmanager
def uninterrupted() -> Iterator[None]:
    """No exception of `deliver` leaves a call in this block; it comes when the block ends."""
    global _depth
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    _depth += 1
    try:
        yield
    finally:
        _depth -= 1
        if _held and not _depth:
            held = list(_held)
            _held.clear()
            for action in held:
                action()


def deliver(action: Callable[[], object]) -> None:
    """Call the action, which may raise: at once, or when the main thread may be interrupted."""
    if _depth:
        _held.append(action)
    else:
        action()
