# SPDX-License-Identifier: Apache-2.0
"""Long work for a service, done a turn at a time between the node's other work."""

from __future__ import annotations

from collections.abc import Callable

from rclpy.impl.rcutils_logger import RcutilsLogger
from rclpy.task import Future

from ccr_ros.model import CcrError


def take_turn(turn: Callable[[], object], answer: Future, log: RcutilsLogger) -> bool:
    """Take a turn; return whether the work has ended, and its ``answer`` been given.

    Args:
        turn: Advances a generator; what that returns is the answer. An error is one, too: the node
            and its fingers must go on, whatever it is.
        answer: For the service's callback, which waits for it.
        log: Told of errors that are not the request's.
    """
    try:
        turn()
        return False
    except StopIteration as end:
        answer.set_result(end.value)
    except CcrError as error:
        answer.set_result(error)
    except Exception as error:
        log.error(f"{type(error).__name__}: {error}")
        answer.set_result(error)
    return True
