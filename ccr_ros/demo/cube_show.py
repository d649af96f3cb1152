# SPDX-License-Identifier: Apache-2.0
"""The cube's story: grasp, take the table away, turn left and right, put down, let go."""

from __future__ import annotations

import math

from ccr_msgs.action import Grasp, Release, Rotate
from ccr_msgs.msg import GraspState
from rclpy.action import ActionClient
from rclpy.node import Node

from ccr_ros.nodes.qos import LATCHED
from ccr_ros.stack.parts import StackFailed

from .cube import HELD, THERE
from .cube_scene import CUBE, GRIP_FORCE, TURN
from .story import Steps, Story

_GRASP_TIMEOUT = 60.0  # s
_TURN_TIMEOUT = 120.0  # s, with its plan
_HELD_TIMEOUT = 20.0  # s until the solver has let the cube go, or stood it up
_RELEASE_TIMEOUT = 30.0  # s
_SETTLE = 1.0  # s, of looking at what has been reached


class CubeShow(Story):
    """Plays the story of the cube.

    Args:
        node: Talks to the others; somebody else spins it.
        hold: How long the cube is held before it is turned, and again after that [s].
    """

    def __init__(self, node: Node, hold: float) -> None:
        super().__init__(node, hold, "demo_cube")
        self._grip: GraspState | None = None
        self._rotate = ActionClient(node, Rotate, "rotate")
        node.create_subscription(GraspState, "grasp_state", self._grip_heard, LATCHED)

    def _story(self) -> Steps:
        yield from self._set_world(THERE, True)
        yield from self._until(lambda: self._stands() is True, _HELD_TIMEOUT, "the cube to stand")
        self.phase = "close"
        goal = Grasp.Goal(object=CUBE.name, force=GRIP_FORCE)
        grasped = yield from self._act(self._grasp, goal, _GRASP_TIMEOUT, "grasp")
        if not grasped.reached:
            raise StackFailed(f"the cube was not grasped: {grasped.message}")
        yield from self._nap(_SETTLE)
        self.phase = "hold"
        yield from self._stand(False)
        yield from self._nap(self._hold / 2)
        yield from self._turn("turn left", TURN)
        yield from self._turn("turn back", -TURN)
        yield from self._turn("turn right", -TURN)
        yield from self._turn("turn back", TURN)
        self.phase = "hold"
        yield from self._nap(self._hold / 2)
        self.phase = "put down"
        yield from self._stand(True)
        yield from self._nap(_SETTLE)
        self.phase = "release"
        opened = yield from self._act(self._release, Release.Goal(), _RELEASE_TIMEOUT, "release")
        if not opened.released:
            raise StackFailed(f"the cube was not released: {opened.message}")
        yield from self._until(self._let_go, _HELD_TIMEOUT, "fingers that touch no more")
        self.phase = "open"
        yield from self._nap(_SETTLE)

    def _turn(self, phase: str, angle: float) -> Steps:
        self.phase = phase
        found = yield from self._act(self._rotate, Rotate.Goal(angle=angle), _TURN_TIMEOUT, phase)
        if not found.reached:
            raise StackFailed(
                f"the cube was not turned by {math.degrees(angle):g} deg: {found.message}"
            )

    def _stand(self, stands: bool) -> Steps:
        """Put the table under the cube, or take it away, and wait until that is so."""
        yield from self._set_world(HELD, not stands)
        what = "the cube to stand" if stands else "the fingers to carry the cube"
        yield from self._until(lambda: self._stands() is stands, _HELD_TIMEOUT, what)

    def _stands(self) -> bool | None:
        grip = self._grip
        if grip is None or grip.object != CUBE.name or grip.stale:
            return None
        return not grip.held

    def _let_go(self) -> bool:
        """Whether the solver, too, has seen the fingers come off."""
        return self._stands() is True and self._grip is not None and not self._grip.contacts

    def _all_there(self) -> bool:
        return super()._all_there() and self._rotate.server_is_ready()

    def _grip_heard(self, message: GraspState) -> None:
        self._grip = message
