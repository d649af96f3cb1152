# SPDX-License-Identifier: Apache-2.0
"""The default context, and small helpers."""

from __future__ import annotations

import sys
import threading
from collections.abc import Sequence
from typing import TYPE_CHECKING

from embedded_ros.transport import TRANSPORTS, available_transports, chosen_transport

from .constants import S_TO_NS

if TYPE_CHECKING:
    from .context import Context

_default: Context | None = None
_lock = threading.RLock()


def get_default_context(*, shutting_down: bool = False) -> Context:
    """The context that is used where none is named; `shutting_down` also replaces it for the next
    use.
    """
    from .context import Context

    global _default
    with _lock:
        if _default is None:
            _default = Context()
        context = _default
        if shutting_down:
            _default = None
        return context


def remove_ros_args(args: Sequence[str] | None = None) -> list[str]:
    """The arguments (default: sys.argv) without what belongs to ROS."""
    from .impl.arguments import parse_arguments

    return parse_arguments(sys.argv if args is None else args)[1]


def ok(*, context: Context | None = None) -> bool:
    """Whether a context (default: the default one) is initialised and not shut down."""
    return (get_default_context() if context is None else context).ok()


def shutdown(*, context: Context | None = None) -> None:
    """Shut a context down.

    :raises RuntimeError: it is not initialised, or was shut down already (by a signal, say).
    """
    (get_default_context(shutting_down=True) if context is None else context).shutdown()


def try_shutdown(*, context: Context | None = None) -> None:
    """Shut a context down unless that has happened already."""
    global _default
    if context is not None:
        context.try_shutdown()
        return
    with _lock:
        context = get_default_context()
        context.try_shutdown()
        if not context.ok():
            _default = None


def get_rmw_implementation_identifier() -> str:
    """The middleware spoken: the same on the wire as rmw_cyclonedds_cpp, or that within this
    process only.
    """
    return TRANSPORTS[chosen_transport()]


def get_available_rmw_implementations() -> set[str]:
    """All middlewares there are."""
    return {TRANSPORTS[name] for name in available_transports()}


def timeout_sec_to_nsec(timeout_sec: float | None) -> int:
    """Seconds to nanoseconds; None and negative values, which mean no limit, give -1."""
    if timeout_sec is None or timeout_sec < 0:
        return -1
    return int(float(timeout_sec) * S_TO_NS)
