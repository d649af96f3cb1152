# SPDX-License-Identifier: Apache-2.0
"""The gripper's states and events: every pair of them, and what no sequence of events may do."""

import itertools
import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ccr_ros.grasp.machine import TRANSITIONS, Event, GripperMachine, NotAllowed, State

PAGE = Path(__file__).resolve().parents[2] / "docs" / "grasping.md"
LEADS = {(source, event): target for event, sources, target in TRANSITIONS for source in sources}

# A way to every state, by events alone.
WAYS = {
    State.IDLE: [],
    State.OPENING: [Event.OPEN],
    State.READY: [Event.OPEN, Event.OPENED],
    State.CLOSING: [Event.OPEN, Event.OPENED, Event.CLOSE],
    State.HOLDING: [Event.ADOPT],
    State.MOVING: [Event.ADOPT, Event.MOVE],
    State.RELEASING: [Event.RELEASE],
    State.STOPPED: [Event.STOP],
    State.FAULT: [Event.FAIL],
}


def machine_in(state):
    machine = GripperMachine()
    for event in WAYS[state]:
        machine.fire(event)
    assert machine.now is state
    return machine


@pytest.mark.parametrize("state", State)
@pytest.mark.parametrize("event", Event)
def test_every_event_in_every_state(state, event):
    machine = machine_in(state)
    target = LEADS.get((state, event))
    assert machine.may(event) == (target is not None)
    if target is not None:
        assert machine.fire(event) is target
        return
    with pytest.raises(NotAllowed, match=f"{event} is not possible while the gripper is {state}"):
        machine.fire(event)
    assert machine.now is state


def test_the_table_has_every_event_once_and_every_state():
    assert sorted(event for event, _, _ in TRANSITIONS) == sorted(Event)
    assert {target for _, _, target in TRANSITIONS} | {State.IDLE} == set(State)


def test_a_person_can_always_stop_and_always_get_to_ready():
    for state in State:
        if state is not State.FAULT:  # where nothing moves either
            assert machine_in(state).fire(Event.STOP) is State.STOPPED
        machine = machine_in(state)
        for event in (Event.RESET, Event.RELEASE, Event.RELEASED):
            if machine.may(event):
                machine.fire(event)
        assert machine.now is State.READY, state


@given(st.lists(st.sampled_from(Event)))
def test_holding_is_left_by_a_release_or_with_the_grip_kept(events):
    machine = machine_in(State.HOLDING)
    for event in events:
        before = machine.now
        if machine.may(event):
            after = machine.fire(event)
            if before in (State.HOLDING, State.MOVING) and event is not Event.RELEASE:
                assert after in (State.HOLDING, State.MOVING, State.STOPPED, State.FAULT)
            if before is State.FAULT:
                assert after is State.STOPPED
            if after is State.RELEASING:
                assert event is Event.RELEASE


def test_the_states_are_those_of_the_message():
    from ccr_msgs.msg import GripperState

    constants = {getattr(GripperState, state.name) for state in State}
    assert constants == {str(state) for state in State}


def test_fault_is_left_by_reset_only():
    for event, state in itertools.product(Event, [State.FAULT]):
        assert machine_in(state).may(event) == (event is Event.RESET)


def test_the_diagram_of_the_states_is_the_table():
    text = PAGE.read_text(encoding="utf-8")
    drawn = set(re.findall(r"^    (\w+) --> (\w+): (\w+)$", text, re.M))
    # Said below it, and not drawn: what is possible in every state but fault.
    everywhere = {Event.RELEASE, Event.STOP, Event.FAIL}
    again = {(State.CLOSING, Event.CLOSE), (State.MOVING, Event.MOVE)}
    assert {(source, target, event) for source, target, event in drawn} == {
        (str(source), str(target), str(event))
        for (source, event), target in LEADS.items()
        if (event not in everywhere or (source, event) == (State.HOLDING, Event.RELEASE))
        and (source, event) not in again
    }
    for event in everywhere:
        sources = {source for source, e in LEADS if e is event}
        assert set(State) - sources <= {State.FAULT, State.RELEASING}
    assert set(re.findall(r"^\| `(\w+)` \| ", text, re.M)) == set(map(str, State))
