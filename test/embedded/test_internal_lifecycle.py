# SPDX-License-Identifier: Apache-2.0
"""Lifecycle nodes survive what ends those of the real rclpy."""

import pytest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn


@pytest.mark.parametrize("number", [3, 10, 99])
def test_unknown_transitions_are_refused(context, spin, number):
    node = LifecycleNode("managed", context=context)
    client = node.create_client(ChangeState, "managed/change_state")
    assert client.wait_for_service(60)
    future = client.call_async(ChangeState.Request(transition=Transition(id=number)))
    assert spin(future.done, node)
    assert not future.result().success
    assert node.trigger_configure() == TransitionCallbackReturn.SUCCESS
    node.destroy_node()


def test_callbacks_that_return_nothing_fail(context, capfd):
    class Forgetful(LifecycleNode):
        def on_configure(self, state):
            pass

    node = Forgetful("managed", context=context)
    assert node.trigger_configure() == TransitionCallbackReturn.ERROR
    assert (
        "on_configure() must return a TransitionCallbackReturn, got None" in capfd.readouterr().err
    )
    node.destroy_node()
