# SPDX-License-Identifier: Apache-2.0
"""Whether pulling a finger from rest leads to the wanted shape: the forward model decides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ccr_ros.model import checks
from ccr_ros.model.finger import Finger
from ccr_ros.model.settings import SolverSettings
from ccr_ros.model.solution import Solution
from ccr_ros.model.solver import FingerSolver

from .target import DesiredShape

TOLERANCE = 1e-16  # m^2; the paper's e_d = 1e-10 mm^2
_TIME_LIMIT = 20.0  # s of CPU per step of the pull


@dataclass(frozen=True, eq=False)
class PullPath:
    """A finger pulled from rest in equal steps of all pulls.

    Attributes:
        steps: The poses, after each step; the last one that converged is the last.
        wanted: Number of steps that were to be made.
        squared_error: Sum of the squared distances of the last pose's disk centres from the wanted
            ones [m^2].
        jumps: Fractions of the pulls at which the finger snapped to another branch.
        unstable: Fractions of the pulls at which the pose was no strict minimum of the energy.
        message: What ended the path, if it ended early.
        tolerance: Largest squared error that counts as reached [m^2].
    """

    steps: tuple[Solution, ...]
    wanted: int
    squared_error: float
    jumps: tuple[float, ...]
    unstable: tuple[float, ...]
    message: str
    tolerance: float = TOLERANCE

    @property
    def last(self) -> Solution:
        """The last pose."""
        return self.steps[-1]

    @property
    def completed(self) -> bool:
        """Whether all pulls were reached."""
        return not self.message

    @property
    def reached(self) -> bool:
        """Whether the pulls lead to the wanted shape, within the tolerance."""
        return self.completed and self.squared_error <= self.tolerance

    @property
    def smooth(self) -> bool:
        """Whether they do so without a jump."""
        return self.reached and not self.jumps


def pull_from_rest(
    finger: Finger,
    pulls: np.ndarray,
    shape: DesiredShape,
    steps: int = 10,
    tolerance: float = TOLERANCE,
) -> PullPath:
    """Pull a finger from rest, obstacles and all, with the solver that the nodes use.

    Args:
        finger: With its rest shape.
        pulls: (m,) [m].
        shape: What the last pose is compared with.
        steps: In which the pulls are made; the solver goes in smaller ones where it must.
        tolerance: Largest squared error that counts as reached [m^2]; by default the paper's.

    Raises:
        InvalidValue: A pull that the finger cannot have.
    """
    steps = checks.integer("steps", steps, low=1, high=10_000)
    solver = FingerSolver(finger, SolverSettings(tolerance=1e-12, time_limit=_TIME_LIMIT))
    poses = [solver.solve(np.zeros(len(pulls)))]  # what obstacles make of the rest shape
    jumps: list[float] = []
    unstable: list[float] = []
    message = ""
    for k in range(1, steps + 1):
        pose = solver.solve(pulls * (k / steps))
        poses.append(pose)
        if pose.certificate.branch_jump:
            jumps.append(k / steps)
        if not pose.certificate.converged:
            message = pose.certificate.message
            break
        if not pose.certificate.stable:
            unstable.append(k / steps)
    return PullPath(
        tuple(poses),
        steps,
        shape.squared_error(poses[-1].backbone),
        tuple(jumps),
        tuple(unstable),
        message,
        tolerance,
    )
