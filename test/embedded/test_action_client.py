# SPDX-License-Identifier: Apache-2.0
"""Action clients."""

import gc
import signal
import threading

import pytest
from action_msgs.msg import GoalInfo, GoalStatus, GoalStatusArray
from example_interfaces.action import Fibonacci
from rclpy.action import ActionClient, CancelResponse
from rclpy.action.server import RCLError
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.qos import qos_profile_action_status_default
from rclpy.task import Future
from unique_identifier_msgs.msg import UUID

Goal, Result, Feedback = Fibonacci.Goal, Fibonacci.Result, Fibonacci.Feedback


@pytest.fixture
def client(node, executor):
    """A client whose server may be absent."""
    executor.add_node(node)
    chosen = ActionClient(node, Fibonacci, "count")
    yield chosen
    chosen.destroy()


@pytest.fixture
def spinning(bench, context):
    """Have threads spin the nodes of the bench, for calls that block."""
    pool = MultiThreadedExecutor(4, context=context)
    for node in (bench.server_node, bench.client_node):
        bench.executor.remove_node(node)
        pool.add_node(node)
    thread = threading.Thread(target=pool.spin, daemon=True)
    thread.start()
    yield
    pool.shutdown()
    thread.join(60)


class HandMade:
    """An action server of services and publishers, that answers as it is told."""

    def __init__(self, node):
        self.gate = Future()
        self.gate.set_result(None)
        self.asked = []
        impl, prefix = Fibonacci.Impl, "count/_action/"
        node.create_service(impl.SendGoalService, prefix + "send_goal", self.on_goal)
        node.create_service(impl.GetResultService, prefix + "get_result", self.on_result)
        node.create_service(impl.CancelGoalService, prefix + "cancel_goal", self.on_cancel)
        self.feedback = node.create_publisher(impl.FeedbackMessage, prefix + "feedback", 10)
        self.status = node.create_publisher(
            impl.GoalStatusMessage, prefix + "status", qos_profile_action_status_default
        )

    def tell(self, goal_id, number):
        message = Fibonacci.Impl.FeedbackMessage(goal_id=goal_id)
        message.feedback.sequence = [number]
        self.feedback.publish(message)

    def tell_status(self, goal_id, status):
        entry = GoalStatus(goal_info=GoalInfo(goal_id=goal_id), status=status)
        self.status.publish(GoalStatusArray(status_list=[entry]))

    async def on_goal(self, request, response):
        self.asked.append(request)
        self.tell(request.goal_id, 1)
        await self.gate
        response.accepted = True
        return response

    def on_result(self, request, response):
        response.status = GoalStatus.STATUS_SUCCEEDED
        response.result.sequence = [8]
        return response

    def on_cancel(self, request, response):
        response.goals_canceling = [request.goal_info]
        return response


@pytest.fixture
def hand_made(make_node, executor, client):
    node = make_node("hand_made")
    executor.add_node(node)
    chosen = HandMade(node)
    assert client.wait_for_server(60)
    return chosen


def test_without_a_server(client, spin, executor):
    assert not client.server_is_ready()
    assert not client.wait_for_server(timeout_sec=0.1)
    future = client.send_goal_async(Goal())
    for _ in range(3):
        executor.spin_once(timeout_sec=0.05)
    assert not future.done()


@pytest.mark.parametrize(
    "wrong", ["goal", None, Result(), Fibonacci.Impl.SendGoalService.Request()]
)
def test_a_goal_of_another_type(client, wrong):
    with pytest.raises(TypeError):
        client.send_goal_async(wrong)
    with pytest.raises(TypeError):
        client.send_goal(wrong)


def test_feedback_that_comes_before_the_response(hand_made, client, spin, executor):
    hand_made.gate, got = Future(), []
    goal_id = UUID(uuid=list(range(16)))
    future = client.send_goal_async(Goal(order=2), got.append, goal_id)
    assert spin(lambda: got, executor=executor)
    assert not future.done()
    assert (got[0].goal_id, list(got[0].feedback.sequence)) == (goal_id, [1])
    hand_made.gate.set_result(None)
    assert spin(future.done, executor=executor)
    assert future.result().goal_id == goal_id
    assert hand_made.asked[0].goal == Goal(order=2)


def test_feedback_goes_to_its_goal_until_the_result_is_there(
    hand_made, client, finish, spin, executor
):
    got = {"first": [], "second": []}
    first = finish(client.send_goal_async(Goal(), got["first"].append))
    second = finish(client.send_goal_async(Goal(), got["second"].append))
    finish(client.send_goal_async(Goal()))
    for number, goal in ((2, first), (3, second)):
        hand_made.tell(goal.goal_id, number)
    assert spin(lambda: all(len(messages) == 2 for messages in got.values()), executor=executor)
    assert list(finish(first.get_result_async()).result.sequence) == [8]
    executor.spin_once(timeout_sec=0.05)
    for number, goal in ((4, first), (5, second)):
        hand_made.tell(goal.goal_id, number)
    assert spin(lambda: len(got["second"]) == 3, executor=executor)
    numbers = {name: [m.feedback.sequence[0] for m in got[name]] for name in got}
    assert numbers == {"first": [1, 2], "second": [1, 3, 5]}


