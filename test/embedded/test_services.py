# SPDX-License-Identifier: Apache-2.0
"""Services and clients."""

import threading

import pytest
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.exceptions import InvalidServiceNameException
from rclpy.executors import MultiThreadedExecutor
from rclpy.qos import qos_profile_system_default
from rclpy.service_introspection import ServiceIntrospectionState
from service_msgs.msg import ServiceEventInfo
from std_srvs.srv import Empty, SetBool, Trigger


def flip(request, response):
    response.success = not request.data
    response.message = "flipped"
    return response


@pytest.fixture
def pair(make_node):
    """A node with a service, a node with a client that has found it, and the client."""
    server, user = make_node("server"), make_node("user")
    server.create_service(SetBool, "flip", flip)
    client = user.create_client(SetBool, "flip")
    assert client.wait_for_service(60)
    return server, user, client


def test_an_asynchronous_call_gets_the_response(pair, spin):
    *nodes, client = pair
    future = client.call_async(SetBool.Request(data=False))
    assert spin(future.done, *nodes)
    assert future.result() == SetBool.Response(success=True, message="flipped")


def test_concurrent_calls_each_get_their_own_response(pair, spin):
    *nodes, client = pair
    asked = [bool(i % 3) for i in range(8)]
    futures = [client.call_async(SetBool.Request(data=data)) for data in asked]
    assert spin(lambda: all(future.done() for future in futures), *nodes)
    assert [future.result().success for future in futures] == [not data for data in asked]


def test_clients_do_not_get_each_others_responses(pair, make_node, spin):
    server, user, client = pair
    other_node = make_node("other")
    other = other_node.create_client(SetBool, "flip")
    assert other.wait_for_service(60)
    mine = client.call_async(SetBool.Request(data=True))
    theirs = other.call_async(SetBool.Request(data=False))
    assert spin(lambda: mine.done() and theirs.done(), server, user, other_node)
    assert (mine.result().success, theirs.result().success) == (False, True)


def test_a_blocking_call_while_another_thread_spins(pair, context):
    server, user, client = pair
    executor = MultiThreadedExecutor(2, context=context)
    for one in (server, user):
        executor.add_node(one)
    thread = threading.Thread(target=executor.spin, daemon=True)
    thread.start()
    try:
        assert client.call(SetBool.Request(data=False), timeout_sec=60).success
    finally:
        executor.shutdown()
        thread.join(60)


def test_a_service_may_call_another_in_its_callback(make_node, spin, context):
    node = make_node("server")
    group = ReentrantCallbackGroup()
    node.create_service(SetBool, "flip", flip, callback_group=group)
    inner = node.create_client(SetBool, "flip", callback_group=group)

    async def outer(request, response):
        answer = await inner.call_async(SetBool.Request(data=False))
        response.success, response.message = answer.success, "by way of flip"
        return response

    node.create_service(Trigger, "outer", outer, callback_group=group)
    client = node.create_client(Trigger, "outer")
    assert client.wait_for_service(60)
    assert inner.wait_for_service(60)
    future = client.call_async(Trigger.Request())
    assert spin(future.done, node)
    assert future.result() == Trigger.Response(success=True, message="by way of flip")


def test_a_call_that_nobody_answers_times_out(node):
    client = node.create_client(Empty, "nobody")
    assert not client.service_is_ready()
    assert not client.wait_for_service(timeout_sec=0.0)
    future = client.call_async(Empty.Request())
    client.remove_pending_request(future)
    assert client.call(Empty.Request(), timeout_sec=0.05) is None


def test_wrong_types_and_names_are_refused(node):
    with pytest.raises(RuntimeError, match="service type"):
        node.create_service(SetBool.Request, "flip", flip)
    with pytest.raises(InvalidServiceNameException):
        node.create_service(SetBool, "not valid", flip)
    with pytest.raises(InvalidServiceNameException):
        node.create_client(SetBool, "1st")
    client = node.create_client(SetBool, "flip")
    with pytest.raises(TypeError):
        client.call_async(Trigger.Request())
    with pytest.raises(TypeError):
        client.call("yes", timeout_sec=0.1)


def test_a_callback_that_returns_something_else_raises(make_node, spin):
    node = make_node("server")
    node.create_service(SetBool, "flip", lambda request, response: None)
    client = node.create_client(SetBool, "flip")
    assert client.wait_for_service(60)
    future = client.call_async(SetBool.Request())
    with pytest.raises(TypeError):
        spin(future.done, node)


def test_names_are_resolved_and_remapped(make_node):
    node = make_node("server", namespace="/hand", cli_args=["--ros-args", "-r", "flip:=turn"])
    assert node.create_service(SetBool, "flip", flip).service_name == "/hand/turn"
    assert node.create_client(SetBool, "~/flip").service_name == "/hand/server/flip"


def test_destroyed_services_and_clients_leave_the_graph(make_node, spin):
    node, watcher = make_node("server"), make_node("watcher")

    def seen():
        return [name for name, _ in watcher.get_service_names_and_types() if name == "/flip"]

    service = node.create_service(SetBool, "flip", flip)
    client = node.create_client(SetBool, "flip")
    assert spin(seen, watcher)
    assert client in node.clients
    assert node.destroy_service(service)
    assert node.destroy_client(client)
    assert not node.destroy_client(client)
    assert spin(lambda: not seen(), watcher)
    assert client not in node.clients


def test_who_serves_and_who_calls_is_in_the_graph(pair, spin):
    server, user, _ = pair
    entry = ("/flip", ["std_srvs/srv/SetBool"])
    assert spin(lambda: entry in user.get_service_names_and_types_by_node("server", "/"), user)
    assert spin(lambda: entry in server.get_client_names_and_types_by_node("user", "/"), server)
    assert entry not in user.get_service_names_and_types_by_node("user", "/")


def test_introspection_publishes_what_passes(pair, spin):
    server, user, client = pair
    service = next(one for one in server.services if one.service_name == "/flip")
    events = []
    subscription = server.create_subscription(
        SetBool.Event, "/flip/_service_event", events.append, 10
    )
    for end, node in ((service, server), (client, user)):
        end.configure_introspection(
            node.get_clock(), qos_profile_system_default, ServiceIntrospectionState.CONTENTS
        )
    assert spin(lambda: subscription.get_publisher_count() == 2, server)
    client.call_async(SetBool.Request(data=True))
    assert spin(lambda: len(events) == 4, server, user)
    by_kind = {event.info.event_type: event for event in events}
    assert by_kind[ServiceEventInfo.REQUEST_SENT].request[0].data
    assert by_kind[ServiceEventInfo.RESPONSE_RECEIVED].response[0].message == "flipped"
    assert not by_kind[ServiceEventInfo.REQUEST_RECEIVED].response


@pytest.mark.processes
def test_services_across_processes(program, node, spin):
    server = program("flipper.py")
    server.wait_for_line("ready")
    client = node.create_client(SetBool, "/flip")
    assert client.wait_for_service(60)
    futures = [client.call_async(SetBool.Request(data=data)) for data in (True, False)]
    assert spin(lambda: all(future.done() for future in futures), node)
    assert [future.result().success for future in futures] == [False, True]
    assert futures[1].result().message == "2"
