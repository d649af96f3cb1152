# SPDX-License-Identifier: Apache-2.0
"""Init and shutdown, executors, callback groups, timers, futures."""

import threading
import time

import pytest
import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import InvalidHandle, NotInitializedException
from rclpy.executors import (
    ExternalShutdownException,
    MultiThreadedExecutor,
    SingleThreadedExecutor,
)
from rclpy.task import Future
from std_msgs.msg import String


def test_init_and_shutdown():
    context = rclpy.Context()
    assert not context.ok()
    with pytest.raises(RuntimeError):
        rclpy.shutdown(context=context)
    rclpy.init(args=[], context=context)
    assert context.ok()
    with pytest.raises(RuntimeError):
        rclpy.init(args=[], context=context)
    called = []
    context.on_shutdown(lambda: called.append(1))
    rclpy.shutdown(context=context)
    assert called == [1]
    assert not context.ok()
    with pytest.raises(RuntimeError):
        rclpy.shutdown(context=context)
    rclpy.try_shutdown(context=context)


def test_nodes_need_an_initialised_context():
    with pytest.raises(NotInitializedException):
        rclpy.create_node("n", context=rclpy.Context())


def test_default_context_can_be_used_again():
    for _ in range(2):
        rclpy.init(args=[])
        node = rclpy.create_node("again")
        fired = []
        node.create_timer(0.01, lambda fired=fired: fired.append(1))
        rclpy.spin_once(node, timeout_sec=10)
        assert fired
        node.destroy_node()
        rclpy.shutdown()
        assert not rclpy.ok()


def next_call(timer):
    """When a timer is due, on the monotonic clock, to a millisecond."""
    while True:
        before = time.monotonic_ns()
        left = timer.time_until_next_call()
        if time.monotonic_ns() - before < 1_000_000:  # else others had the processor meanwhile
            return before + left


def test_timers_keep_their_phase_and_skip_what_they_miss(node, context):
    timer = node.create_timer(0.1, None, clock=Clock(clock_type=ClockType.STEADY_TIME))
    calls = []

    def late():
        calls.append(time.monotonic_ns())
        if len(calls) == 1:
            time.sleep(0.25)

    first = next_call(timer)
    timer.callback = late
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    while len(calls) < 3:
        executor.spin_once(timeout_sec=1)
    # Whatever was missed, the next call is a whole number of periods after the first.
    after = next_call(timer)
    remainder = (after - first) % 100_000_000
    assert min(remainder, 100_000_000 - remainder) < 5_000_000
    assert round((after - first) / 100_000_000) >= 4
    executor.shutdown()


def test_cancel_and_reset(node, spin):
    fired = []
    timer = node.create_timer(0.01, lambda: fired.append(1))
    assert spin(lambda: len(fired) >= 2, node)
    timer.cancel()
    assert timer.is_canceled()
    assert not timer.is_ready()
    count = len(fired)
    spin(lambda: False, node, limit=0.1)
    assert len(fired) == count
    timer.reset()
    assert not timer.is_canceled()
    assert spin(lambda: len(fired) > count, node)
    assert node.destroy_timer(timer)
    with pytest.raises(InvalidHandle):
        timer.cancel()


def test_a_timer_may_wait_to_be_started(node, spin):
    fired = []
    timer = node.create_timer(0.01, lambda: fired.append(1), autostart=False)
    spin(lambda: False, node, limit=0.1)
    assert fired == []
    timer.reset()
    assert spin(lambda: fired, node)


def test_spin_once_returns_after_its_timeout(node, context):
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    before = time.monotonic()
    for _ in range(3):
        executor.spin_once(timeout_sec=0.05)
    assert time.monotonic() - before >= 0.05
    executor.shutdown()


def test_exceptions_of_callbacks_leave_the_executor(node, context):
    def fail():
        raise ZeroDivisionError("on purpose")

    node.create_timer(0.01, fail)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    with pytest.raises(ZeroDivisionError):
        while True:
            executor.spin_once(timeout_sec=1)
    executor.shutdown()


def test_spin_until_future_complete(node, context):
    executor = SingleThreadedExecutor(context=context)
    future = Future()
    node.create_timer(0.02, lambda: future.set_result("done"))
    rclpy.spin_until_future_complete(node, future, executor, timeout_sec=10)
    assert future.result() == "done"
    never = Future()
    rclpy.spin_until_future_complete(node, never, executor, timeout_sec=0.05)
    assert not never.done()
    executor.shutdown()


def test_tasks_and_coroutines(node, context):
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    gate = Future(executor=executor)

    async def wait():
        return 1 + await gate

    task = executor.create_task(wait)
    other = executor.create_task(lambda value: gate.set_result(value), 41)
    executor.spin_until_future_complete(task, timeout_sec=10)
    assert other.done()
    assert task.result() == 42
    executor.shutdown()


