# SPDX-License-Identifier: Apache-2.0
"""Times, durations, clocks, and simulated time."""

import time

import pytest
from builtin_interfaces.msg import Duration as DurationMsg
from builtin_interfaces.msg import Time as TimeMsg
from rclpy._rclpy_pybind11 import RCLError
from rclpy.clock import Clock, ClockType, JumpThreshold, ROSClock
from rclpy.duration import Duration, Infinite
from rclpy.parameter import Parameter
from rclpy.time import Time
from rosgraph_msgs.msg import Clock as ClockMsg


def test_time_arithmetic():
    start = Time(seconds=1, nanoseconds=5, clock_type=ClockType.ROS_TIME)
    later = start + Duration(seconds=0.5)
    assert later.nanoseconds == 1_500_000_005
    assert (later - start) == Duration(nanoseconds=500_000_000)
    assert later - Duration(seconds=0.5) == start
    assert later > start
    assert start.seconds_nanoseconds() == (1, 5)
    with pytest.raises(TypeError):
        bool(start == Time(seconds=1, clock_type=ClockType.STEADY_TIME))
    with pytest.raises(ValueError):
        start - Duration(seconds=2)


@pytest.mark.parametrize("kwargs", [{"seconds": -1}, {"nanoseconds": -1}])
def test_negative_times_are_refused(kwargs):
    with pytest.raises(ValueError):
        Time(**kwargs)


def test_messages():
    moment = Time(seconds=12, nanoseconds=34, clock_type=ClockType.ROS_TIME)
    assert moment.to_msg() == TimeMsg(sec=12, nanosec=34)
    assert Time.from_msg(moment.to_msg()) == moment
    span = Duration(seconds=-1.5)
    assert span.to_msg() == DurationMsg(sec=-2, nanosec=500_000_000)
    assert Duration.from_msg(span.to_msg()) == span
    assert Infinite > Duration(seconds=1e9)
    with pytest.raises(TypeError):
        Time.from_msg(span.to_msg())


def test_clocks():
    before = time.time_ns()
    assert before <= Clock().now().nanoseconds <= time.time_ns()
    before = time.monotonic_ns()
    steady = Clock(clock_type=ClockType.STEADY_TIME).now()
    assert before <= steady.nanoseconds <= time.monotonic_ns()
    assert isinstance(Clock(clock_type=ClockType.ROS_TIME), ROSClock)


def test_sleeping(context):
    clock = Clock(clock_type=ClockType.STEADY_TIME)
    before = time.monotonic()
    assert clock.sleep_for(Duration(seconds=0.05), context)
    assert time.monotonic() - before >= 0.05


def test_node_clock_is_ros_time(node):
    assert node.get_clock().clock_type == ClockType.ROS_TIME
    assert node.get_clock().now().to_msg().sec > 1_000_000_000


def test_simulated_time_drives_clock_and_timers(make_node, spin):
    node = make_node(parameter_overrides=[Parameter("use_sim_time", value=True)])
    source = make_node("simulator")
    publisher = source.create_publisher(ClockMsg, "/clock", 10)
    fired = []
    node.create_timer(1.0, lambda: fired.append(node.get_clock().now().nanoseconds))
    assert node.get_clock().now().nanoseconds == 0
    assert spin(lambda: publisher.get_subscription_count() == 1, node)
    seconds = [100]

    def step():
        seconds[0] += 1
        publisher.publish(ClockMsg(clock=TimeMsg(sec=seconds[0])))
        return len(fired) >= 3

    assert spin(step, node)
    assert all(100e9 < stamp <= seconds[0] * 1e9 for stamp in fired)


def test_jump_callbacks():
    clock = ROSClock()
    clock._set_ros_time_is_active(True)
    jumps = []
    threshold = JumpThreshold(min_forward=Duration(seconds=1), min_backward=None)
    with clock.create_jump_callback(threshold, post_callback=jumps.append):
        clock.set_ros_time_override(Time(seconds=0.5, clock_type=ClockType.ROS_TIME))
        assert jumps == []
        clock.set_ros_time_override(Time(seconds=10, clock_type=ClockType.ROS_TIME))
    assert len(jumps) == 1
    with pytest.raises(ValueError):
        JumpThreshold(min_forward=Duration(seconds=-1), min_backward=None)


def test_a_timer_fires_once_when_time_jumps_onto_its_beat(make_node, spin):
    node = make_node(parameter_overrides=[Parameter("use_sim_time", value=True)])
    publisher = node.create_publisher(ClockMsg, "/clock", 10)
    fired = []
    node.create_timer(1.0, lambda: fired.append(node.get_clock().now().nanoseconds // 10**9))
    steps = []
    node.create_timer(0.001, lambda: steps.append(0), clock=Clock(clock_type=ClockType.STEADY_TIME))
    assert spin(lambda: publisher.get_subscription_count() == 1, node)
    for second in (10, 13):
        publisher.publish(ClockMsg(clock=TimeMsg(sec=second)))
        assert spin(lambda second=second: fired[-1:] == [second], node)
        steps.clear()
        assert spin(lambda: len(steps) > 5, node)
    assert fired == [10, 13]


def test_changing_the_source_of_time_is_no_jump_by_a_duration():
    clock = ROSClock()
    jumps = []
    threshold = JumpThreshold(min_forward=None, min_backward=None, on_clock_change=True)
    with clock.create_jump_callback(
        threshold, pre_callback=lambda: None, post_callback=lambda jump: jumps.append(jump.delta)
    ):
        clock._set_ros_time_is_active(True)
        clock._set_ros_time_is_active(False)
    assert jumps == [Duration(), Duration()]


def test_negative_periods_are_refused(node):
    with pytest.raises(RCLError):
        node.create_timer(-1.0, None)
