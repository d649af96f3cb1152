# SPDX-License-Identifier: Apache-2.0
"""The ROS 2 client library for Python, as far as this runtime offers it.

Its parts behave like those of rclpy in ROS 2 Jazzy, whose documentation applies.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ._rclpy_pybind11 import RCLError
from .context import Context
from .parameter import Parameter
from .signals import SignalHandlerOptions, install_signal_handlers, uninstall_signal_handlers
from .task import Future
from .utilities import get_default_context, get_rmw_implementation_identifier, ok, try_shutdown
from .utilities import shutdown as _shutdown

if TYPE_CHECKING:
    from .executors import Executor
    from .node import Node

__all__ = [
    "Context",
    "Future",
    "Parameter",
    "SignalHandlerOptions",
    "create_node",
    "get_default_context",
    "get_global_executor",
    "get_rmw_implementation_identifier",
    "init",
    "ok",
    "shutdown",
    "spin",
    "spin_once",
    "spin_until_future_complete",
    "try_shutdown",
]


def init(
    *,
    args: list[str] | None = None,
    context: Context | None = None,
    domain_id: int | None = None,
    signal_handler_options: SignalHandlerOptions | None = None,
) -> None:
    """Initialise a context, by default the default one.

    :param args: command line, default sys.argv.
    :param domain_id: ROS domain, default ROS_DOMAIN_ID or 0.
    :param signal_handler_options: signals to handle; default: SIGINT and SIGTERM for the default
        context.
    """
    default = get_default_context()
    chosen = default if context is None else context
    if signal_handler_options is None:
        signal_handler_options = (
            SignalHandlerOptions.ALL if chosen is default else SignalHandlerOptions.NO
        )
    chosen.init(args, domain_id=domain_id)
    install_signal_handlers(signal_handler_options)


_executor: Any = None


def get_global_executor() -> Executor:
    """The executor that the functions of this module use.

    :raises rclpy.executors.ExternalShutdownException: the default context has ended already.
    """
    global _executor
    context = get_default_context()
    if _executor is not None and not _executor.context.ok() and context.ok():
        # The old context was ended by a signal, which calls no shutdown callbacks.
        _executor = None
    if _executor is not None:
        return _executor
    from .executors import ExternalShutdownException, SingleThreadedExecutor

    try:
        executor = _executor = SingleThreadedExecutor()
    except RCLError:
        if context.handle is None:
            raise
        raise ExternalShutdownException() from None  # a signal came before spinning began

    def reset() -> None:
        global _executor
        if _executor is not None:
            _executor.shutdown(timeout_sec=0)
        _executor = None

    context.on_shutdown(reset)
    return executor


def shutdown(*, context: Context | None = None, uninstall_handlers: bool | None = None) -> None:
    """Shut a context down, by default the default one.

    :param uninstall_handlers: whether to give the signals back; default: with the default context.
    :raises RuntimeError: the context is not initialised, or was shut down already.
    """
    _shutdown(context=context)
    if uninstall_handlers or (
        uninstall_handlers is None and (context is None or context is get_default_context())
    ):
        uninstall_signal_handlers()


def create_node(node_name: str, **kwargs: Any) -> Node:
    """Create a :class:`rclpy.node.Node`; keyword arguments are the node's."""
    from .node import Node

    return Node(node_name, **kwargs)


def spin_once(
    node: Node, *, executor: Executor | None = None, timeout_sec: float | None = None
) -> None:
    """Run one callback, or wait until the timeout passes."""
    chosen = get_global_executor() if executor is None else executor
    try:
        chosen.add_node(node)
        chosen.spin_once(timeout_sec=timeout_sec)
    finally:
        chosen.remove_node(node)


def spin(node: Node, executor: Executor | None = None) -> None:
    """Run callbacks until the context is shut down.

    :raises rclpy.executors.ExternalShutdownException: a signal ended the context.
    """
    chosen = get_global_executor() if executor is None else executor
    try:
        chosen.add_node(node)
        while chosen.context.ok():
            chosen.spin_once()
    finally:
        chosen.remove_node(node)


def spin_until_future_complete(
    node: Node, future: Future, executor: Executor | None = None, timeout_sec: float | None = None
) -> None:
    """Run callbacks until the future is done, the timeout passes or the context is shut down."""
    chosen = get_global_executor() if executor is None else executor
    added = False
    try:
        added = chosen.add_node(node)
        chosen.spin_until_future_complete(future, timeout_sec)
    finally:
        if added:
            chosen.remove_node(node)
