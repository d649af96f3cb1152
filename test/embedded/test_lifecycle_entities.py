# SPDX-License-Identifier: Apache-2.0
"""Publishers and other entities that follow the transitions of a lifecycle node."""

import pytest
from rclpy.lifecycle import (
    LifecycleNode,
    LifecycleState,
    ManagedEntity,
    Node,
    SimpleManagedEntity,
    TransitionCallbackReturn,
)
from std_msgs.msg import String

SUCCESS = TransitionCallbackReturn.SUCCESS
FAILURE = TransitionCallbackReturn.FAILURE
ERROR = TransitionCallbackReturn.ERROR


@pytest.fixture
def plain(context):
    node = LifecycleNode("plain", context=context, enable_communication_interface=False)
    yield node
    node.destroy_node()


def test_publishers_publish_while_active(plain, make_node, spin):
    user, heard = make_node("user"), []
    publisher = plain.create_lifecycle_publisher(String, "text", 10)
    user.create_subscription(String, "text", heard.append, 10)
    assert spin(lambda: publisher.get_subscription_count() == 1, user)
    publisher.publish(String(data="unconfigured"))
    plain.trigger_configure()
    publisher.publish(String(data="inactive"))
    assert not publisher.is_activated
    plain.trigger_activate()
    assert publisher.is_activated
    publisher.publish(String(data="active"))
    plain.trigger_deactivate()
    publisher.publish(String(data="inactive again"))
    plain.trigger_activate()
    publisher.publish(String(data="active again"))
    assert spin(lambda: len(heard) == 2, user)
    assert [message.data for message in heard] == ["active", "active again"]
    assert plain.destroy_lifecycle_publisher(publisher)
    assert plain.trigger_deactivate() == SUCCESS
    assert publisher.is_activated
    with pytest.raises(TypeError):
        plain.create_lifecycle_publisher(String, "text", 10, publisher_class=object)


def test_entities_follow_up_to_the_first_that_fails(plain):
    class Entity(ManagedEntity):
        end = SUCCESS
        configured = 0

        def on_configure(self, state):
            self.configured += 1
            return self.end

    entity = Entity()
    plain.add_managed_entity(entity)
    plain.add_managed_entity(entity)
    entity.end = FAILURE
    assert plain.trigger_configure() == FAILURE
    entity.end = SUCCESS
    assert plain.trigger_configure() == SUCCESS
    assert entity.configured == 2
    assert plain.trigger_cleanup() == SUCCESS
    entity.end = None
    assert plain.trigger_configure() == ERROR
    with pytest.raises(TypeError):
        plain.add_managed_entity(object())


def test_methods_for_active_entities():
    done = []

    class Entity(SimpleManagedEntity):
        @SimpleManagedEntity.when_enabled
        def work(self, what):
            done.append(what)

        @SimpleManagedEntity.when_enabled(when_not_enabled=lambda: done.append("refused"))
        def toil(self, what):
            done.append(what)

    entity = Entity()
    entity.work("work")
    entity.toil("toil")
    entity.on_activate(LifecycleState("inactive", 2))
    entity.work("work")
    entity.toil("toil")
    assert done == ["refused", "work", "toil"]


def test_without_services(plain):
    assert not any("state" in service.service_name for service in plain.services)
    assert plain.trigger_configure() == SUCCESS
    assert isinstance(plain, Node)


def test_the_interface_is_on_or_off(context):
    with pytest.raises(TypeError):
        LifecycleNode("plain", context=context, enable_communication_interface="yes")