def test_coroutine_callbacks_are_awaited(node, spin):
    gate, results = Future(), []

    async def callback(message):
        results.append((message.data, await gate))

    node.create_subscription(String, "text", callback, 1)
    publisher = node.create_publisher(String, "text", 1)
    assert spin(lambda: publisher.get_subscription_count() == 1, node)
    publisher.publish(String(data="x"))
    timer = node.create_timer(0.05, lambda: gate.set_result(7))
    timer.callback_group = ReentrantCallbackGroup()
    assert spin(lambda: results, node)
    assert results == [("x", 7)]


def test_adding_a_node_moves_it(node, context):
    first = SingleThreadedExecutor(context=context)
    second = SingleThreadedExecutor(context=context)
    assert first.add_node(node)
    assert not first.add_node(node)
    assert second.add_node(node)
    assert node not in first.get_nodes()
    assert node.executor is second
    first.shutdown()
    second.shutdown()


def test_guard_conditions_wake_from_other_threads(node, spin):
    called = []
    guard = node.create_guard_condition(lambda: called.append(threading.get_ident()))
    threading.Timer(0.05, guard.trigger).start()
    assert spin(lambda: called, node)
    assert called == [threading.get_ident()]


def _overlap(node, context, groups, wanted):
    """Most callbacks of two timers running at once in a three-threaded executor, which run for a
    while, and until so many have met.
    """
    running, most, runs = [0], [0], [0]
    lock = threading.Lock()

    def work():
        with lock:
            running[0] += 1
            runs[0] += 1
            most[0] = max(most[0], running[0])
        time.sleep(0.02)
        with lock:
            running[0] -= 1

    for group in groups:
        node.create_timer(0.005, work, callback_group=group)
    executor = MultiThreadedExecutor(3, context=context)
    executor.add_node(node)
    end = time.monotonic() + 60
    while runs[0] < 10 or (most[0] < wanted and time.monotonic() < end):
        executor.spin_once(timeout_sec=1)
    executor.shutdown()
    return most[0]


def test_a_mutually_exclusive_group_runs_one_at_a_time(node, context):
    group = MutuallyExclusiveCallbackGroup()
    assert _overlap(node, context, [group, group], 1) == 1


def test_two_groups_run_together(node, context):
    groups = [MutuallyExclusiveCallbackGroup(), MutuallyExclusiveCallbackGroup()]
    assert _overlap(node, context, groups, 2) == 2


def test_a_reentrant_group_runs_together(node, context):
    group = ReentrantCallbackGroup()
    assert _overlap(node, context, [group, group], 2) >= 2


def test_shutdown_from_another_thread_ends_spinning(node, context):
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    threading.Timer(0.1, context.try_shutdown).start()
    try:
        while context.ok():
            executor.spin_once()
    except ExternalShutdownException:
        pass
    assert not context.ok()


def test_rate_sleeps_while_another_thread_spins(node, context):
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    rate = node.create_rate(50)
    thread = threading.Thread(target=executor.spin, daemon=True)
    thread.start()
    before = time.monotonic()
    for _ in range(5):
        rate.sleep()
    assert time.monotonic() - before >= 0.06
    node.destroy_rate(rate)
    executor.shutdown()
    thread.join()


def test_shutdown_does_not_wait_for_coroutines_that_gave_way(node, context):
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    never, started = Future(), []

    async def wait():
        started.append(True)
        timer.cancel()
        await never

    timer = node.create_timer(0.0, wait)
    while not started:
        executor.spin_once(timeout_sec=0.1)
    assert executor.shutdown(timeout_sec=5.0)


def test_a_callback_may_shut_its_executor_down(node, context):
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    ended = []
    node.create_timer(0.0, lambda: ended.append(executor.shutdown()))
    thread = threading.Thread(target=executor.spin, daemon=True)
    thread.start()
    thread.join(10)
    assert not thread.is_alive()
    assert ended == [True]


def test_destroying_a_rate_wakes_its_sleepers(node):
    rate = node.create_rate(0.001)
    raised, asleep = [], threading.Event()

    def sleep():
        asleep.set()
        try:
            rate.sleep()
        except RuntimeError as error:
            raised.append(error)

    thread = threading.Thread(target=sleep, daemon=True)
    thread.start()
    asleep.wait()
    time.sleep(0.1)
    node.destroy_rate(rate)
    thread.join(10)
    assert not thread.is_alive()
    assert not raised
    with pytest.raises(RuntimeError, match="destroyed"):
        rate.sleep()
