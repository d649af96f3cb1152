# SPDX-License-Identifier: Apache-2.0
"""Fingers, servos and a solver in a few lines, for the coordinator without ROS.

A finger touches at a place and is a spring from there on; a servo follows with a lag; the solver
answers one step later. Figures are those of the sphere gripper. While the object is moved it goes
along with the fingers: x is as far as finger_1 has gone.
"""

from __future__ import annotations

import math

import numpy as np

from ccr_ros.grasp.coordinator import GripperCoordinator
from ccr_ros.grasp.finger_control import FingerControl, SolvedFinger
from ccr_ros.grasp.free_motion import FreeMotion
from ccr_ros.grasp.machine import State
from ccr_ros.grasp.motion import HeldObject
from ccr_ros.grasp.move_path import MovePath
from ccr_ros.grasp.moves import move_goal
from ccr_ros.grasp.pull_path import PullPath
from ccr_ros.grasp.runs import grasp_goal, release_goal
from ccr_ros.grasp.settings import GraspSettings
from ccr_ros.model import Pose

STEP = 0.02  # s
LENGTH = 0.0062  # m
TOUCH = 0.0054  # m
STIFFNESS = 720.0  # N/m, of the contact
FREE = 900.0  # N/m, tension of the free finger
SHARE = 8.0  # tension per contact force
NAMES = ("finger_1", "finger_2", "finger_3")


def free_motion(length: float = LENGTH) -> FreeMotion:
    places = np.array([0.0, length])
    return FreeMotion(places, FREE * places[:, None], np.array([0.15, 0.04]))


class Plant:
    """A gripper that is simulated, with its coordinator; ``run`` lets time pass."""

    def __init__(
        self, settings: GraspSettings | None = None, lag: float = 0.06, step: float = STEP, **places
    ) -> None:
        path = PullPath(np.array([0.0]), np.array([LENGTH]))
        self.settings = settings or GraspSettings()
        self.control = {n: FingerControl(n, ("main",), path, free_motion()) for n in NAMES}
        self.gripper = GripperCoordinator(tuple(self.control.values()), self.settings)
        self.touch = dict.fromkeys(NAMES, TOUCH)
        self.thing = "ball"
        self.at = {name: places.get(name, 0.0) for name in NAMES}
        self.wanted = dict(self.at)
        self.solved: dict[str, SolvedFinger] = {}
        self.lag = lag
        self.seconds = step
        self.steps = 0
        self.solve_every = 1  # steps
        self.now = 100.0
        self.bridge_silent = self.solver_silent = False
        self.stale: set[str] = set()
        self.unstable: set[str] = set()
        self.stuck: set[str] = set()
        self.limp: set[str] = set()  # touch that no tension tells of
        self.history: list[dict[str, float]] = []  # commanded places
        self.margin, self.held, self.lost_pose = 0.5, True, False  # what is told of the object
        self.told = True
        self.x = 0.0  # m
        self.planner = self.plan  # None: no answer comes

    def plan(self, run) -> MovePath | Exception:
        """Plan that finger_1 goes by the shift in x, and the others half of it back."""
        shift = float(run.goal.target.shift[0])
        ways = (shift, -0.5 * shift, -0.5 * shift)
        shares = np.linspace(0.0, 1.0, 5)
        return MovePath(
            {n: (self.at[n] + shares * way)[:, None] for n, way in zip(NAMES, ways, strict=True)}
        )

    def thing_now(self) -> HeldObject:
        pose = Pose(np.array([self.x, 0.0, 0.11]))
        return HeldObject(self.thing, pose, self.held, self.margin, self.lost_pose)

    def force(self, name: str) -> float:
        return max(0.0, STIFFNESS * (self.at[name] - self.touch[name]))

    def forces(self) -> list[float]:
        return [self.force(name) for name in NAMES]

    def advance(self) -> None:
        self.now += self.seconds
        self.steps += 1
        for name, finger in self.control.items():
            solves = self.steps % self.solve_every == 0 and not self.solver_silent
            if name in self.solved and solves:
                self.control[name].hear_solved(self.solved[name], self.now)
            if self.gripper.commanding and not self.bridge_silent:
                self.wanted[name] = finger.path.place(finger.command)
            if name not in self.stuck and not self.bridge_silent:
                way = self.wanted[name] - self.at[name]
                way *= -math.expm1(-self.seconds / self.lag)
                self.at[name] += way
                if self.gripper.state is State.MOVING:
                    self.touch[name] += way
                    self.x += way if name == NAMES[0] else 0.0
            if not self.bridge_silent:
                finger.hear_pulls(np.array([self.at[name]]), self.now)
            if self.steps % self.solve_every:
                continue
            force = self.force(name)
            tension = FREE * self.at[name] + SHARE * force * (name not in self.limp)
            self.solved[name] = SolvedFinger(
                np.array([self.at[name]]),
                np.array([tension]),
                ((self.thing, force),) if force else (),
                stale=name in self.stale,
                stable=name not in self.unstable,
            )
        if self.told and not self.solver_silent:
            self.gripper.thing.hear(self.thing_now(), self.now)
        self.gripper.step(self.now)
        if self.planner is not None and (run := self.gripper.plan_wanted) is not None:
            self.gripper.take_plan(run, self.planner(run))
        self.history.append({name: finger.place for name, finger in self.control.items()})

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / self.seconds)):
            self.advance()

    def until(self, condition, seconds: float = 60.0) -> None:
        end = self.now + seconds
        while not condition():
            assert self.now < end, f"{self.gripper.state}: {self.gripper.message}"
            self.advance()

    def grasp(self, **values):
        goal = grasp_goal(self.settings, NAMES, **values)
        return self.gripper.grasp(goal, self.now)

    def release(self, **values):
        return self.gripper.release(release_goal(**values), self.now)

    def move(self, x: float = 2e-4, **values):
        goal = move_goal(self.settings, shift=(x, 0.0, 0.0), **values)
        return self.gripper.move(goal, self.now)

    def finish(self, run, seconds: float = 60.0):
        self.until(lambda: run.outcome is not None, seconds)
        return run.outcome

    def holding(self, force: float = 0.2) -> Plant:
        """Bring the gripper to hold."""
        self.run(0.2)
        assert self.finish(self.grasp(force=force)).reached
        return self
