# SPDX-License-Identifier: Apache-2.0
"""The node that a command looks at the ROS graph with, and what it finds there."""

from __future__ import annotations

import argparse
import difflib
import os
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

from ccr_ros.model.errors import CcrError

#: Nodes whose name starts with an underscore are hidden from lists.
NODE_PREFIX = "_ccr_cli"
EXIT_TERMINATED = 143  # 128 + SIGTERM, as shells report it

# The graph counts as known once so many looks, _STEP seconds apart, have shown nothing new: looks
# and not seconds, as on a busy machine others answer late, and the looks are late as well.
_LOOKS, _LIMIT, _STEP = 10, 10.0, 0.05

# With Fast DDS a new process sees a running one either at once or some seconds later, when what was
# lost of the first exchange is sent again. `ros2` hides that behind its daemon, which stays. Here
# the graph has to be quiet for longer; and while nothing is seen, or not what was asked for, it is
# looked for up to so many looks.
_LOOKS_FAST_DDS, _LOOKS_IN_VAIN_FAST_DDS = 30, 80

NamesAndTypes = list[tuple[str, list[str]]]


@contextmanager
def graph_node(
    args: argparse.Namespace,
    name: str | None = None,
    *,
    settle: bool = True,
    signals: bool = True,
) -> Iterator[Any]:
    """Give a node that has seen the graph, until the block ends.

    Args:
        args: What the command line said of ``--spin-time`` and ``--use-sim-time``.
        name: The node's name; default: a hidden one.
        settle: Whether to wait until the graph is known if no ``--spin-time`` is given.
        signals: Whether SIGINT and SIGTERM end rclpy; else the block has to see to them.

    Raises:
        CcrError: the block gave rclpy a name that is not valid.
        SystemExit: SIGTERM came.
    """
    import rclpy
    from rclpy.exceptions import NameValidationException
    from rclpy.parameter import Parameter
    from rclpy.signals import SignalHandlerOptions
    from rclpy.validate_node_name import validate_node_name

    try:
        validate_node_name(name or NODE_PREFIX)  # a node that fails to be made prints warnings
        handled = SignalHandlerOptions.ALL if signals else SignalHandlerOptions.NO
        rclpy.init(args=[], signal_handler_options=handled)
        node = rclpy.create_node(
            name or f"{NODE_PREFIX}_{os.getpid()}",
            start_parameter_services=False,
            parameter_overrides=[Parameter("use_sim_time", value=args.use_sim_time)],
        )
        # Made when it is first asked for: a signal that comes just then has rclpy print errors.
        rclpy.get_global_executor()
    except NameValidationException as error:
        rclpy.try_shutdown()
        raise _invalid_name(error) from error
    except RuntimeError as error:
        rclpy.try_shutdown()
        raise CcrError(f"cannot join the ROS graph: {' '.join(str(error).split())}") from error
    try:
        if args.spin_time is not None:
            spin_until(node, lambda: False, args.spin_time)
        elif settle or args.use_sim_time:
            _settle(node)
        yield node
        if not rclpy.ok():
            raise SystemExit(EXIT_TERMINATED)
    except NameValidationException as error:
        raise _invalid_name(error) from error
    except Exception:
        # After a SIGTERM, rclpy's functions return, or raise one error or another.
        if not rclpy.ok():
            raise SystemExit(EXIT_TERMINATED) from None
        raise
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def spin_until(node: Any, done: Callable[[], bool], limit: float | None = None) -> bool:
    """Run the node until something holds, or for `limit` seconds; tell whether it holds."""
    import rclpy

    end = None if limit is None else time.monotonic() + limit
    while not done():
        if end is not None and time.monotonic() >= end:
            return False
        next_look = time.monotonic() + _STEP
        while (left := next_look - time.monotonic()) > 0:
            rclpy.spin_once(node, timeout_sec=left)
    return True


def _on_fast_dds() -> bool:
    from rclpy.utilities import get_rmw_implementation_identifier

    return "fastrtps" in get_rmw_implementation_identifier()


def spin_until_seen(node: Any, seen: Callable[[], bool], limit: float = 0.0) -> bool:
    """Run the node until something of others is seen, and tell whether it is.

    It is waited for as long as the middleware may need for it if that is more than the limit [s].
    """
    if _on_fast_dds():
        limit = max(limit, _LOOKS_IN_VAIN_FAST_DDS * _STEP)
    return spin_until(node, seen, limit)


def _settle(node: Any) -> None:
    """Wait until what is known of the graph does not change any more."""
    fast_dds = _on_fast_dds()
    own = len(node.get_node_names())
    seen: Any = None
    looks = 0

    def quiet() -> bool:
        nonlocal seen, looks
        now = (
            sorted(node.get_node_names_and_namespaces()),
            node.get_topic_names_and_types(),
            node.get_service_names_and_types(),
        )
        looks = looks + 1 if now == seen else 0
        seen = now
        if not fast_dds:
            return looks >= _LOOKS
        return looks >= (_LOOKS_FAST_DDS if len(now[0]) > own else _LOOKS_IN_VAIN_FAST_DDS)

    spin_until(node, quiet, _LIMIT)


