# SPDX-License-Identifier: Apache-2.0
import pytest
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn


class Engine(LifecycleNode):
    """Its activation fails."""

    def on_activate(self, state):
        return TransitionCallbackReturn.FAILURE


@pytest.fixture
def engine(make_peer):
    make_peer("plain")
    return make_peer("engine", kind=Engine)


def test_nodes_get_and_set(ccr, engine):
    assert ccr("lifecycle", "nodes").out == "/engine\n"
    assert ccr("lifecycle", "nodes", "-c").out == "1\n"
    assert ccr("lifecycle", "get", "/engine").out == "unconfigured [1]\n"
    assert ccr("lifecycle", "set", "/engine", "configure").out == "Transitioning successful\n"
    assert ccr("lifecycle", "get").out == "/engine: inactive [2]\n"
    failed = ccr("lifecycle", "set", "/engine", "activate")
    assert failed == (1, "", "Transitioning failed\n")
    assert ccr("lifecycle", "set", "/engine", "2").code == 0  # cleanup, by its number
    assert ccr("lifecycle", "get", "engine").out == "unconfigured [1]\n"


def test_list(ccr, engine):
    assert ccr("lifecycle", "list", "/engine").out == (
        "- configure [1]\n\tStart: unconfigured\n\tGoal: configuring\n"
        "- shutdown [5]\n\tStart: unconfigured\n\tGoal: shuttingdown\n"
    )
    every = ccr("lifecycle", "list", "/engine", "-a").out
    assert "- activate [3]\n\tStart: inactive\n\tGoal: activating\n" in every


def test_errors(ccr, engine):
    assert ccr("lifecycle", "get", "/engin").err == (
        "ccr: error: no node '/engin' (did you mean '/engine'?)\n"
    )
    assert ccr("lifecycle", "get", "/plain").err == (
        "ccr: error: no lifecycle node '/plain'; there are: /engine\n"
    )
    assert ccr("lifecycle", "set", "/engine", "activate").err == (
        "ccr: error: node '/engine' has no transition 'activate' in its state; "
        "it has: configure [1], shutdown [5]\n"
    )
