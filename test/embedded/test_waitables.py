# SPDX-License-Identifier: Apache-2.0
"""Waitables of users: executors wait for what they add to the wait set."""

import pytest
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.qos import QoSProfile
from rclpy.type_support import check_for_type_support
from rclpy.waitable import NumberOfEntities, Waitable
from std_msgs.msg import String
from std_srvs.srv import Trigger

check_for_type_support(String)
check_for_type_support(Trigger)
QOS = QoSProfile(depth=10).get_c_qos_profile()
COUNTS = {"subscription": "subs", "guard_condition": "gcs"}


class One(Waitable):
    """Waits for a single entity and keeps what `take` takes from it."""

    def __init__(self, kind, entity, take):
        super().__init__(MutuallyExclusiveCallbackGroup())
        self.kind, self.entity, self.take = kind, entity, take
        self.place = None
        self.ready = False
        self.got = []

    def get_num_entities(self):
        return NumberOfEntities(**{f"num_{COUNTS.get(self.kind, self.kind + 's')}": 1})

    def add_to_wait_set(self, wait_set):
        self.place = getattr(wait_set, f"add_{self.kind}")(self.entity)

    def is_ready(self, wait_set):
        self.ready = self.ready or wait_set.is_ready(self.kind, self.place)
        return self.ready

    def take_data(self):
        self.ready = False
        return self.take(self.entity)

    async def execute(self, taken_data):
        self.got.append(taken_data)


@pytest.fixture
def one(node):
    """Add a waitable to the node, and take it away in the end."""
    made = []

    def add(*args):
        made.append(One(*args))
        node.add_waitable(made[-1])
        return made[-1]

    yield add
    for waitable in made:
        node.remove_waitable(waitable)
        waitable.entity.destroy_when_not_in_use()


def test_messages(node, spin, one):
    with node.handle:
        subscription = _rclpy.Subscription(node.handle, String, "text", QOS)
    waitable = one("subscription", subscription, lambda entity: entity.take_message(String, False))
    publisher = node.create_publisher(String, "text", 10)
    assert spin(lambda: publisher.get_subscription_count() == 1, node)
    for text in "abc":
        publisher.publish(String(data=text))
    assert spin(lambda: len(waitable.got) == 3, node)
    assert [message.data for message, _ in waitable.got] == ["a", "b", "c"]
    assert not list(node.subscriptions)


def test_requests_and_responses(node, spin, one):
    with node.handle:
        server = _rclpy.Service(node.handle, Trigger, "ask", QOS)
        client = _rclpy.Client(node.handle, Trigger, "ask", QOS)
    asked = one("service", server, lambda entity: entity.service_take_request(Trigger.Request))
    answered = one("client", client, lambda entity: entity.take_response(Trigger.Response))
    assert spin(client.service_server_is_available, node)
    number = client.send_request(Trigger.Request())
    assert spin(lambda: asked.got, node)
    request, header = asked.got[0]
    assert isinstance(request, Trigger.Request)
    server.service_send_response(Trigger.Response(message="yes"), header.request_id)
    assert spin(lambda: answered.got, node)
    header, response = answered.got[0]
    assert header.request_id.sequence_number == number
    assert response == Trigger.Response(message="yes")


def test_timers(node, spin, one):
    clock = Clock(clock_type=ClockType.STEADY_TIME)
    with clock.handle, node.context.handle:
        timer = _rclpy.Timer(clock.handle, node.context.handle, 10_000_000, True)
    waitable = one("timer", timer, lambda entity: entity.call_timer())
    assert spin(lambda: len(waitable.got) >= 3, node)


def test_guard_conditions(node, context, spin, one):
    with node.context.handle:
        guard = _rclpy.GuardCondition(node.context.handle)
    waitable = one("guard_condition", guard, lambda entity: "triggered")
    assert not spin(lambda: waitable.got, node, limit=0.3)
    guard.trigger_guard_condition()
    assert spin(lambda: waitable.got, node)
    assert not spin(lambda: len(waitable.got) > 1, node, limit=0.3)
