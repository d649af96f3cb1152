# SPDX-License-Identifier: Apache-2.0
"""The goals that the gripper is at work on."""

from __future__ import annotations

from .moves import MoveRun
from .runs import End, GraspGoal, Outcome, ReleaseGoal, Run


class UnderWay:
    """At most one run of each kind; each is ended once, with its outcome."""

    def __init__(self) -> None:
        self.grasp: Run[GraspGoal] | None = None
        self.release: Run[ReleaseGoal] | None = None  # waiting for its time, or begun
        self.move: MoveRun | None = None

    def end_grasp(self, outcome: Outcome) -> None:
        """End the grasp, if there is one."""
        run, self.grasp = self.grasp, None
        if run is not None:
            run.finish(outcome)

    def end_release(self, outcome: Outcome) -> None:
        """End the release, if there is one."""
        run, self.release = self.release, None
        if run is not None:
            run.finish(outcome)

    def end_move(self, outcome: Outcome) -> None:
        """End the motion of the object, if there is one."""
        run, self.move = self.move, None
        if run is not None:
            run.finish(outcome)

    def end_all(self, reason: str, stalled: bool = False) -> None:
        """End all as failed, for a reason."""
        outcome = Outcome(End.FAILED, reason, stalled=stalled, limiting=reason)
        self.end_grasp(outcome)
        self.end_release(outcome)
        self.end_move(outcome)
