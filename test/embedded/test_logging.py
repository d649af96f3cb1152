# SPDX-License-Identifier: Apache-2.0
"""Loggers."""

import pytest
from rcl_interfaces.msg import Log
from rclpy.clock import Clock, ClockType
from rclpy.logging import LoggingSeverity, get_logger, set_logger_level
from rclpy.qos import DurabilityPolicy, QoSProfile


def test_levels_are_inherited():
    logger = get_logger("a_test.logger")
    child = logger.get_child("child")
    logger.set_level(LoggingSeverity.ERROR)
    try:
        assert child.get_effective_level() == LoggingSeverity.ERROR
        assert not child.info("no")
        assert child.error("yes")
        child.set_level(LoggingSeverity.DEBUG)
        assert child.debug("yes")
        assert not logger.warning("no")
    finally:
        set_logger_level(logger.name, LoggingSeverity.UNSET)
        set_logger_level(child.name, LoggingSeverity.UNSET)


def test_console_format(capfd):
    get_logger("a_test.format").warning("mind the gap")
    captured = capfd.readouterr()
    line = captured.err or captured.out
    assert "[WARN] [" in line
    assert "] [a_test.format]: mind the gap" in line


def test_filters():
    logger = get_logger("a_test.filters")
    assert [logger.info("once", once=True) for _ in range(3)] == [True, False, False]
    assert [logger.info("skip", skip_first=True) for _ in range(3)] == [False, True, True]
    clock = Clock(clock_type=ClockType.STEADY_TIME)
    passed = [
        logger.info("rare", throttle_duration_sec=60.0, throttle_time_source_type=clock)
        for _ in range(3)
    ]
    assert passed[1:] == [False, False]
    again = [logger.info("often", throttle_duration_sec=1e-9) for _ in range(3)]
    assert again == [True, True, True]


def test_a_filtered_message_bears_its_loggers_name(capfd):
    get_logger("a_test.named").warning("mind the gap", throttle_duration_sec=60.0)
    captured = capfd.readouterr()
    assert "] [a_test.named]: mind the gap" in (captured.err or captured.out)


def test_bad_arguments():
    logger = get_logger("a_test.bad")
    with pytest.raises(TypeError):
        logger.info("x", nonsense=True)
    with pytest.raises(ValueError):
        get_logger("")
    with pytest.raises(ValueError):
        logger.get_child("")
    assert _log(logger, LoggingSeverity.INFO)
    with pytest.raises(ValueError):
        _log(logger, LoggingSeverity.WARN)


def _log(logger, severity):
    return logger.log("from one line", severity)


def test_logs_are_published(node, make_node, spin):
    logs = []
    reader = make_node("reader", enable_rosout=False)
    qos = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    reader.create_subscription(Log, "/rosout", logs.append, qos)
    node.get_logger().warning("something is off")
    assert spin(lambda: any(log.msg == "something is off" for log in logs), reader)
    log = next(log for log in logs if log.msg == "something is off")
    assert log.name == "tester"
    assert log.level == 30
    assert log.function == "test_logs_are_published"
    assert log.stamp.sec > 0


def test_only_text_is_logged():
    logger = get_logger("a_test.text")
    with pytest.raises(TypeError):
        logger.info(5)
    assert not logger.debug(5)  # below the level, nothing is looked at


def test_a_line_is_bound_to_its_arguments_by_messages_above_the_level():
    logger = get_logger("a_test.bound")
    for severity in (LoggingSeverity.DEBUG, LoggingSeverity.INFO):
        passed = logger.log("message", severity)
    assert passed
    for severity in (LoggingSeverity.ERROR, LoggingSeverity.DEBUG):
        passed = logger.log("message", severity)
    assert not passed
