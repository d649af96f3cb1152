# SPDX-License-Identifier: Apache-2.0
import io

import pytest
from std_msgs.msg import Int32, String
from std_srvs.srv import SetBool


@pytest.fixture
def flip(peer):
    """A service /ns/flip that answers with what it was asked."""

    def answer(request, response):
        response.success, response.message = request.data, "it is so"
        return response

    return peer.create_service(SetBool, "flip", answer)


def test_node_list_hides_nodes_with_an_underscore(ccr, make_peer):
    for name in ("talker", "_shy"):
        make_peer(name)
    assert ccr("node", "list").out == "/talker\n"
    assert ccr("node", "list", "-c").out == "1\n"
    shown = ccr("node", "list", "-a").out.splitlines()
    assert {"/_shy", "/talker"} <= set(shown)


def test_nodes_of_one_name_are_told(ccr, make_peer):
    make_peer("twin"), make_peer("twin")
    done = ccr("node", "list")
    assert done.out == "/twin\n/twin\n"
    assert done.err.startswith("WARNING: Be aware that there are nodes")
    assert 'There are 2 nodes in the graph with the exact name "/twin".' in (
        ccr("node", "info", "/twin").err
    )


def test_node_info_has_ros2s_blocks(ccr, peer, flip):
    peer.create_publisher(String, "/chatter", 10)
    peer.create_subscription(Int32, "count", print, 10)
    peer.create_client(SetBool, "/other")
    out = ccr("node", "info", "/ns/peer").out
    titles = [line for line in out.splitlines() if line.endswith(":") and line[2] != " "]
    assert titles == [
        "  Subscribers:",
        "  Publishers:",
        "  Service Servers:",
        "  Service Clients:",
        "  Action Servers:",
        "  Action Clients:",
    ]
    assert out.startswith("/ns/peer\n  Subscribers:\n    /ns/count: std_msgs/msg/Int32\n")
    servers, clients = out.split("  Service Servers:\n")[1].split("  Service Clients:\n")
    assert "    /chatter: std_msgs/msg/String\n" in out
    assert "    /ns/flip: std_srvs/srv/SetBool\n" in servers
    assert clients.startswith("    /other: std_srvs/srv/SetBool\n")


def test_service_list_type_info_and_find(ccr, peer, flip):
    assert "/ns/flip" in ccr("service", "list").out.splitlines()
    assert "/ns/flip [std_srvs/srv/SetBool]" in ccr("service", "list", "-t").out.splitlines()
    assert ccr("service", "type", "/ns/flip").out == "std_srvs/srv/SetBool\n"
    assert ccr("service", "find", "std_srvs/srv/SetBool").out == "/ns/flip\n"
    assert ccr("service", "info", "/ns/flip").out == (
        "Type: std_srvs/srv/SetBool\nClients count: 0\nServices count: 1\n"
    )


def test_call_prints_request_and_response(ccr, flip):
    done = ccr("service", "call", "/ns/flip", "std_srvs/srv/SetBool", "{data: true}")
    assert done.code == 0
    assert done.out == (
        "requester: making request: std_srvs.srv.SetBool_Request(data=True)\n\n"
        "response:\nstd_srvs.srv.SetBool_Response(success=True, message='it is so')\n\n"
    )


def test_call_reads_standard_input_and_short_types(ccr, flip, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO("data: true"))
    done = ccr("service", "call", "ns/flip", "std_srvs/SetBool", "--stdin")
    assert "success=True" in done.out


@pytest.mark.processes
def test_call_waits_for_the_service_and_says_so(start_ccr, peer):
    process = start_ccr("service", "call", "/late", "std_srvs/srv/SetBool", "--timeout", "30")
    assert process.stdout.readline() == "waiting for service to become available...\n"
    peer.create_service(SetBool, "/late", lambda request, response: response)
    out, err = process.communicate(timeout=60)
    assert out.startswith("requester: making request: ")
    assert (process.returncode, err) == (0, "")


def test_call_gives_up(ccr, flip):
    done = ccr("service", "call", "/ns/flop", "std_srvs/srv/SetBool", "--timeout", "1.5")
    assert done.code == 2
    assert done.err == "ccr: error: no service '/ns/flop' (did you mean '/ns/flip'?)\n"


def test_call_with_another_type_than_the_servers(ccr, flip):
    done = ccr("service", "call", "/ns/flip", "std_srvs/srv/Trigger")
    assert done.code == 2
    assert done.err == (
        "ccr: error: service '/ns/flip' is of type std_srvs/srv/SetBool, not std_srvs/srv/Trigger\n"
    )


def test_call_of_a_service_that_has_clients_only(ccr, peer):
    peer.create_client(SetBool, "/wanted")
    done = ccr("service", "call", "/wanted", "std_srvs/srv/SetBool", "--timeout", "1")
    assert done.code == 2
    assert done.err == "ccr: error: service '/wanted' has clients, but no server\n"
