# SPDX-License-Identifier: Apache-2.0
"""The part of a node that makes, keeps and destroys publishers, subscriptions and timers."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, cast

from embedded_ros.interfaces.registry import registry
from embedded_ros.transport.graph import NodeEntry, dds_type_name

from .callback_groups import CallbackGroup, MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from .client import Client
from .clock import Clock, ROSClock
from .constants import S_TO_NS
from .destroyable import ENDED
from .event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from .guard_condition import GuardCondition
from .impl.queued import QueuedEntity
from .impl.rcutils_logger import RcutilsLogger
from .publisher import Publisher
from .qos import QoSProfile, qos_profile_services_default
from .qos_overriding_options import QoSOverridingOptions, _declare_qos_parameters
from .service import Service
from .subscription import Subscription
from .timer import Rate, Timer
from .type_support import check_is_valid_msg_type, check_is_valid_srv_type

if TYPE_CHECKING:
    from .context import Context
    from .node import Node


class EntityHolder:
    """What a node has made."""

    _context: Context
    _ros_entry: NodeEntry
    _clock: ROSClock
    _logger: RcutilsLogger

    def __init__(self) -> None:
        self._publishers: list[Publisher] = []
        self._subscriptions: list[Subscription] = []
        self._clients: list[Client] = []
        self._services: list[Service] = []
        self._timers: list[Timer] = []
        self._guards: list[GuardCondition] = []
        self._waitables: list[Any] = []
        self._default_callback_group: CallbackGroup = MutuallyExclusiveCallbackGroup()
        self._rate_group = ReentrantCallbackGroup()

    def _wake_executor(self) -> None:
        raise NotImplementedError

    def _ros_full_name(self, name: str, service: bool = False, remap: bool = True) -> str:
        raise NotImplementedError

    def _ros_public(self, entities: list[Any]) -> list[Any]:
        """Without those that actions consist of: an action is one waitable."""
        parts = {part for one in self._waitables for part in getattr(one, "_parts", ())}
        return [entity for entity in entities if entity not in parts]

    @property
    def publishers(self) -> Iterator[Publisher]:
        """The publishers created here."""
        yield from self._ros_public(self._publishers)

    @property
    def subscriptions(self) -> Iterator[Subscription]:
        """The subscriptions created here."""
        yield from self._ros_public(self._subscriptions)

    @property
    def clients(self) -> Iterator[Client]:
        """The service clients created here."""
        yield from self._ros_public(self._clients)

    @property
    def services(self) -> Iterator[Service]:
        """The services created here."""
        yield from self._ros_public(self._services)

    @property
    def timers(self) -> Iterator[Timer]:
        """The timers created here."""
        yield from self._timers

    @property
    def guards(self) -> Iterator[GuardCondition]:
        """The guard conditions created here."""
        yield from self._guards

    @property
    def waitables(self) -> Iterator[Any]:
        """Everything else that the executor runs, QoS events included."""
        yield from self._waitables

    def queued_entities(self) -> list[QueuedEntity]:
        """What is fed by readers, in the order in which executors serve it."""
        return [*self._subscriptions, *self._clients, *self._services]

    def add_waitable(self, waitable: Any) -> None:
        """Have the executor run a :class:`~rclpy.waitable.Waitable`."""
        self._waitables.append(waitable)
        self._wake_executor()

    def remove_waitable(self, waitable: Any) -> None:
        """Have it run no longer."""
        self._waitables.remove(waitable)
        self._wake_executor()

    def _ros_profile(
        self,
        qos_or_depth: QoSProfile | int,
        kind: type[Publisher | Subscription],
        topic: str,
        options: QoSOverridingOptions | None,
    ) -> QoSProfile:
        """A profile from what was given and, where options say so, from parameters."""
        if isinstance(qos_or_depth, QoSProfile):
            if options is None:
                return qos_or_depth
            profile = copy.copy(qos_or_depth)
            full = self._ros_full_name(topic)
            _declare_qos_parameters(kind, cast("Node", self), full, profile, options)
            return profile
        if isinstance(qos_or_depth, int):
            if qos_or_depth < 0:
                raise ValueError("history depth must be greater than or equal to zero")
            profile = QoSProfile(depth=qos_or_depth)
            return self._ros_profile(profile, kind, topic, options)
        raise TypeError(f"Expected QoSProfile or int, but received {type(qos_or_depth)!r}")

    def _ros_announce(self, writer: Any = None, reader: Any = None, remove: bool = False) -> None:
        """Tell the graph which endpoints this node has."""
        for endpoint, known in (
            (writer, self._ros_entry.writers),
            (reader, self._ros_entry.readers),
        ):
            if endpoint is not None:
                if not remove:
                    known.append(endpoint.guid)
                elif endpoint.guid in known:
                    known.remove(endpoint.guid)
        if self._context.ok():
            self._context.graph.announce()

    def create_publisher(
        self,
        msg_type: Any,
        topic: str,
        qos_profile: QoSProfile | int,
        *,
        callback_group: CallbackGroup | None = None,
        event_callbacks: PublisherEventCallbacks | None = None,
        qos_overriding_options: QoSOverridingOptions | None = None,
        publisher_class: type[Publisher] = Publisher,
    ) -> Publisher:
        """Make a publisher; an int as QoS is the history depth.

        :raises AttributeError: ``msg_type`` is no ROS interface.
        :raises InvalidTopicNameException: the topic name is invalid.
        :raises InvalidQosOverridesError: the options' callback refuses what parameters ask for.
        """
        profile = self._ros_profile(qos_profile, Publisher, topic, qos_overriding_options)
        publisher = publisher_class(
            cast("Node", self),
            msg_type,
            topic,
            profile,
            event_callbacks=event_callbacks or PublisherEventCallbacks(),
            callback_group=callback_group or self._default_callback_group,
        )
        self._waitables.extend(publisher.event_handlers)
        self._publishers.append(publisher)
        self._wake_executor()
        return publisher

    def create_subscription(
        self,
        msg_type: Any,
        topic: str,
        callback: Callable[..., Any],
        qos_profile: QoSProfile | int,
        *,
        callback_group: CallbackGroup | None = None,
        event_callbacks: SubscriptionEventCallbacks | None = None,
        qos_overriding_options: QoSOverridingOptions | None = None,
        raw: bool = False,
    ) -> Subscription:
        """Make a subscription; the callback takes the message, or message and message info.

        :raises AttributeError: ``msg_type`` is no ROS interface.
        :raises InvalidTopicNameException: the topic name is invalid.
        :raises InvalidQosOverridesError: the options' callback refuses what parameters ask for.
        """
        profile = self._ros_profile(qos_profile, Subscription, topic, qos_overriding_options)
        subscription = Subscription(
            cast("Node", self),
            msg_type,
            topic,
            callback,
            callback_group or self._default_callback_group,
            profile,
            raw,
            event_callbacks=event_callbacks or SubscriptionEventCallbacks(),
        )
        self._waitables.extend(subscription.event_handlers)
        return self._ros_keep(subscription, self._subscriptions)

    def _ros_open(self, msg_type: Any, full_topic: str, profile: QoSProfile, writer: bool) -> Any:
        """Make a writer or reader and announce it as this node's."""
        check_is_valid_msg_type(msg_type)
        raw = profile.avoid_ros_namespace_conventions
        dds_topic = full_topic[1:] if raw else "rt" + full_topic
        peers = []
        if "BEST_AVAILABLE" in (profile.reliability.name, profile.durability.name):
            endpoints = self._context.graph.endpoints()
            peers = [e.qos for e in endpoints if e.topic == dds_topic and e.is_reader == writer]
        participant = self._context.participant
        create = participant.create_writer if writer else participant.create_reader
        name = msg_type._spec_.name
        endpoint: Any = create(
            dds_topic, dds_type_name(name), registry.type_hash(name), profile.decide(peers, writer)
        )
        self._ros_announce(**{"writer" if writer else "reader": endpoint})
        return endpoint

    def create_client(
        self,
        srv_type: Any,
        srv_name: str,
        *,
        qos_profile: QoSProfile = qos_profile_services_default,
        callback_group: CallbackGroup | None = None,
    ) -> Client:
        """Make a service client.

        :raises NoTypeSupportImportedException: ``srv_type`` is no service class.
        :raises InvalidServiceNameException: the service name is invalid.
        """
        check_is_valid_srv_type(srv_type)
        group = callback_group or self._default_callback_group
        client = Client(cast("Node", self), srv_type, srv_name, qos_profile, group)
        return self._ros_keep(client, self._clients)

    def create_service(
        self,
        srv_type: Any,
        srv_name: str,
        callback: Callable[[Any, Any], Any],
        *,
        qos_profile: QoSProfile = qos_profile_services_default,
        callback_group: CallbackGroup | None = None,
    ) -> Service:
        """Make a service server; the callback takes request and response and returns the response.

        :raises NoTypeSupportImportedException: ``srv_type`` is no service class.
        :raises InvalidServiceNameException: the service name is invalid.
        """
        check_is_valid_srv_type(srv_type)
        group = callback_group or self._default_callback_group
        service = Service(cast("Node", self), srv_type, srv_name, callback, group, qos_profile)
        return self._ros_keep(service, self._services)

    def _ros_keep(self, entity: Any, known: list[Any]) -> Any:
        """Have the executor serve a new entity."""
        entity.callback_group.add_entity(entity)
        known.append(entity)
        self._wake_executor()
        return entity

    def create_timer(
        self,
        timer_period_sec: float,
        callback: Callable[..., Any] | None,
        callback_group: CallbackGroup | None = None,
        clock: Clock | None = None,
        autostart: bool = True,
    ) -> Timer:
        """Make a timer with a period in seconds, on the node's clock unless another is given."""
        self._context.check()
        group = callback_group or self._default_callback_group
        timer = Timer(
            callback,
            group,
            int(float(timer_period_sec) * S_TO_NS),
            clock or self._clock,
            context=self._context,
            autostart=autostart,
        )
        timer._wake = self._wake_executor
        return self._ros_keep(timer, self._timers)

    def create_guard_condition(
        self, callback: Callable[..., Any], callback_group: CallbackGroup | None = None
    ) -> GuardCondition:
        """Make a guard condition."""
        self._context.check()
        group = callback_group or self._default_callback_group
        guard = GuardCondition(callback, group, context=self._context)
        guard._wake = self._wake_executor
        return self._ros_keep(guard, self._guards)

    def create_rate(self, frequency: float, clock: Clock | None = None) -> Rate:
        """Make a rate in Hz.

        :raises ValueError: the frequency is not positive.
        """
        if frequency <= 0:
            raise ValueError(f"frequency must be > 0, got {frequency}")
        timer = self.create_timer(1.0 / frequency, None, self._rate_group, clock)
        return Rate(timer, context=self._context)

    def _ros_restart_timers(self, clock: Clock) -> None:
        for timer in self._timers:
            if timer.clock is clock:
                timer.on_clock_jump()
        self._wake_executor()

    def destroy_publisher(self, publisher: Publisher) -> bool:
        """Destroy a publisher; False when it is not of this node."""
        return self._ros_destroy(publisher, self._publishers)

    def destroy_subscription(self, subscription: Subscription) -> bool:
        """Destroy a subscription; False when it is not of this node."""
        return self._ros_destroy(subscription, self._subscriptions)

    def _ros_destroy(self, entity: Any, known: list[Any]) -> bool:
        if entity not in known:
            return False
        known.remove(entity)
        handlers = getattr(entity, "event_handlers", ())
        self._waitables = [waitable for waitable in self._waitables if waitable not in handlers]
        entity.destroy()
        self._wake_executor()
        return True

    def destroy_client(self, client: Client) -> bool:
        """Destroy a service client; False when it is not of this node."""
        return self._ros_destroy(client, self._clients)

    def destroy_service(self, service: Service) -> bool:
        """Destroy a service server; False when it is not of this node."""
        return self._ros_destroy(service, self._services)

    def destroy_timer(self, timer: Timer) -> bool:
        """Destroy a timer; False when it is not of this node."""
        return self._ros_destroy(timer, self._timers)

    def destroy_guard_condition(self, guard: GuardCondition) -> bool:
        """Destroy a guard condition; False when it is not of this node."""
        return self._ros_destroy(guard, self._guards)

    def destroy_rate(self, rate: Rate) -> bool:
        """Destroy a rate and its timer; False when it is not of this node."""
        rate.destroy()
        return self.destroy_timer(rate._timer)

    def _ros_destroy_entities(self, orphan: bool) -> None:
        """Destroy everything that was made here; `orphan`: because the context was shut down."""
        made: tuple[list[Any], ...]
        made = (
            self._clients,
            self._services,
            self._publishers,
            self._subscriptions,
            self._timers,
            self._guards,
        )
        everything: list[Any] = [entity for known in made for entity in known]
        for entity in everything:
            entity.destroy()
            if orphan:
                entity._ros_orphaned = True
                entity._endpoint = entity._writer = ENDED
        for known in (*made, self._waitables):
            known.clear()
