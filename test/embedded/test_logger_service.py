# SPDX-License-Identifier: Apache-2.0
"""Logger levels, read and set by others through a node's services."""

import pytest
from rcl_interfaces.msg import LoggerLevel
from rcl_interfaces.srv import GetLoggerLevels, SetLoggerLevels
from rclpy.logging import LoggingSeverity, get_logger, set_logger_level


@pytest.fixture
def ask(make_node, spin):
    """Call one of a node's two logger services and return the response."""
    node, user = make_node("talker", enable_logger_service=True), make_node("user")

    def call(kind, name, **fields):
        client = user.create_client(kind, f"talker/{name}")
        assert client.wait_for_service(60)
        future = client.call_async(kind.Request(**fields))
        assert spin(future.done, node, user)
        return future.result()

    return call


@pytest.fixture
def levels(ask):
    def run(*names):
        found = ask(GetLoggerLevels, "get_logger_levels", names=list(names)).levels
        return [(level.name, level.level) for level in found]

    return run


@pytest.fixture
def set_levels(ask):
    changed = set()

    def run(**levels):
        changed.update(levels)
        wanted = [LoggerLevel(name=name, level=level) for name, level in levels.items()]
        return ask(SetLoggerLevels, "set_logger_levels", levels=wanted).results

    yield run
    for name in changed:
        set_logger_level(name, LoggingSeverity.UNSET)


def test_levels_are_told(levels):
    set_logger_level("told", LoggingSeverity.ERROR)
    try:
        assert levels("told", "never_set") == [("told", 40), ("never_set", 0)]
    finally:
        set_logger_level("told", LoggingSeverity.UNSET)


def test_levels_are_set(set_levels, levels):
    logger = get_logger("chatty")
    assert not logger.debug("unheard")
    (result,) = set_levels(chatty=10)
    assert (result.successful, result.reason) == (True, "")
    assert logger.debug("heard")
    assert levels("chatty") == [("chatty", 10)]
    (result,) = set_levels(chatty=0)
    assert result.successful
    assert logger.get_effective_level() == get_logger("other").get_effective_level()


def test_levels_that_are_none_are_refused(set_levels, levels):
    results = set_levels(first=20, second=22, third=30)
    assert [result.successful for result in results] == [True, False, True]
    assert results[1].reason == "Failed reason: Invalid logger level."
    assert levels("first", "second", "third") == [("first", 20), ("second", 0), ("third", 30)]


def test_other_nodes_have_no_such_service(make_node):
    node = make_node("silent")
    assert not any("logger_levels" in service.service_name for service in node.services)
