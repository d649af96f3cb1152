# SPDX-License-Identifier: Apache-2.0
"""Lifecycle nodes."""

from __future__ import annotations

import traceback
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

from lifecycle_msgs.msg import State, Transition, TransitionDescription, TransitionEvent
from lifecycle_msgs.srv import ChangeState, GetAvailableStates, GetAvailableTransitions, GetState

from .._rclpy_pybind11 import RCLError
from ..callback_groups import CallbackGroup
from ..node import Node
from .managed_entity import ManagedEntity, TransitionCallbackReturn
from .publisher import LifecyclePublisher
from .state_machine import STATES, TRANSITIONS, StateMachine, StateTransition

#: what is called in the states between
_CALLBACKS = {
    "configuring": "on_configure",
    "cleaningup": "on_cleanup",
    "shuttingdown": "on_shutdown",
    "activating": "on_activate",
    "deactivating": "on_deactivate",
    "errorprocessing": "on_error",
}


class LifecycleState(NamedTuple):
    """A state, as callbacks get it."""

    label: str
    state_id: int


if TYPE_CHECKING:
    _Base = Node
else:
    _Base = object


class LifecycleNodeMixin(ManagedEntity, _Base):
    """What makes a node a lifecycle node. Override its ``on_...`` methods; by default they call
    those of all managed entities, up to the first that does not succeed.
    """

    def __init__(
        self,
        *,
        enable_communication_interface: bool = True,
        callback_group: CallbackGroup | None = None,
    ) -> None:
        """Start in state *unconfigured*; the node must be initialised already.

        :param enable_communication_interface: whether others may see and change the state.
        :param callback_group: group of the services for it.
        """
        if not isinstance(enable_communication_interface, bool):
            raise TypeError(
                "enable_communication_interface must be a bool, got "
                f"{enable_communication_interface!r}"
            )
        self._managed_entities: list[ManagedEntity] = []
        self._state_machine = StateMachine(self._ros_publish_event)
        self._ros_event_publisher = Node.create_publisher(
            self, TransitionEvent, "~/transition_event", 10
        )
        if not enable_communication_interface:
            return
        for srv_type, name, answer in (
            (ChangeState, "change_state", self._ros_on_change_state),
            (GetState, "get_state", self._ros_on_get_state),
            (GetAvailableStates, "get_available_states", self._ros_on_get_states),
            (GetAvailableTransitions, "get_available_transitions", self._ros_on_get_transitions),
            (GetAvailableTransitions, "get_transition_graph", self._ros_on_get_graph),
        ):
            service = Node.create_service(
                self, srv_type, f"~/{name}", answer, callback_group=callback_group
            )
            setattr(self, f"_service_{name}", service)
            setattr(self._state_machine, f"service_{name}", service)

    def trigger_configure(self) -> TransitionCallbackReturn:
        """Go from *unconfigured* to *inactive*.

        :raises RCLError: the node is in another state; so do the others below.
        """
        return self._ros_change_state("configure")

    def trigger_cleanup(self) -> TransitionCallbackReturn:
        """Go from *inactive* to *unconfigured*."""
        return self._ros_change_state("cleanup")

    def trigger_shutdown(self) -> TransitionCallbackReturn:
        """Go to *finalized*."""
        return self._ros_change_state("shutdown")

    def trigger_activate(self) -> TransitionCallbackReturn:
        """Go from *inactive* to *active*."""
        return self._ros_change_state("activate")

    def trigger_deactivate(self) -> TransitionCallbackReturn:
        """Go from *active* to *inactive*."""
        return self._ros_change_state("deactivate")

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Configure; the node was in `state`."""
        return self._ros_tell_entities("on_configure", state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Undo what was configured."""
        return self._ros_tell_entities("on_cleanup", state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """End."""
        return self._ros_tell_entities("on_shutdown", state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start to work."""
        return self._ros_tell_entities("on_activate", state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop to work."""
        return self._ros_tell_entities("on_deactivate", state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Recover from an error of another callback: success leads to *unconfigured*, all else to
        *finalized*.
        """
        return self._ros_tell_entities("on_error", state)

    def _ros_tell_entities(self, name: str, state: LifecycleState) -> TransitionCallbackReturn:
        for entity in self._managed_entities:
            result = getattr(entity, name)(state)
            if not isinstance(result, TransitionCallbackReturn):
                raise TypeError(
                    f"{name}() of {entity!r} must return a TransitionCallbackReturn, got {result!r}"
                )
            if result != TransitionCallbackReturn.SUCCESS:
                return result
        return TransitionCallbackReturn.SUCCESS

    def add_managed_entity(self, entity: ManagedEntity) -> None:
        """Have an entity follow the transitions.

        :raises TypeError: it is no :class:`ManagedEntity`.
        """
        if not isinstance(entity, ManagedEntity):
            raise TypeError("Expected a rclpy.lifecycle.ManagedEntity instance.")
        if entity not in self._managed_entities:
            self._managed_entities.append(entity)

    def create_lifecycle_publisher(self, *args: Any, **kwargs: Any) -> LifecyclePublisher:
        """Make a publisher that publishes only while the node is active; the arguments are those of
        :meth:`rclpy.node.Node.create_publisher`.
        """
        if "publisher_class" in kwargs:
            raise TypeError(
                "create_publisher() got an unexpected keyword argument 'publisher_class'"
            )
        publisher: Any = Node.create_publisher(
            self, *args, **kwargs, publisher_class=LifecyclePublisher
        )
        self._managed_entities.append(publisher)
        return publisher

    def destroy_lifecycle_publisher(self, publisher: LifecyclePublisher) -> bool:
        """Destroy a publisher; False when it is not of this node."""
        if publisher in self._managed_entities:
            self._managed_entities.remove(publisher)
        return Node.destroy_publisher(self, publisher)

    def _ros_change_state(self, transition: int | str) -> TransitionCallbackReturn:
        state_id, label = self._state_machine.current_state
        if label in _CALLBACKS:
            raise RCLError(f"no transition {transition!r}: the node is {label}")
        before = LifecycleState(label, state_id)
        self._state_machine.trigger(transition)
        result = self._ros_run_callback(before)
        if result == TransitionCallbackReturn.ERROR:
            self._ros_run_callback(before)
        return result

    def _ros_run_callback(self, before: LifecycleState) -> TransitionCallbackReturn:
        """Call what belongs to the present state and leave it accordingly."""
        name = _CALLBACKS[self._state_machine.current_state[1]]
        try:
            result = getattr(self, name)(before)
            if not isinstance(result, TransitionCallbackReturn):
                raise TypeError(f"{name}() must return a TransitionCallbackReturn, got {result!r}")
        except Exception:
            self.get_logger().error(f"{name}() failed:\n{traceback.format_exc()}")
            result = TransitionCallbackReturn.ERROR
        self._state_machine.trigger(result.to_label())
        return result

    def _ros_publish_event(self, start: str, goal: str) -> None:
        states = [State(id=STATES[label], label=label) for label in (start, goal)]
        event = TransitionEvent(start_state=states[0], goal_state=states[1])
        self._ros_event_publisher.publish(event)

    def _ros_on_change_state(self, request: Any, response: Any) -> Any:
        try:
            result = self._ros_change_state(request.transition.label or request.transition.id)
        except RCLError as error:
            self.get_logger().warning(str(error))
            response.success = False
        else:
            response.success = result == TransitionCallbackReturn.SUCCESS
        return response

    def _ros_on_get_state(self, request: Any, response: Any) -> Any:
        response.current_state.id, response.current_state.label = self._state_machine.current_state
        return response

    def _ros_on_get_states(self, request: Any, response: Any) -> Any:
        response.available_states = [State(id=n, label=label) for label, n in STATES.items()]
        return response

    def _ros_on_get_transitions(self, request: Any, response: Any) -> Any:
        response.available_transitions = _messages(self._state_machine.available_transitions)
        return response

    def _ros_on_get_graph(self, request: Any, response: Any) -> Any:
        response.available_transitions = _messages(TRANSITIONS)
        return response


def _messages(transitions: Iterable[StateTransition]) -> list[Any]:
    return [
        TransitionDescription(
            transition=Transition(id=one.id, label=one.label),
            start_state=State(id=STATES[one.start], label=one.start),
            goal_state=State(id=STATES[one.goal], label=one.goal),
        )
        for one in transitions
    ]


class LifecycleNode(LifecycleNodeMixin, Node):
    """A node with a life cycle."""

    def __init__(
        self, node_name: str, *, enable_communication_interface: bool = True, **kwargs: Any
    ) -> None:
        """Create a node; see :class:`LifecycleNodeMixin` and :class:`rclpy.node.Node`."""
        Node.__init__(self, node_name, **kwargs)
        LifecycleNodeMixin.__init__(
            self, enable_communication_interface=enable_communication_interface
        )
