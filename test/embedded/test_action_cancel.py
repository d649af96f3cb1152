# SPDX-License-Identifier: Apache-2.0
"""Canceling goals."""

import pytest
from action_msgs.msg import GoalInfo, GoalStatus
from action_msgs.srv import CancelGoal
from builtin_interfaces.msg import Time
from example_interfaces.action import Fibonacci
from rclpy.action import CancelResponse
from rclpy.task import Future
from unique_identifier_msgs.msg import UUID

Result, Answer = Fibonacci.Result, CancelGoal.Response
CANCELING, CANCELED = GoalStatus.STATUS_CANCELING, GoalStatus.STATUS_CANCELED


def accept(handle):
    return CancelResponse.ACCEPT


class Waiting:
    """Executes goals: waits for the gate, then ends the goal as its state demands."""

    def __init__(self):
        self.gate, self.handles = Future(), []

    async def execute(self, handle):
        self.handles.append(handle)
        await self.gate
        handle.canceled() if handle.is_cancel_requested else handle.succeed()
        return Result(sequence=[handle.request.order])


@pytest.fixture
def waiting(bench):
    return Waiting()


@pytest.fixture
def cancel(bench):
    """Send any cancel request; its response."""

    def send(**goal_info):
        client = bench.client_node.create_client(CancelGoal, "count/_action/cancel_goal")
        assert client.wait_for_service(60)
        request = CancelGoal.Request(goal_info=GoalInfo(**goal_info))
        return bench.finish(client.call_async(request))

    return send


def ids(response):
    return [tuple(info.goal_id.uuid) for info in response.goals_canceling]


def key(goal):
    return tuple(goal.goal_id.uuid)


def test_a_goal_that_is_executing(bench, waiting):
    bench.start(waiting.execute, cancel_callback=accept)
    goal = bench.send(6)
    bench.spin(lambda: waiting.handles)
    response = bench.finish(goal.cancel_goal_async())
    assert (response.return_code, ids(response)) == (Answer.ERROR_NONE, [key(goal)])
    (handle,) = waiting.handles
    assert handle.is_cancel_requested
    assert handle.is_active
    bench.spin(lambda: goal.status == CANCELING)
    waiting.gate.set_result(None)
    answer = bench.result(goal)
    assert (answer.status, list(answer.result.sequence)) == (CANCELED, [6])
    bench.spin(lambda: goal.status == CANCELED)


@pytest.mark.parametrize("kwargs", [{}, {"cancel_callback": lambda handle: CancelResponse.REJECT}])
def test_a_request_that_is_rejected(bench, waiting, kwargs):
    bench.start(waiting.execute, **kwargs)
    goal = bench.send()
    bench.spin(lambda: waiting.handles)
    assert ids(bench.finish(goal.cancel_goal_async())) == []
    assert not waiting.handles[0].is_cancel_requested
    waiting.gate.set_result(None)
    assert bench.result(goal).status == GoalStatus.STATUS_SUCCEEDED


def test_the_cancel_callback_decides_by_goal(bench, waiting):
    async def odd_ones(handle):
        return CancelResponse.ACCEPT if handle.request.order % 2 else CancelResponse.REJECT

    bench.start(waiting.execute)
    bench.server.register_cancel_callback(odd_ones)
    goals = [bench.send(order) for order in (1, 2)]
    answers = [ids(bench.finish(goal.cancel_goal_async())) for goal in goals]
    assert answers == [[key(goals[0])], []]
    bench.server.register_cancel_callback(None)
    assert ids(bench.finish(goals[1].cancel_goal_async())) == []
    waiting.gate.set_result(None)
    statuses = [bench.result(goal).status for goal in goals]
    assert statuses == [CANCELED, GoalStatus.STATUS_SUCCEEDED]


def test_a_goal_that_is_not_executing_yet(bench):
    def execute(handle):
        assert handle.is_cancel_requested
        handle.canceled()
        return Result(sequence=[1])

    bench.defer(execute=execute, cancel_callback=accept)
    goal = bench.send()
    bench.finish(goal.cancel_goal_async())
    (handle,) = bench.handles
    assert handle.status == CANCELING
    handle.execute()
    assert bench.result(goal).status == CANCELED


@pytest.mark.parametrize("end", ["succeed", "abort"])
def test_a_goal_may_end_otherwise_all_the_same(bench, end):
    bench.defer(execute=lambda handle: getattr(handle, end)() or Result(), cancel_callback=accept)
    goal = bench.send()
    bench.finish(goal.cancel_goal_async())
    bench.handles[0].execute()
    ended = {"succeed": GoalStatus.STATUS_SUCCEEDED, "abort": GoalStatus.STATUS_ABORTED}
    assert bench.result(goal).status == ended[end]


def test_goals_that_cannot_be_canceled(bench, cancel):
    bench.start(cancel_callback=accept)
    unknown = cancel(goal_id=UUID(uuid=[7] * 16))
    assert (unknown.return_code, ids(unknown)) == (Answer.ERROR_UNKNOWN_GOAL_ID, [])
    goal = bench.send()
    bench.result(goal)
    ended = bench.finish(goal.cancel_goal_async())
    assert (ended.return_code, ids(ended)) == (Answer.ERROR_GOAL_TERMINATED, [])


def test_a_goal_that_ends_in_the_cancel_callback(bench, waiting):
    def finish_first(handle):
        handle.succeed()
        return CancelResponse.ACCEPT

    bench.start(waiting.execute, cancel_callback=finish_first)
    goal = bench.send()
    bench.spin(lambda: waiting.handles)
    assert ids(bench.finish(goal.cancel_goal_async())) == []
    assert waiting.handles[0].status == GoalStatus.STATUS_SUCCEEDED


def test_all_goals(bench, waiting, cancel):
    bench.start(waiting.execute, cancel_callback=accept)
    goals = [bench.send(i) for i in range(3)]
    bench.spin(lambda: len(waiting.handles) == 3)
    waiting.handles[1].succeed()
    response = cancel()
    assert response.return_code == Answer.ERROR_NONE
    assert sorted(ids(response)) == sorted([key(goals[0]), key(goals[2])])


def test_goals_up_to_a_time(bench, waiting, cancel):
    """All goals accepted at that time or before, and the one named."""
    bench.start(waiting.execute, cancel_callback=accept)
    goals = [bench.send(i) for i in range(3)]
    bench.spin(lambda: len(waiting.handles) == 3)
    start = goals[0].stamp.sec
    assert ids(cancel(stamp=Time(sec=start - 10))) == []
    named = cancel(stamp=Time(sec=start - 10), goal_id=goals[2].goal_id)
    assert ids(named) == [key(goals[2])]
    assert sorted(ids(cancel(stamp=Time(sec=start + 1000)))) == sorted(map(key, goals[:2]))


def test_stamps_that_make_no_sense(bench, waiting, cancel):
    bench.start(waiting.execute, cancel_callback=accept)
    bench.send()
    bench.spin(lambda: waiting.handles)
    assert ids(cancel(stamp=Time(sec=-5))) == []
    assert len(ids(cancel())) == 1
