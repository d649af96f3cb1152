# SPDX-License-Identifier: Apache-2.0
"""Requests and responses that go astray: as few as can be, and none without a word."""

from collections import deque

import pytest
from rclpy.impl.service_ends import pack, rmw_request_id_t, unpack
from rclpy.qos import qos_profile_services_default
from std_srvs.srv import SetBool

from embedded_ros.interfaces.registry import registry
from embedded_ros.transport.graph import dds_type_name

YES = SetBool.Request(data=True)


class Flip:
    """A node that serves ``flip`` and keeps what it was asked, and nodes that call it."""

    def __init__(self, make_node, spin):
        self.make_node, self.spin = make_node, spin
        self.asked = []
        self.server, self.user = make_node("server"), make_node("user")
        self.service = self.server.create_service(SetBool, "flip", self.flip)
        self.client = self.connect(self.user)

    def flip(self, request, response):
        self.asked.append(request.data)
        response.success = not request.data
        return response

    def connect(self, node):
        client = node.create_client(SetBool, "flip")
        assert client.wait_for_service(60)
        return client

    def serve(self, count):
        """Have the server alone serve so many requests in all."""
        assert self.spin(lambda: len(self.asked) == count, self.server)


@pytest.fixture
def flip(make_node, spin):
    return Flip(make_node, spin)


@pytest.fixture
def told(capfd, spin):
    """Return a function that spins a node until the log says something, and gives the log."""
    heard = []

    def told(text, *nodes):
        def said():
            heard.extend(capfd.readouterr())
            return text in "".join(heard)

        assert spin(said, *nodes), "".join(heard)
        return "".join(heard)

    return told


def test_a_request_whose_client_has_left_is_served(flip, told):
    flip.client.call_async(YES)
    flip.user.destroy_client(flip.client)
    flip.serve(1)
    assert "[WARN]" in told("a client of '/flip' went away before it was answered", flip.server)


def test_a_server_that_leaves_without_an_answer_is_told_of(flip, told):
    flip.client.call_async(YES)
    flip.client.call_async(YES)
    flip.server.destroy_service(flip.service)
    log = told("the server of '/flip' went away with 2 requests unanswered", flip.user)
    assert "[WARN]" in log and "[user]" in log


def test_a_call_that_nobody_hears_is_told_of(node, told):
    client = node.create_client(SetBool, "flip")
    future = client.call_async(YES)
    assert "[WARN]" in told("nobody served '/flip' when it was called: a request lost", node)
    assert not future.done()


def test_nothing_is_told_where_nothing_is_lost(flip, told):
    answered, given_up = flip.client.call_async(YES), flip.client.call_async(YES)
    flip.client.remove_pending_request(given_up)
    assert flip.spin(answered.done, flip.server, flip.user)
    flip.server.destroy_service(flip.service)
    other = flip.make_node("other").create_client(SetBool, "other")
    other.call_async(YES)
    log = told("nobody served '/other'", flip.user, other._node)
    assert "'/flip'" not in log


def test_many_may_call_at_once(flip):
    clients = [flip.connect(flip.user) for _ in range(25)]
    futures = [client.call_async(YES) for client in clients]  # with a depth of ten
    assert flip.spin(lambda: all(f.done() for f in futures), flip.server, flip.user)


def test_what_is_sent_at_once_can_all_be_sent_again(flip):
    # A dozen responses to clients that had only just been found: the first was lost now and then.
    ends = {e.topic: e for e in flip.user.context.participant.endpoints() if not e.is_reader}
    assert ends["rq/flipRequest"].qos.depth == ends["rr/flipReply"].qos.depth == 100


def test_too_many_requests_at_once_are_told_of(flip, told):
    flip.service._queue = deque(maxlen=2)  # not the thousand that it has room for
    for n in range(5):
        flip.client.call_async(SetBool.Request(data=n > 2))
    flip.serve(2)
    assert flip.asked == [True, True]  # the newest
    told("'/flip' keeps 2 messages for a busy node: lost the oldest 3", flip.server)


def test_responses_to_others_do_not_push_out_ones_own(flip):
    mine = flip.client.call_async(YES)
    flip.serve(1)
    other_node = flip.make_node("other")
    other = flip.connect(other_node)
    for count in range(2, 32):
        theirs = other.call_async(YES)
        assert flip.spin(theirs.done, flip.server, other_node)
        assert len(flip.asked) == count
    assert flip.spin(mine.done, flip.user)


def end_of(node, kind, part, announced):
    """A bare end of the service ``flip``: a ``writer`` of requests, a ``reader`` of replies."""
    topic = "rq/flipRequest" if kind == "writer" else "rr/flipReply"
    name = part._spec_.name
    qos = qos_profile_services_default.decide()
    create = getattr(node.context.participant, f"create_{kind}")
    return create(topic, dds_type_name(name), registry.type_hash(name), qos, announced)


def ask(node, spin, announced):
    """Send a request as another program would; give what must stay for it to stay."""
    writer = end_of(node, "writer", SetBool.Request, announced)
    assert spin(lambda: writer.matched() == 1, node)
    writer.write(pack(registry.serializer(SetBool.Request)(YES), rmw_request_id_t(77, 5)))
    return writer


def test_a_client_that_cannot_be_answered_is_told_of(flip, told):
    writer = ask(flip.user, flip.spin, "")  # no identity, as of Fast DDS
    told("a client of another middleware called '/flip': that cannot be answered", flip.server)
    assert not flip.asked
    writer.close()


def test_a_client_that_is_slow_to_listen_gets_its_response(flip):
    writer = ask(flip.user, flip.spin, "clientid=ab;")
    flip.serve(1)
    reader = end_of(flip.user, "reader", SetBool.Response, "clientid=ab;")
    got = []
    assert flip.spin(lambda: got.extend(reader.take(10)) or got, flip.server)
    assert unpack(got[0].payload)[0] == rmw_request_id_t(77, 5)
    writer.close()
    reader.close()


def test_a_client_that_never_listens_is_told_of(flip, told, monkeypatch):
    monkeypatch.setattr("rclpy.service._LATE_LIMIT", 0.0)
    writer = ask(flip.user, flip.spin, "clientid=ab;")
    told("a client called '/flip' but does not listen; its response is dropped", flip.server)
    assert flip.asked == [True]
    writer.close()


@pytest.mark.processes
@pytest.mark.long
def test_a_request_to_a_killed_server_is_told_of(node, program, spin, told):
    client = node.create_client(SetBool, "flip")
    server = program("flipper.py")
    assert client.wait_for_service(60)
    server.process.kill()
    server.process.wait()
    # Until its lease is over nothing tells it from a living one; what it is sent is lost.
    assert client.service_is_ready()
    future = client.call_async(YES)
    program("flipper.py")
    told("the server of '/flip' went away with a request unanswered", node)
    assert client.wait_for_service(60)
    assert not future.done()
    again = client.call_async(YES)
    assert spin(again.done, node)
