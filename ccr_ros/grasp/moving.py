# SPDX-License-Identifier: Apache-2.0
"""How a held object is moved: a plan is asked for, and its pulls are sent, one after the other."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ccr_ros.model.errors import CcrError

from .closing import Verdict
from .finger_control import FingerControl
from .grip import Grip
from .machine import Event
from .motion import ObjectWatch
from .move_path import MovePath
from .moves import MoveRun
from .progress import Progress
from .runs import End, Outcome
from .settings import GraspSettings

_STILL = 10  # of the tolerance; an object may turn by many degrees for a millimetre of pull

PLAN = "plan"
GO = "go"


class Moving:
    """Moves the object that the fingers carry, one step of time after the other.

    In phase ``plan`` the fingers stand. Once they are where they were sent, and the solver's pose
    is of there, `wants_plan` is true; `take` takes the answer. In phase ``go`` their commands
    follow the plan, no farther ahead of the newest pose than ``move_lead``, and stand while that is
    stale. However slow servos and solver are, the poses so follow the plan in steps as small as
    its own: with friction the way counts. However it ends the fingers stay where they are.

    Args:
        fingers: All fingers.
        grip: What they hold; its floors go along with the commands.
        thing: The object, as the solver knows it.
        run: What is asked for.
        settings: Speeds, margins and times.
        now: When it begins [s].
    """

    def __init__(
        self,
        fingers: Mapping[str, FingerControl],
        grip: Grip,
        thing: ObjectWatch,
        run: MoveRun,
        settings: GraspSettings,
        now: float,
    ) -> None:
        self._fingers = fingers
        self._grip = grip
        self._thing = thing
        self.run = run
        self._settings = settings
        self._began = now
        self._start = thing.newest.pose if thing.newest is not None else None
        self._path: MovePath | None = None
        self._refused = ""
        self._offset: dict[str, np.ndarray] = {}  # of the commands, from the plan [m]
        self._way = 0.0
        self._followed_at = now
        self._stood: np.ndarray | None = None  # measured pulls of all fingers [m], a while ago
        self._stood_at = now
        self._progress = Progress(settings)
        self.wants_plan = False

    @property
    def phase(self) -> str:
        """``plan`` or ``go``."""
        return GO if self._offset else PLAN

    @property
    def fraction(self) -> float:
        """Of the planned pulls that were commanded."""
        if self._path is None or not self._offset:
            return 0.0
        return self._way / self._path.length if self._path.length > 0.0 else 1.0

    def take(self, answer: MovePath | CcrError) -> None:
        """Take the plan that was wanted, or why there is none."""
        self.wants_plan = False
        if isinstance(answer, MovePath):
            self._path = answer
        else:
            self._refused = str(answer)

    def step(self, now: float, seconds: float) -> Verdict | None:
        """Move all fingers by a step; return how it ended, once it has."""
        if self._start is not None:
            self.run.motion = self._thing.motion(self._start, self.fraction)
        if trouble := self._thing.trouble(now, self._settings):
            return Verdict(Event.FAIL, Outcome(End.FAILED, trouble, limiting=trouble))
        if lost := self._grip.lost(now):
            text = f"{lost} lost the object"
            return Verdict(Event.FAIL, Outcome(End.FAILED, text, limiting=text))
        if self.phase == PLAN:
            return self._plan(now)
        return self._go(now, seconds)

    # The plan

    def _plan(self, now: float) -> Verdict | None:
        settings = self._settings
        if self._refused:
            return _ended(f"no plan: {self._refused}", self._refused)
        if self._path is not None:
            return self._begin(self._path, now)
        if stuck := self._progress.stalled(list(self._fingers.values()), now):
            return _ended(f"the servo of {stuck} does not follow")
        if now - self._began > settings.plan_timeout:
            return _ended(f"no plan within {settings.plan_timeout:g} s")
        if not self.wants_plan and self._settled(now) and self._thing.newest is not None:
            self._start = self._thing.newest.pose
            self.wants_plan = True
        return None

    def _begin(self, path: MovePath, now: float) -> Verdict | None:
        goal, tolerance = self.run.goal, self._settings.place_tolerance
        try:
            path.check_within({n: f.pull_range for n, f in self._fingers.items()})
        except CcrError as error:
            return _ended(f"the plan is not followed: {error}", f"pull limits: {error}")
        if not path.reached and not (goal.partial and path.length > 0.0):
            text = f"it cannot be moved so: {path.limiting} ({100 * path.share:.0f} % of the way)"
            return _ended(text, path.limiting)
        offset = {
            name: finger.command - path.pulls[name][0] for name, finger in self._fingers.items()
        }
        if max(float(np.abs(off).max()) for off in offset.values()) > 2.0 * tolerance:
            return _ended("the fingers moved while the plan was made")
        self._offset = offset
        self._followed_at = now
        self._progress = Progress(self._settings)
        return None

    # The motion

    def _go(self, now: float, seconds: float) -> Verdict | None:
        assert self._path is not None
        settings, goal, path = self._settings, self.run.goal, self._path
        thing = self._thing.fresh
        if thing is not None and thing.margin < settings.move_stop_margin:
            text = f"friction margin: {thing.margin:.3f} is below {settings.move_stop_margin:g}"
            return _ended(f"stopped, {text}", text)
        if stuck := self._progress.stalled(list(self._fingers.values()), now):
            text = f"the servo of {stuck} does not follow"
            return _ended(f"stopped: {text}", text)
        if self._way < path.length and thing is not None and self._followed(path):
            self._followed_at = now
            speed = path.length / goal.duration if goal.duration > 0.0 else goal.speed
            self._way = min(self._way + speed * seconds, path.length)
            self._command(path.at(self._way))
        if self._way < path.length and now - self._followed_at > settings.stall_time:
            behind = max(self._fingers, key=lambda name: self._behind(path, name))
            text = f"{behind} does not follow within {settings.move_lead * 1e3:g} mm"
            return _ended(f"stopped: {text}", text)
        if self._way >= path.length and self._settled(now) and thing is not None:
            return self._at_the_end(path)
        return None

    def _command(self, pulls: Mapping[str, np.ndarray]) -> None:
        self._stood = None
        for name, finger in self._fingers.items():
            before = finger.place
            finger.send(pulls[name] + self._offset[name])
            if name in self._grip.floors:
                # Where it touches goes with the object; the plan keeps it touching.
                self._grip.floors[name] += finger.place - before

    def _settled(self, now: float) -> bool:
        """Tell whether all fingers have come to rest where they were sent, and the pose with them.

        At rest is what has not moved by a tenth of the tolerance in ``settle_time``.
        """
        tolerance, measured = self._settings.place_tolerance, []
        there = self._thing.fresh is not None
        for finger in self._fingers.values():
            if finger.measured is None or finger.solved is None:
                return False
            measured.append(finger.measured)
            there = there and _far(finger.command, finger.measured) <= tolerance
            there = there and _far(finger.solved.pulls, finger.measured) <= tolerance / _STILL
        at = np.concatenate(measured)
        if self._stood is None or _far(at, self._stood) > tolerance / _STILL:
            self._stood, there = at, False
        if not there:
            self._stood_at = now
        # And what is told of the object must be of the end of that time.
        return self._thing.heard_at - self._stood_at >= self._settings.settle_time

    def _followed(self, path: MovePath) -> bool:
        """Tell whether the poses are near enough to where the plan is to go on."""
        return all(self._behind(path, name) <= self._settings.move_lead for name in self._fingers)

    def _behind(self, path: MovePath, name: str) -> float:
        """How far a finger's newest pose is from where the plan is [m]; infinity: not known."""
        solved = self._fingers[name].solved
        if solved is None or solved.stale:
            return math.inf
        return _far(path.at(self._way)[name], solved.pulls)

    def _at_the_end(self, path: MovePath) -> Verdict:
        assert self._start is not None
        motion = self._thing.motion(self._start, 1.0)
        assert motion is not None
        self.run.motion = motion
        target = self.run.goal.target
        if not path.reached:
            text = f"as far as is possible, {100 * path.share:.0f} % of the way: {path.limiting}"
            return Verdict(Event.MOVED, Outcome(End.DONE, text, limiting=path.limiting))
        off = float(np.linalg.norm(motion.shift - target.shift)) if np.any(target.shift) else 0.0
        angle = float(np.linalg.norm(target.turn))
        turned = abs((motion.turn - target.turn) @ target.turn) / angle if angle > 0.0 else 0.0
        if off <= target.shift_tolerance and turned <= target.turn_tolerance:
            return Verdict(Event.MOVED, Outcome(End.DONE, "moved", reached=True))
        text = f"moved, but off by {off * 1e3:.2f} mm and {math.degrees(turned):.2f} deg"
        return Verdict(Event.MOVED, Outcome(End.FAILED, text))


def _ended(text: str, limiting: str = "") -> Verdict:
    return Verdict(Event.MOVED, Outcome(End.FAILED, text, stalled=True, limiting=limiting or text))


def _far(one: np.ndarray, two: np.ndarray) -> float:
    return float(np.abs(one - two).max())
