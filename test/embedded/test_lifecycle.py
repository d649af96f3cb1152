# SPDX-License-Identifier: Apache-2.0
"""Lifecycle nodes."""

import pytest
from lifecycle_msgs.msg import Transition, TransitionEvent
from lifecycle_msgs.srv import ChangeState, GetAvailableStates, GetAvailableTransitions, GetState
from rclpy._rclpy_pybind11 import RCLError
from rclpy.lifecycle import (
    LifecycleNode,
    LifecycleState,
    TransitionCallbackReturn,
)

SUCCESS = TransitionCallbackReturn.SUCCESS
FAILURE = TransitionCallbackReturn.FAILURE
ERROR = TransitionCallbackReturn.ERROR


class Recorder(LifecycleNode):
    """Notes its callbacks; each ends as told, by default well."""

    def __init__(self, context, name="managed", **kwargs):
        self.calls, self.ends = [], {}
        super().__init__(name, context=context, **kwargs)

    def _note(self, name, state):
        self.calls.append((name, state))
        end = self.ends.get(name, SUCCESS)
        if isinstance(end, type):
            raise end("broken")  # an error kept for several tests would keep their nodes alive
        return end

    def on_configure(self, state):
        return self._note("configure", state)

    def on_cleanup(self, state):
        return self._note("cleanup", state)

    def on_shutdown(self, state):
        return self._note("shutdown", state)

    def on_activate(self, state):
        return self._note("activate", state)

    def on_deactivate(self, state):
        return self._note("deactivate", state)

    def on_error(self, state):
        return self._note("error", state)


@pytest.fixture
def managed(context):
    node = Recorder(context)
    yield node
    node.destroy_node()


@pytest.fixture
def ask(managed, make_node, spin):
    """Call one of the managed node's services and return the response."""
    user = make_node("user")
    clients = {}

    def call(kind, name, **fields):
        if name not in clients:
            clients[name] = user.create_client(kind, f"managed/{name}")
            assert clients[name].wait_for_service(60)
        future = clients[name].call_async(kind.Request(**fields))
        assert spin(future.done, managed, user)
        return future.result()

    return call


@pytest.fixture
def state(ask):
    return lambda: ask(GetState, "get_state").current_state.label


@pytest.fixture
def change(ask):
    def run(number=0, label=""):
        transition = Transition(id=number, label=label)
        return ask(ChangeState, "change_state", transition=transition).success

    return run


def test_callbacks_get_the_state_before(managed):
    results = [
        managed.trigger_configure(),
        managed.trigger_activate(),
        managed.trigger_deactivate(),
        managed.trigger_cleanup(),
        managed.trigger_shutdown(),
    ]
    assert results == [SUCCESS] * 5
    assert managed.calls == [
        ("configure", LifecycleState("unconfigured", 1)),
        ("activate", LifecycleState("inactive", 2)),
        ("deactivate", LifecycleState("active", 3)),
        ("cleanup", LifecycleState("inactive", 2)),
        ("shutdown", LifecycleState("unconfigured", 1)),
    ]


def test_transitions_that_do_not_start_here_raise(managed):
    for trigger in (managed.trigger_activate, managed.trigger_deactivate, managed.trigger_cleanup):
        with pytest.raises(RCLError):
            trigger()
    managed.trigger_shutdown()
    for trigger in (managed.trigger_shutdown, managed.trigger_configure):
        with pytest.raises(RCLError):
            trigger()
    assert len(managed.calls) == 1


@pytest.mark.parametrize("before", [[], ["configure"], ["configure", "activate"]])
def test_shutdown_from_anywhere(managed, state, before):
    for name in before:
        getattr(managed, f"trigger_{name}")()
    assert managed.trigger_shutdown() == SUCCESS
    assert state() == "finalized"


