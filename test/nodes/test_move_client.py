# SPDX-License-Identifier: Apache-2.0
"""The coordinator asks the solver for plans, whatever becomes of earlier ones."""

from types import SimpleNamespace

import numpy as np
import pytest
from ccr_msgs.srv import PlanMove
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.task import Future

from ccr_ros.grasp.moves import MoveRun, move_goal
from ccr_ros.grasp.settings import GraspSettings
from ccr_ros.model import CcrError
from ccr_ros.nodes.move_client import MoveClient

BUSY = "refused: another plan is being made"


class Bench:
    """A move client, a gripper that wants plans, and a solver that answers when it is told to."""

    def __init__(self, context, probe):
        self.probe = probe
        self.asked, self.taken = [], []
        self.server = probe.add(Node("solver_node", namespace="gripper", context=context))
        self.service = self.serve()
        finger = SimpleNamespace(cables=("main",), pull_range=np.array([[0.0, 0.01]]))
        self.gripper = SimpleNamespace(
            plan_wanted=None,
            fingers={"thumb": finger},
            take_plan=lambda run, answer: self.taken.append((run, answer)),
        )
        self.node = probe.add(Node("coordinator", namespace="gripper", context=context))
        self.client = MoveClient(self.node, self.gripper)
        self.steps = 0
        self.node.create_timer(0.01, self._step)

    def _step(self):
        self.client.step()
        self.steps += 1

    def serve(self):
        async def plan(request, response):
            self.asked.append((request.turn.z, Future()))
            response.message = await self.asked[-1][1]
            return response

        group = ReentrantCallbackGroup()
        return self.server.create_service(PlanMove, "~/plan_move", plan, callback_group=group)

    def want(self, turn):
        """Have the gripper want a plan; return once the solver was asked for it."""
        before = len(self.asked)
        run = MoveRun(move_goal(GraspSettings(), turn=(0.0, 0.0, turn)), started=0.0)
        self.gripper.plan_wanted = run
        self.probe.until(lambda: len(self.asked) > before, "a request")
        assert self.asked[-1][0] == pytest.approx(turn)
        return run

    def answers(self, message):
        """Have the solver answer its newest request; return what the gripper gets."""
        self.asked[-1][1].set_result(message)
        self.probe.until(lambda: self.taken, "an answer")
        return self.taken.pop()


@pytest.fixture
def bench(context, probe):
    return Bench(context, probe)


def test_a_refusal_is_the_answer(bench):
    run = bench.want(0.1)
    got, error = bench.answers("refused: out of reach")
    assert got is run and isinstance(error, CcrError) and "out of reach" in str(error)


def test_what_is_wanted_no_more_is_not_waited_for(bench):
    bench.want(0.1)  # the solver is killed now, say, and started anew: this is never answered
    run = bench.want(0.2)
    assert bench.answers("refused: out of reach")[0] is run


def test_a_solver_that_plans_something_else_is_asked_again(bench):
    run = bench.want(0.1)
    bench.asked[-1][1].set_result(BUSY)
    bench.probe.until(lambda: len(bench.asked) == 2, "a second request")
    assert not bench.taken
    assert bench.answers("refused: out of reach")[0] is run


def test_a_solver_that_was_away_is_asked_again(bench):
    run = bench.want(0.1)
    bench.server.destroy_service(bench.service)
    bench.probe.until(lambda: not bench.client._client.service_is_ready(), "it away")
    seen = bench.steps
    bench.probe.until(lambda: bench.steps > seen, "a look")
    bench.service = bench.serve()
    bench.probe.until(lambda: len(bench.asked) == 2, "a second request")
    assert bench.answers("refused: out of reach")[0] is run
