# SPDX-License-Identifier: Apache-2.0
"""The states of a lifecycle node and the ways between them, as in rcl_lifecycle."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from .._rclpy_pybind11 import RCLError

#: number of every state, by label
STATES = {
    "unknown": 0,
    "unconfigured": 1,
    "inactive": 2,
    "active": 3,
    "finalized": 4,
    "configuring": 10,
    "cleaningup": 11,
    "shuttingdown": 12,
    "activating": 13,
    "deactivating": 14,
    "errorprocessing": 15,
}


class StateTransition(NamedTuple):
    """A way from one state to another."""

    id: int
    label: str
    start: str
    goal: str


def _ends(first: int, state: str, *goals: str) -> Iterator[StateTransition]:
    """How a transition state is left: success, failure and error have successive numbers."""
    for offset, (end, goal) in enumerate(zip(("success", "failure", "error"), goals, strict=True)):
        yield StateTransition(first + offset, f"transition_{end}", state, goal)


TRANSITIONS = (
    StateTransition(1, "configure", "unconfigured", "configuring"),
    *_ends(10, "configuring", "inactive", "unconfigured", "errorprocessing"),
    StateTransition(2, "cleanup", "inactive", "cleaningup"),
    *_ends(20, "cleaningup", "unconfigured", "inactive", "errorprocessing"),
    StateTransition(3, "activate", "inactive", "activating"),
    *_ends(30, "activating", "active", "inactive", "errorprocessing"),
    StateTransition(4, "deactivate", "active", "deactivating"),
    *_ends(40, "deactivating", "inactive", "active", "errorprocessing"),
    StateTransition(5, "shutdown", "unconfigured", "shuttingdown"),
    StateTransition(6, "shutdown", "inactive", "shuttingdown"),
    StateTransition(7, "shutdown", "active", "shuttingdown"),
    *_ends(50, "shuttingdown", "finalized", "finalized", "errorprocessing"),
    *_ends(60, "errorprocessing", "unconfigured", "finalized", "finalized"),
)


class StateMachine:
    """The present state. `on_change` is told the start and the goal of every transition."""

    # set by nodes that serve their state
    service_change_state: Any = None
    service_get_state: Any = None
    service_get_available_states: Any = None
    service_get_available_transitions: Any = None
    service_get_transition_graph: Any = None

    def __init__(self, on_change: Callable[[str, str], None]) -> None:
        self._label = "unconfigured"
        self._on_change = on_change

    @property
    def current_state(self) -> tuple[int, str]:
        """Number and label."""
        return STATES[self._label], self._label

    @property
    def available_transitions(self) -> list[StateTransition]:
        """The ways out of the present state."""
        return [transition for transition in TRANSITIONS if transition.start == self._label]

    def trigger(self, transition: int | str) -> None:
        """Go the way of that number or label.

        :raises RCLError: there is none from here.
        """
        for known in self.available_transitions:
            if transition in (known.id, known.label):
                self._label = known.goal
                self._on_change(known.start, known.goal)
                return
        raise RCLError(
            f"Failed to trigger lifecycle state machine transition: no transition {transition!r} "
            f"from state '{self._label}'"
        )
