# SPDX-License-Identifier: Apache-2.0
"""Action servers, seen by an action client."""

import threading
import time

import pytest
from action_msgs.msg import GoalStatus, GoalStatusArray
from example_interfaces.action import Fibonacci
from rclpy.action import GoalResponse
from rclpy.action.server import RCLError
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.qos import qos_profile_action_status_default
from rclpy.task import Future
from unique_identifier_msgs.msg import UUID

Goal, Result, Feedback = Fibonacci.Goal, Fibonacci.Result, Fibonacci.Feedback


def wait_for(condition):
    end = time.monotonic() + 60
    while not condition() and time.monotonic() < end:
        time.sleep(0.01)
    assert condition()


def test_the_whole_life_of_a_goal(bench):
    seen = []

    async def execute(handle):
        bench.handles.append(handle)
        seen.append((handle.status, handle.is_active, handle.request.order))
        for i in range(5):
            handle.publish_feedback(Feedback(sequence=[i]))
        for wrong in (Goal(), Fibonacci.Impl.FeedbackMessage(), None):
            with pytest.raises(TypeError):
                handle.publish_feedback(wrong)
        await gate
        handle.succeed()
        return Result(sequence=[1, 1, 2])

    gate, feedback = Future(), []
    bench.start(execute)
    goal = bench.send(3, feedback_callback=feedback.append)
    assert goal.accepted
    assert goal.stamp.sec > 0
    bench.spin(lambda: len(feedback) == 5 and goal.status == GoalStatus.STATUS_EXECUTING)
    assert [list(message.feedback.sequence) for message in feedback] == [[i] for i in range(5)]
    assert feedback[0].goal_id == goal.goal_id
    assert seen == [(GoalStatus.STATUS_EXECUTING, True, 3)]
    waiting = goal.get_result_async()
    gate.set_result(None)
    answer = bench.finish(waiting)
    assert (answer.status, list(answer.result.sequence)) == (
        GoalStatus.STATUS_SUCCEEDED,
        [1, 1, 2],
    )
    bench.spin(lambda: goal.status == GoalStatus.STATUS_SUCCEEDED)
    assert bench.handles[0].status == GoalStatus.STATUS_SUCCEEDED
    assert not bench.handles[0].is_active


@pytest.mark.parametrize("answer", [GoalResponse.REJECT, True, None])
def test_a_goal_that_is_not_accepted(bench, answer):
    bench.start(goal_callback=lambda goal: answer)
    goal = bench.send()
    assert not goal.accepted
    assert bench.result(goal).status == GoalStatus.STATUS_UNKNOWN
    assert bench.handles == []


def test_the_goal_callback_sees_the_goal_and_may_be_a_coroutine_function(bench):
    async def decide(goal):
        return GoalResponse.ACCEPT if goal.order > 1 else GoalResponse.REJECT

    bench.start(goal_callback=decide)
    assert [bench.send(order).accepted for order in (1, 2)] == [False, True]


def test_execution_may_be_deferred(bench):
    bench.defer()
    goal = bench.send(7)
    assert goal.accepted
    (handle,) = bench.handles
    assert handle.status == GoalStatus.STATUS_ACCEPTED
    assert handle.goal_id == goal.goal_id
    future = goal.get_result_async()
    handle.execute()
    assert list(bench.finish(future).result.sequence) == [7]
    with pytest.raises(RCLError):
        handle.execute()


def test_execute_takes_another_callback(bench):
    bench.defer()

    def execute(handle):
        handle.abort()
        return Result(sequence=[-1])

    goal = bench.send()
    bench.handles[0].execute(execute)
    answer = bench.result(goal)
    assert (answer.status, list(answer.result.sequence)) == (GoalStatus.STATUS_ABORTED, [-1])


def test_transitions_that_are_not_allowed(bench):
    bench.defer()
    goal = bench.send()
    (handle,) = bench.handles
    for step in (handle.succeed, handle.abort, handle.canceled):
        with pytest.raises(RCLError, match="ACCEPTED"):
            step()
    handle.execute(lambda handle: Result())
    with pytest.raises(RCLError, match="EXECUTING"):
        handle.canceled()
    handle.succeed()
    for step in (handle.succeed, handle.abort, handle.canceled, handle.execute):
        with pytest.raises(RCLError, match="SUCCEEDED"):
            step()
    assert bench.result(goal).status == GoalStatus.STATUS_SUCCEEDED


def test_a_goal_without_an_end_is_aborted(bench):
    bench.start(lambda handle: Result(sequence=[4]))
    answer = bench.result(bench.send())
    assert (answer.status, list(answer.result.sequence)) == (GoalStatus.STATUS_ABORTED, [4])


def test_a_goal_whose_callback_raises_is_aborted(bench, capfd):
    async def execute(handle):
        raise ValueError("out of numbers")

    bench.start(execute)
    answer = bench.result(bench.send())
    assert (answer.status, list(answer.result.sequence)) == (GoalStatus.STATUS_ABORTED, [])
    assert "out of numbers" in capfd.readouterr().err
    bench.server.register_execute_callback(bench.succeed)
    assert bench.result(bench.send()).status == GoalStatus.STATUS_SUCCEEDED


def test_goals_run_side_by_side(bench):
    gates = [Future(), Future()]

    async def execute(handle):
        await gates[handle.request.order]
        handle.succeed()
        return Result(sequence=[handle.request.order])

    bench.start(execute)
    first, second = (bench.send(order).get_result_async() for order in (0, 1))
    gates[1].set_result(None)
    assert list(bench.finish(second).result.sequence) == [1]
    assert not first.done()
    gates[0].set_result(None)
    assert list(bench.finish(first).result.sequence) == [0]


