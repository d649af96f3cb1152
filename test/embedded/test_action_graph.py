# SPDX-License-Identifier: Apache-2.0
"""What actions are made of, and how the graph shows them."""

import pytest
from action_msgs.msg import GoalStatusArray
from action_msgs.srv import CancelGoal
from example_interfaces.action import Fibonacci
from rclpy.action import (
    ActionClient,
    ActionServer,
    get_action_client_names_and_types_by_node,
    get_action_names_and_types,
    get_action_server_names_and_types_by_node,
)
from rclpy.action.server import RCLError
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.qos import QoSProfile, ReliabilityPolicy, qos_profile_action_status_default

TYPE = "example_interfaces/action/Fibonacci"


@pytest.fixture
def ends(make_node):
    """Make action servers and clients that are destroyed with the test."""
    made = []

    def make(kind, node, name, *args, **kwargs):
        made.append(kind(node, Fibonacci, name, *args, **kwargs))
        return made[-1]

    yield make
    for end in made:
        end.destroy()


def test_an_action_is_one_waitable_of_its_node(node):
    kinds = ("publishers", "subscriptions", "clients", "services", "timers", "waitables")
    before = {kind: list(getattr(node, kind)) for kind in kinds}
    group = ReentrantCallbackGroup()
    server = ActionServer(node, Fibonacci, "count", print, callback_group=group)
    client = ActionClient(node, Fibonacci, "count")
    assert group.has_entity(server)
    assert node.default_callback_group.has_entity(client)
    made = before | {"waitables": [*before["waitables"], server, client]}
    assert {kind: list(getattr(node, kind)) for kind in kinds} == made
    server.destroy()
    client.destroy()
    assert {kind: list(getattr(node, kind)) for kind in kinds} == before


@pytest.mark.parametrize("end", [ActionClient, lambda *args: ActionServer(*args, print)])
def test_bad_types_and_names(node, end):
    before = list(node.waitables)
    with pytest.raises(AttributeError):
        end(node, int, "count")
    for name in ("", "1count", "a//b", "a b", "count/"):
        with pytest.raises(ValueError, match="ailed to create action"):
            end(node, Fibonacci, name)
    assert list(node.waitables) == before


def test_arguments_of_a_server(node):
    with pytest.raises(TypeError):
        ActionServer(node, Fibonacci, "count", None)
    with pytest.raises(ValueError, match="non-negative"):
        ActionServer(node, Fibonacci, "count", print, result_timeout=-1)
    server = ActionServer(node, Fibonacci, "count", print)
    assert server.action_type is Fibonacci
    server.destroy()


def test_the_graph_shows_actions(make_node, ends, spin):
    first, second = make_node("first", namespace="/one"), make_node("second")
    ends(ActionServer, first, "count", print)
    ends(ActionClient, first, "~/own")
    ends(ActionClient, second, "one/count")
    both = [("/one/count", [TYPE]), ("/one/first/own", [TYPE])]
    assert spin(lambda: all(pair in get_action_names_and_types(second) for pair in both))
    servers, clients = (
        get_action_server_names_and_types_by_node,
        get_action_client_names_and_types_by_node,
    )
    assert spin(lambda: servers(second, "first", "/one") == both[:1])
    assert spin(lambda: clients(second, "first", "/one") == both[1:])
    assert spin(lambda: clients(first, "second", "/") == both[:1])
    assert servers(first, "second", "/") == []
    for look in (servers, clients):
        with pytest.raises(RCLError):
            look(first, "nobody", "/")


def test_an_action_on_the_wire(make_node, ends, spin):
    """Three services and two topics, with the types and names of ROS 2."""
    node, watcher = make_node("server"), make_node("watcher")
    ends(ActionServer, node, "count", print)

    def shows(getter, expected):
        return spin(lambda: expected.items() <= dict(getter("server", "/")).items())

    assert shows(
        watcher.get_service_names_and_types_by_node,
        {
            "/count/_action/send_goal": [f"{TYPE}_SendGoal"],
            "/count/_action/get_result": [f"{TYPE}_GetResult"],
            "/count/_action/cancel_goal": ["action_msgs/srv/CancelGoal"],
        },
    )
    assert shows(
        watcher.get_publisher_names_and_types_by_node,
        {
            "/count/_action/feedback": [f"{TYPE}_FeedbackMessage"],
            "/count/_action/status": ["action_msgs/msg/GoalStatusArray"],
        },
    )
    (status,) = watcher.get_publishers_info_by_topic("/count/_action/status")
    assert status.qos_profile.durability == qos_profile_action_status_default.durability
    assert Fibonacci.Impl.CancelGoalService is CancelGoal
    assert Fibonacci.Impl.GoalStatusMessage is GoalStatusArray


def test_qos_of_the_parts(make_node, ends, spin):
    node = make_node("server")
    rough = QoSProfile(depth=3, reliability=ReliabilityPolicy.BEST_EFFORT)
    ends(
        ActionServer, node, "a", print, feedback_pub_qos_profile=rough, status_pub_qos_profile=rough
    )
    ends(ActionClient, node, "b", feedback_sub_qos_profile=rough, status_sub_qos_profile=rough)
    for topic in ("feedback", "status"):
        for name, infos in (
            (f"/a/_action/{topic}", node.get_publishers_info_by_topic),
            (f"/b/_action/{topic}", node.get_subscriptions_info_by_topic),
        ):
            assert spin(lambda i=infos, n=name: len(i(n)) == 1)
            assert infos(name)[0].qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT


def test_names_may_be_remapped(make_node, ends, spin):
    """Each part by its own name, as in ROS 2 Jazzy."""
    parts = ("send_goal", "get_result", "cancel_goal", "feedback", "status")
    rules = [f"-r count/_action/{part}:=total/_action/{part}".split() for part in parts]
    server = make_node(
        "server", cli_args=["--ros-args", *(word for rule in rules for word in rule)]
    )
    ends(ActionServer, server, "count", print)
    client = ends(ActionClient, make_node("client"), "total")
    assert client.wait_for_server(60)
    assert spin(lambda: ("/total", [TYPE]) in get_action_names_and_types(server))