def visible(pairs: Iterable[tuple[str, list[str]]], include_hidden: bool) -> NamesAndTypes:
    """Return names and types, sorted, without those of hidden names unless asked for."""
    from rclpy.topic_or_service_is_hidden import topic_or_service_is_hidden

    return sorted(
        (name, list(types))
        for name, types in pairs
        if include_hidden or not topic_or_service_is_hidden(name)
    )


def full_name(node: Any, name: str) -> str:
    """Return a topic, service or action name with its leading slash.

    Raises:
        CcrError: the name is not a valid one.
    """
    from rclpy.expand_topic_name import expand_topic_name
    from rclpy.validate_full_topic_name import validate_full_topic_name

    try:
        full = expand_topic_name(name, node.get_name(), node.get_namespace())
    except ValueError as error:
        raise _invalid_name(error) from error
    validate_full_topic_name(full)
    return full


def _invalid_name(error: Exception) -> CcrError:
    # rclpy's text has three lines: what is wrong, the name, and an arrow at the place.
    return CcrError(" ".join(line.strip() for line in str(error).splitlines()[:2]))


def node_names(node: Any, include_hidden: bool = False) -> list[str]:
    """Return the full names of all nodes, sorted; a name that two nodes have is there twice."""
    return sorted(
        f"{namespace.rstrip('/')}/{name}"
        for name, namespace in node.get_node_names_and_namespaces()
        if include_hidden or not name.startswith("_")
    )


def find_node(node: Any, name: str, timeout: float = 0.0) -> str:
    """Return the full name of a node in the graph, hidden or not.

    Raises:
        CcrError: there is none within the timeout.
    """
    full = "/" + name.lstrip("/")
    if not spin_until_seen(node, lambda: full in node_names(node, include_hidden=True), timeout):
        raise unknown("node", full, node_names(node))
    return full


def split_node_name(full: str) -> tuple[str, str]:
    """Return name and namespace of a node's full name."""
    namespace, _, name = full.rpartition("/")
    return name, namespace or "/"


def types_of(node: Any, kind: str, name: str, pairs: Callable[[], NamesAndTypes]) -> list[str]:
    """Return the types that a topic, service or action has.

    Args:
        node: The node that looks.
        kind: What is named, as ``topic``.
        name: Its full name.
        pairs: Gives the names and types in the graph.

    Raises:
        CcrError: the name is not in the graph.
    """
    if not spin_until_seen(node, lambda: name in dict(pairs())):
        raise unknown(kind, name, dict(pairs()))
    return sorted(dict(pairs())[name])


def wait_for_type(
    node: Any,
    kind: str,
    name: str,
    type_name: str,
    pairs: Callable[[], NamesAndTypes],
    timeout: float,
    notice: str = "",
) -> None:
    """Wait for a service or action; to be called before the own client puts the name there.

    Args:
        node: The node that looks.
        kind: ``service`` or ``action``.
        name: Its full name.
        type_name: The type that it shall have.
        pairs: Gives the names and types in the graph.
        timeout: How long to wait [s].
        notice: What to print if it is not there at once.

    Raises:
        CcrError: it does not show up, or has another type.
    """

    def there() -> bool:
        return name in dict(pairs())

    if not spin_until(node, there, min(1.0, timeout)):
        if notice:
            print(notice)
        spin_until(node, there, timeout)
    types = types_of(node, kind, name, pairs)
    if type_name not in types:
        raise CcrError(f"{kind} {name!r} is of type {', '.join(types)}, not {type_name}")


def near(name: str, known: Iterable[str]) -> str:
    """Return `` (did you mean '...'?)`` if a known name is like this one, else nothing."""
    found = difflib.get_close_matches(name, set(known), n=1)
    return f" (did you mean {found[0]!r}?)" if found else ""


def unknown(kind: str, name: str, known: Iterable[str], where: str = "") -> CcrError:
    """Make the error for a name that is not there: it tells the like, else some of those there are.

    Args:
        kind: What is named, as ``topic``.
        name: The name.
        known: The names that there are.
        where: Where it was looked for, if not in the whole graph.
    """
    names = sorted(set(known))
    hint = near(name, names)
    if not hint:
        more = f" and {len(names) - 8} more" if len(names) > 8 else ""
        hint = f"; there are: {', '.join(names[:8])}{more}" if names else "; there is none"
    return CcrError(f"no {kind} {name!r}{where}{hint}")


def plural(count: int, noun: str) -> str:
    """Return the count with its noun: ``1 publisher``, ``2 publishers``."""
    return f"{count} {noun}{'' if count == 1 else 's'}"
