# SPDX-License-Identifier: Apache-2.0
import re
import signal
import threading

import pytest
from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from tf2_msgs.action import LookupTransform

TYPE = "tf2_msgs/action/LookupTransform"
SEND = ("action", "send_goal", "/ns/look", TYPE)


@pytest.fixture
def server(peer):
    """An action /ns/look; what it does with a goal is in the goal's source frame."""
    released = threading.Event()

    def decide(goal):
        return GoalResponse.REJECT if goal.source_frame == "bad" else GoalResponse.ACCEPT

    def execute(handle):
        result = LookupTransform.Result()
        result.error.error_string = handle.request.source_frame
        handle.publish_feedback(LookupTransform.Feedback())
        if handle.request.source_frame == "fail":
            handle.abort()
        elif handle.request.source_frame == "wait":
            while not handle.is_cancel_requested and not released.wait(0.02):
                pass
            handle.canceled()
        else:
            handle.succeed()
        return result

    yield ActionServer(
        peer,
        LookupTransform,
        "look",
        execute,
        goal_callback=decide,
        cancel_callback=lambda handle: CancelResponse.ACCEPT,
        callback_group=ReentrantCallbackGroup(),
    )
    released.set()


def test_list_type_and_info(ccr, server, peer):
    client = ActionClient(peer, LookupTransform, "/other")
    assert ccr("action", "list").out == "/ns/look\n/other\n"
    assert ccr("action", "list", "-t").out.splitlines()[0] == f"/ns/look [{TYPE}]"
    assert ccr("action", "list", "-c").out == "2\n"
    assert ccr("action", "type", "/ns/look").out == f"{TYPE}\n"
    assert ccr("action", "info", "/ns/look", "-t").out == (
        f"Action: /ns/look\nAction clients: 0\nAction servers: 1\n    /ns/peer [{TYPE}]\n"
    )
    assert ccr("action", "info", "/other").out == (
        "Action: /other\nAction clients: 1\n    /ns/peer\nAction servers: 0\n"
    )
    assert ccr("action", "info", "/other", "-c").out == (
        "Action: /other\nAction clients: 1\nAction servers: 0\n"
    )
    client.destroy()


def test_node_info_shows_actions_and_hides_their_topics(ccr, server):
    out = ccr("node", "info", "/ns/peer").out
    assert f"  Action Servers:\n    /ns/look: {TYPE}\n  Action Clients:\n\n" in out
    assert "_action" not in out
    assert "/ns/look/_action/feedback" in ccr("node", "info", "/ns/peer", "--include-hidden").out


def test_a_goal_that_succeeds(ccr, server):
    done = ccr(*SEND, "{source_frame: good}")
    assert done.code == 0
    assert re.match(
        "Waiting for an action server to become available...\n"
        "Sending goal:\n     target_frame: ''\nsource_frame: good\n",
        done.out,
    )
    assert re.search(r"\nGoal accepted with ID: [0-9a-f]{32}\n\nResult:\n    transform:", done.out)
    assert "  error_string: good\n" in done.out
    assert done.out.endswith("\nGoal finished with status: SUCCEEDED\n")
    assert "Feedback" not in done.out


def test_feedback_is_printed_when_asked_for(ccr, server):
    out = ccr(*SEND, "{source_frame: good}", "--feedback").out
    assert 0 < out.index("Feedback:\n    ") < out.index("Result:")


def test_goals_that_do_not_succeed_give_exit_code_1(ccr, server):
    rejected = ccr(*SEND, "{source_frame: bad}")
    assert rejected.code == 1 and rejected.out.endswith("\nGoal was rejected.\n")
    aborted = ccr(*SEND, "{source_frame: fail}")
    assert aborted.code == 1 and aborted.out.endswith("\nGoal finished with status: ABORTED\n")


def test_errors(ccr, server):
    assert ccr("action", "type", "/ns/lock").err == (
        "ccr: error: no action '/ns/lock' (did you mean '/ns/look'?)\n"
    )
    assert ccr(*SEND, "{frame: 1}").err.startswith("ccr: error: frame: unknown key")
    assert ccr("action", "send_goal", "/ns/lock", TYPE, "--timeout", "1").err == (
        "ccr: error: no action '/ns/lock' (did you mean '/ns/look'?)\n"
    )
    assert ccr("action", "send_goal", "/ns/look", "tf2_msgs/action/LookTransform").err == (
        "ccr: error: no action type 'LookTransform' in tf2_msgs (did you mean 'LookupTransform'?)\n"
    )


@pytest.mark.processes
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interrupt_cancels_the_goal(start_ccr, server, number, code):
    process = start_ccr(*SEND, "{source_frame: wait}")
    while "Goal accepted" not in process.stdout.readline():
        assert process.poll() is None
    process.send_signal(number)
    out, err = process.communicate(timeout=60)
    assert out.endswith("Canceling goal...\nGoal canceled.\n")
    assert (process.returncode, err) == (code, "")
