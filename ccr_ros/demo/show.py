# SPDX-License-Identifier: Apache-2.0
"""The sphere's story, told to the nodes step by step: grasp, hold, more weight, let go."""

from __future__ import annotations

from ccr_msgs.action import Grasp, Release
from ccr_msgs.msg import GripperState
from rclpy.node import Node

from ccr_ros.stack.parts import StackFailed

from .ball import MASS, SUPPORTED
from .scene import BALL, GRIP_FORCE, HEAVY, LIGHT
from .story import Steps, Story

_GRASP_TIMEOUT = 40.0  # s
_RELEASE_DELAY = 3.0  # s; the paper's gripper lets go at a set time
_RELEASE_TIMEOUT = 30.0  # s, from when it begins
_SETTLE = 1.0  # s, of looking at what has been reached


class Show(Story):
    """Plays the story of the sphere.

    Args:
        node: Talks to the others; somebody else spins it.
        hold: How long the ball is held [s].
    """

    def __init__(self, node: Node, hold: float) -> None:
        super().__init__(node, hold, "demo_ball")

    def _story(self) -> Steps:
        self.phase = "closing"
        grasped = yield from self._act(
            self._grasp, Grasp.Goal(object=BALL.name, force=GRIP_FORCE), _GRASP_TIMEOUT, "grasp"
        )
        if not grasped.reached:
            raise StackFailed(f"the ball was not grasped: {grasped.message}")
        yield from self._nap(_SETTLE)
        yield from self._set_world(SUPPORTED, False)
        self.phase = f"holding {LIGHT * 1e3:g} g"
        yield from self._nap(self._hold / 2)
        yield from self._set_world(MASS, HEAVY)
        self.phase = f"holding {HEAVY * 1e3:g} g"
        yield from self._nap(self._hold / 2)
        yield from self._let_go()
        self.phase = "open"
        yield from self._nap(_SETTLE)

    def _let_go(self) -> Steps:
        """Let go at a set time; the stand is back under the ball by then."""
        self.phase = "holding, timed release"
        opening = self._act(
            self._release,
            Release.Goal(delay=_RELEASE_DELAY),
            _RELEASE_DELAY + _RELEASE_TIMEOUT,
            "release",
        )
        caught = False
        while True:
            try:
                next(opening)
            except StopIteration as end:
                if not end.value.released:
                    raise StackFailed(f"the ball was not released: {end.value.message}") from None
                return
            opens = self.gripper is not None and self.gripper.state == GripperState.RELEASING
            if opens and not caught:
                caught = True
                self.phase = "releasing"
                yield from self._set_world(SUPPORTED, True)
            yield