def test_a_new_goal_preempts_the_old_one(bench):
    current = []

    def start(handle):
        if current and current[0].is_active:
            current.pop().abort()
        current.append(handle)
        handle.execute()

    async def execute(handle):
        while handle.is_active and handle.request.order == 0:
            await tick()
        if handle.is_active:
            handle.succeed()
        return Result(sequence=[handle.request.order])

    async def tick():
        future = Future(executor=bench.executor)
        bench.executor.create_task(future.set_result, None)
        await future

    bench.start(execute, handle_accepted_callback=start)
    old, new = bench.send(0).get_result_async(), bench.send(1).get_result_async()
    assert bench.finish(new).status == GoalStatus.STATUS_SUCCEEDED
    assert bench.finish(old).status == GoalStatus.STATUS_ABORTED


def test_a_goal_id_is_accepted_once(bench):
    bench.start()
    goal_id = UUID(uuid=list(range(16)))
    raw = bench.client_node.create_client(Fibonacci.Impl.SendGoalService, "count/_action/send_goal")
    assert raw.wait_for_service(60)
    request = Fibonacci.Impl.SendGoalService.Request(goal_id=goal_id)
    answers = [bench.finish(raw.call_async(request)) for _ in range(2)]
    assert [answer.accepted for answer in answers] == [True, False]


def test_results_are_kept_and_expire(bench):
    bench.start(result_timeout=2)
    goal = bench.send(5)
    answers = [bench.result(goal) for _ in range(2)]
    assert [list(answer.result.sequence) for answer in answers] == [[5], [5]]
    bench.spin(lambda: bench.handles[0].status == GoalStatus.STATUS_UNKNOWN)
    assert not bench.handles[0].is_active
    late = bench.result(goal)
    assert (late.status, late.result) == (GoalStatus.STATUS_UNKNOWN, Result())


def test_an_active_goal_does_not_expire(bench):
    gate = Future()

    async def execute(handle):
        bench.handles.append(handle)
        if handle.request.order == 0:
            await gate
        handle.succeed()
        return Result()

    bench.start(execute, result_timeout=0)
    waiting = bench.send(0).get_result_async()
    bench.spin(lambda: bench.handles)
    ended = bench.send(1)
    bench.spin(
        lambda: len(bench.handles) == 2 and bench.handles[1].status == GoalStatus.STATUS_UNKNOWN
    )
    assert bench.handles[0].status == GoalStatus.STATUS_EXECUTING
    assert bench.result(ended).status == GoalStatus.STATUS_UNKNOWN
    gate.set_result(None)
    assert bench.finish(waiting).status == GoalStatus.STATUS_SUCCEEDED


def test_statuses_are_there_for_late_joiners(bench):
    bench.start()
    goals = [bench.send(i) for i in range(2)]
    for goal in goals:
        bench.result(goal)
    got = []
    bench.client_node.create_subscription(
        GoalStatusArray, "count/_action/status", got.append, qos_profile_action_status_default
    )
    bench.spin(lambda: got)
    assert [entry.goal_info.goal_id for entry in got[0].status_list] == [g.goal_id for g in goals]
    assert {entry.status for entry in got[0].status_list} == {GoalStatus.STATUS_SUCCEEDED}
    assert all(entry.goal_info.stamp.sec > 0 for entry in got[0].status_list)


def test_callbacks_may_be_replaced(bench):
    bench.start()
    bench.server.register_goal_callback(lambda goal: GoalResponse.REJECT)
    assert not bench.send().accepted
    bench.server.register_goal_callback(None)
    bench.server.register_handle_accepted_callback(bench.handles.append)
    goal = bench.send()
    (handle,) = bench.handles
    assert handle.status == GoalStatus.STATUS_ACCEPTED
    bench.server.register_handle_accepted_callback(None)
    assert bench.result(bench.send()).status == GoalStatus.STATUS_SUCCEEDED
    assert goal.status in (GoalStatus.STATUS_ACCEPTED, GoalStatus.STATUS_UNKNOWN)
    for wrong in (None, 7):
        with pytest.raises(TypeError):
            bench.server.register_execute_callback(wrong)


def test_callbacks_in_threads(bench, context):
    """Goals that block do so in threads of their own, if the callback group lets them."""
    both = threading.Barrier(3)

    def execute(handle):
        both.wait(60)
        handle.succeed()
        return Result(sequence=[handle.request.order])

    bench.start(execute, callback_group=ReentrantCallbackGroup())
    pool = MultiThreadedExecutor(4, context=context)
    for node in (bench.server_node, bench.client_node):
        bench.executor.remove_node(node)
        pool.add_node(node)
    thread = threading.Thread(target=pool.spin, daemon=True)
    thread.start()
    try:
        goals = [bench.client.send_goal_async(Goal(order=i)) for i in range(2)]
        both.wait(60)  # both goals are being executed now
        wait_for(lambda: all(future.done() for future in goals))
        answers = [future.result().get_result() for future in goals]
        assert [list(answer.result.sequence) for answer in answers] == [[0], [1]]
    finally:
        pool.shutdown()
        thread.join(60)


def test_a_destroyed_server(bench):
    bench.defer()
    bench.send()
    (handle,) = bench.handles
    bench.ends.remove(bench.server)
    bench.server.destroy()
    assert (handle.status, handle.is_active) == (GoalStatus.STATUS_UNKNOWN, False)
    handle.succeed()
    handle.publish_feedback(Feedback())
    bench.spin(lambda: not bench.client.server_is_ready())
    bench.start()
    assert bench.result(bench.send(2)).status == GoalStatus.STATUS_SUCCEEDED
