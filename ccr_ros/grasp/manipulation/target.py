# SPDX-License-Identifier: Apache-2.0
"""What a plan is to reach, and what it has to keep."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ccr_ros.grasp.statics import GraspSolver
from ccr_ros.model import checks
from ccr_ros.model.errors import InvalidValue, UnknownName

from .step import StepLimits


@dataclass(frozen=True)
class MoveTarget:
    """Where a held object is to go, from where it is.

    Attributes:
        shift: (3,) [m] of its centre, in the gripper's frame.
        turn: (3,) [rad] rotation vector about its centre, in the gripper's frame.
        shift_tolerance: [m]; turn_tolerance: [rad].

    Raises:
        InvalidValue: Nothing is asked for, or a value is out of range.
    """

    shift: np.ndarray = field(default_factory=lambda: np.zeros(3))
    turn: np.ndarray = field(default_factory=lambda: np.zeros(3))
    shift_tolerance: float = 1e-4
    turn_tolerance: float = np.deg2rad(0.2)

    def __post_init__(self) -> None:
        shift = checks.vector("shift", self.shift, 3, unit="m", largest=1.0)
        turn = checks.vector("turn", self.turn, 3, unit="rad", largest=np.pi)
        if float(np.linalg.norm(turn)) > np.pi:
            raise InvalidValue("turn", turn.tolist(), "a rotation vector of at most pi [rad]")
        object.__setattr__(self, "shift", shift)
        object.__setattr__(self, "turn", turn)
        checks.real("shift_tolerance", self.shift_tolerance, above=0, high=0.1, unit="m")
        checks.real("turn_tolerance", self.turn_tolerance, above=0, high=1.0, unit="rad")
        if not (np.any(shift) or np.any(turn)):
            raise InvalidValue("target", [0.0] * 6, "a shift or a turn that is not zero")


@dataclass(frozen=True, eq=False)
class MoveLimits:
    """What a plan keeps.

    Attributes:
        margin: Least friction margin of each contact, in [0, 1).
        least_force: Of each contact [N]; largest_force: [N].
        least_tension: Of each cable [N].
        pulls: Lowest and highest pull (m, 2) [m] by finger, one row per cable; absent: from zero
            to a fifth of the finger's length.
        step: Largest change of a pull from one waypoint to the next [m].
        drift: Largest motion that was not asked for [m], a turn counted at 20 mm from the centre.
        stiffness: What the eigenvalue of the grasp (`GraspSolution.smallest_eigenvalue`) exceeds.
        waypoints: Largest number.
    """

    margin: float = 0.1
    least_force: float = 0.005
    largest_force: float = 5.0
    least_tension: float = 0.0
    pulls: dict[str, np.ndarray] = field(default_factory=dict)
    step: float = 5e-5
    drift: float = 0.006
    stiffness: float = 1e-3
    waypoints: int = 400

    def __post_init__(self) -> None:
        checks.real("margin", self.margin, low=0, below=1)
        checks.real("least_force", self.least_force, low=0, unit="N")
        checks.real("largest_force", self.largest_force, above=self.least_force, unit="N")
        checks.real("least_tension", self.least_tension, low=0, unit="N")
        checks.real("step", self.step, above=0, high=0.01, unit="m")
        checks.real("drift", self.drift, above=0, unit="m")
        checks.real("stiffness", self.stiffness, low=0, high=1)
        checks.integer("waypoints", self.waypoints, low=1, high=100000)

    def for_solver(self, solver: GraspSolver) -> StepLimits:
        """Return these limits in the order of a solver's cables.

        Raises:
            UnknownName, InvalidValue: Pull limits of no finger, or not of its cables.
        """
        for name in self.pulls:
            if name not in solver.names:
                raise UnknownName("finger", name, solver.names)
        low, high = [], []
        for mounted in solver.hand.mounted:
            finger, count = mounted.finger, len(mounted.finger.cables)
            default = np.tile([0.0, 0.2 * finger.length], (count, 1))
            given = np.asarray(self.pulls.get(finger.name, default), dtype=float)
            place = f"limits.pulls.{finger.name}"
            if given.shape != (count, 2) or not np.isfinite(given).all():
                raise InvalidValue(place, given.tolist(), f"{count} pairs of finite pulls [m]")
            if (given[:, 0] > given[:, 1]).any():
                raise InvalidValue(place, given.tolist(), "pairs, the lower pull first")
            low.append(given[:, 0])
            high.append(given[:, 1])
        return StepLimits(
            self.margin, self.least_force, self.largest_force, self.least_tension,
            np.concatenate(low), np.concatenate(high), self.step,
        )  # fmt: skip
