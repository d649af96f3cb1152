# SPDX-License-Identifier: Apache-2.0
"""What listeners to a topic need: its type from the graph, and a filter for its messages."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

from ccr_ros.cli.ros.graph import near, spin_until, spin_until_seen, unknown
from ccr_ros.cli.ros.types import message_type
from ccr_ros.model.errors import CcrError


def type_from_graph(node: Any, topic: str, limit: float | None) -> Any:
    """Return the message class of a topic, for which it waits and says so.

    Args:
        node: The node that looks.
        topic: The topic's full name.
        limit: How long to wait for it [s]; None: for ever.

    Raises:
        CcrError: the topic does not show up in time, has two types, or one not known here.
    """

    def topics() -> dict[str, list[str]]:
        return dict(node.get_topic_names_and_types())

    if not spin_until_seen(node, lambda: topic in topics()):
        known = near(topic, topics())
        print(
            f"WARNING: topic [{topic}] does not appear to be published yet{known}",
            file=sys.stderr,
        )
        if not spin_until(node, lambda: topic in topics(), limit):
            raise unknown("topic", topic, topics())
    types = topics()[topic]
    if len(types) > 1:
        raise CcrError(f"topic {topic!r} has more than one type: {', '.join(types)}")
    return message_type(types[0])


def expression(text: str | None) -> Callable[[Any], bool]:
    """Return a function of a message ``m`` from a Python expression; None lets all messages pass.

    Raises:
        CcrError: it is no expression; the function: it cannot be evaluated for this message.
    """
    if text is None:
        return lambda message: True
    try:
        code = compile(text, "--filter", "eval")
    except (SyntaxError, ValueError) as error:
        raise CcrError(f"--filter {text!r} is no Python expression: {error}") from error

    def passes(message: Any) -> bool:
        try:
            return bool(eval(code, {"m": message}))
        except Exception as error:
            raise CcrError(f"--filter {text!r}: {error}") from error

    return passes