def test_failures_lead_back(managed, state):
    managed.ends = {"configure": FAILURE}
    assert managed.trigger_configure() == FAILURE
    assert state() == "unconfigured"
    managed.ends = {"activate": FAILURE, "cleanup": FAILURE, "deactivate": FAILURE}
    managed.trigger_configure()
    assert managed.trigger_activate() == FAILURE
    assert managed.trigger_cleanup() == FAILURE
    assert state() == "inactive"
    managed.ends.pop("activate")
    managed.trigger_activate()
    assert managed.trigger_deactivate() == FAILURE
    assert state() == "active"


@pytest.mark.parametrize("end", [ERROR, ValueError])
@pytest.mark.parametrize(
    ("rescue", "goal"),
    [
        (SUCCESS, "unconfigured"),
        (FAILURE, "finalized"),
        (ERROR, "finalized"),
        (ValueError, "finalized"),
    ],
)
def test_errors_are_processed(managed, state, end, rescue, goal):
    managed.trigger_configure()
    managed.ends = {"activate": end, "error": rescue}
    assert managed.trigger_activate() == ERROR
    assert managed.calls[-1] == ("error", LifecycleState("inactive", 2))
    assert state() == goal


def test_the_services(managed, ask, state, change):
    assert state() == "unconfigured"
    assert change(Transition.TRANSITION_CONFIGURE)
    assert state() == "inactive"
    assert change(label="activate")
    assert state() == "active"
    assert not change(label="cleanup")
    assert not change(label="nonsense")
    managed.ends = {"deactivate": FAILURE}
    assert not change(Transition.TRANSITION_DEACTIVATE)
    assert state() == "active"
    states = ask(GetAvailableStates, "get_available_states").available_states
    assert [(one.id, one.label) for one in states] == [
        (0, "unknown"),
        (1, "unconfigured"),
        (2, "inactive"),
        (3, "active"),
        (4, "finalized"),
        (10, "configuring"),
        (11, "cleaningup"),
        (12, "shuttingdown"),
        (13, "activating"),
        (14, "deactivating"),
        (15, "errorprocessing"),
    ]


def text(description):
    transition, start, goal = (
        description.transition,
        description.start_state,
        description.goal_state,
    )
    return f"{transition.id} {transition.label}: {start.id} {start.label} -> {goal.id} {goal.label}"


def test_transitions_are_described(managed, ask):
    def available():
        kind = GetAvailableTransitions
        return [text(d) for d in ask(kind, "get_available_transitions").available_transitions]

    assert available() == [
        "1 configure: 1 unconfigured -> 10 configuring",
        "5 shutdown: 1 unconfigured -> 12 shuttingdown",
    ]
    managed.trigger_configure()
    assert available() == [
        "2 cleanup: 2 inactive -> 11 cleaningup",
        "3 activate: 2 inactive -> 13 activating",
        "6 shutdown: 2 inactive -> 12 shuttingdown",
    ]
    graph = ask(GetAvailableTransitions, "get_transition_graph").available_transitions
    assert len(graph) == 25
    assert {
        "22 transition_error: 11 cleaningup -> 15 errorprocessing",
        "41 transition_failure: 14 deactivating -> 3 active",
        "51 transition_failure: 12 shuttingdown -> 4 finalized",
        "60 transition_success: 15 errorprocessing -> 1 unconfigured",
    } <= {text(description) for description in graph}


def test_transitions_are_told(context, make_node, spin):
    node, user, events = Recorder(context, "teller"), make_node("user"), []
    subscription = user.create_subscription(
        TransitionEvent, "teller/transition_event", events.append, 10
    )
    assert spin(lambda: subscription.get_publisher_count() == 1, user)
    assert spin(lambda: node.count_subscribers("~/transition_event") == 1, node)
    node.ends = {"configure": ERROR}
    node.trigger_configure()
    assert spin(lambda: len(events) == 3, user)
    assert [(event.start_state.label, event.goal_state.label) for event in events] == [
        ("unconfigured", "configuring"),
        ("configuring", "errorprocessing"),
        ("errorprocessing", "unconfigured"),
    ]
    node.destroy_node()