def test_what_a_handle_tells(hand_made, client, finish, spin, executor):
    ids = UUID(uuid=[1] * 16), UUID(uuid=[2] * 16)
    goal, other = (finish(client.send_goal_async(Goal(), goal_uuid=one)) for one in ids)
    assert goal == goal
    assert goal != other
    assert (goal.accepted, goal.status) == (True, GoalStatus.STATUS_UNKNOWN)
    assert (goal.stamp.sec, goal.stamp.nanosec) == (0, 0)
    assert "accepted=True, status=0" in repr(goal)
    hand_made.tell_status(goal.goal_id, GoalStatus.STATUS_CANCELING)
    assert spin(lambda: goal.status == GoalStatus.STATUS_CANCELING, executor=executor)
    assert other.status == GoalStatus.STATUS_UNKNOWN
    hand_made.tell_status(goal.goal_id, GoalStatus.STATUS_ABORTED)
    assert spin(lambda: goal.status == GoalStatus.STATUS_ABORTED, executor=executor)
    canceling = finish(goal.cancel_goal_async()).goals_canceling
    assert [info.goal_id for info in canceling] == [goal.goal_id]


def test_a_goal_id_that_is_accepted_twice(hand_made, client, finish):
    goal_id = UUID(uuid=[1] * 16)
    handle = finish(client.send_goal_async(Goal(), goal_uuid=goal_id))
    with pytest.raises(RuntimeError, match="same ID"):
        finish(client.send_goal_async(Goal(), goal_uuid=goal_id))
    assert handle.accepted


def test_a_handle_may_be_dropped(hand_made, client, finish, spin, executor):
    goal_id = finish(client.send_goal_async(Goal())).goal_id
    kept = finish(client.send_goal_async(Goal()))
    gc.collect()
    hand_made.tell_status(goal_id, GoalStatus.STATUS_EXECUTING)
    hand_made.tell_status(kept.goal_id, GoalStatus.STATUS_EXECUTING)
    assert spin(lambda: kept.status == GoalStatus.STATUS_EXECUTING, executor=executor)


def test_a_destroyed_client(node, spin, hand_made):
    client = ActionClient(node, Fibonacci, "count")
    assert client.wait_for_server(60)
    client.destroy()
    with pytest.raises(RCLError):
        client.send_goal_async(Goal())
    with pytest.raises(RCLError):
        client.server_is_ready()


def test_two_clients_of_one_server(bench):
    gates = [Future(), Future()]

    async def execute(handle):
        handle.publish_feedback(Feedback(sequence=[handle.request.order]))
        await gates[handle.request.order]
        handle.succeed()
        return Result(sequence=[handle.request.order])

    bench.start(execute)
    feedback, answers = [[], []], []
    clients = bench.client, bench.connect()
    sent = [
        bench.finish(clients[i].send_goal_async(Goal(order=i), feedback[i].append))
        for i in range(2)
    ]
    bench.spin(lambda: feedback[0] and feedback[1])
    for i in (1, 0):
        gates[i].set_result(None)
        answers.append(bench.result(sent[i]).result.sequence[0])
    assert answers == [1, 0]
    assert [[list(m.feedback.sequence) for m in got] for got in feedback] == [[[0]], [[1]]]


def test_calls_that_block(bench, spinning):
    entered, leave = threading.Event(), threading.Event()

    def execute(handle):
        if handle.request.order == 1:
            entered.set()
            leave.wait(60)
            handle.canceled()
        else:
            handle.succeed()
        return Result(sequence=[handle.request.order])

    bench.start(
        execute,
        callback_group=ReentrantCallbackGroup(),
        cancel_callback=lambda handle: CancelResponse.ACCEPT,
    )
    answer = bench.client.send_goal(Goal(order=3))
    assert (answer.status, answer.result) == (
        GoalStatus.STATUS_SUCCEEDED,
        Result(sequence=[3]),
    )
    arrived, future = threading.Event(), bench.client.send_goal_async(Goal(order=1))
    future.add_done_callback(lambda _: arrived.set())
    assert arrived.wait(60)
    assert entered.wait(60)
    goal = future.result()
    assert len(goal.cancel_goal().goals_canceling) == 1
    leave.set()
    assert goal.get_result().status == GoalStatus.STATUS_CANCELED


@pytest.mark.processes
def test_a_server_in_another_process(program, client, finish, spin, executor):
    server = program("counter.py")
    assert client.wait_for_server(60)
    got = []
    goal = finish(client.send_goal_async(Goal(order=5), got.append))
    assert spin(lambda: len(got) == 5, executor=executor)
    assert [message.feedback.sequence[0] for message in got] == [1, 2, 3, 4, 5]
    assert list(finish(goal.get_result_async()).result.sequence) == [1, 2, 3, 4, 5]

    endless = finish(client.send_goal_async(Goal(order=0), got.append))
    assert spin(lambda: len(got) > 8, executor=executor)
    assert len(finish(endless.cancel_goal_async()).goals_canceling) == 1
    assert finish(endless.get_result_async()).status == GoalStatus.STATUS_CANCELED
    server.process.send_signal(signal.SIGINT)
    assert server.finish()[0] == 0
    assert spin(lambda: not client.server_is_ready(), executor=executor)


@pytest.mark.long
@pytest.mark.processes
def test_a_server_that_is_killed_with_a_goal(program, client, finish, spin, executor):
    server = program("counter.py")
    assert client.wait_for_server(60)
    got = []
    goal = finish(client.send_goal_async(Goal(order=0), got.append))
    result = goal.get_result_async()
    assert spin(lambda: len(got) > 2, executor=executor)
    server.process.kill()
    assert spin(lambda: not client.server_is_ready(), limit=60, executor=executor)
    assert not result.done()
    server = program("counter.py")
    assert client.wait_for_server(60)
    goal = finish(client.send_goal_async(Goal(order=2)))
    assert list(finish(goal.get_result_async()).result.sequence) == [1, 2]
    server.process.send_signal(signal.SIGINT)
    assert server.finish()[0] == 0
