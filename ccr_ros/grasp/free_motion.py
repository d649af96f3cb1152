# SPDX-License-Identifier: Apache-2.0
"""How a finger moves on its pull path while it touches nothing: the measure of what touch adds."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ccr_ros.model import FingerSolver, InvalidValue, MountedFinger, NotConverged, Solution

from .pull_path import PullPath

_SAMPLES = 13  # linear interpolation between them is off by less than 0.2 % of the tension


@dataclass(frozen=True, eq=False)
class FreeMotion:
    """Tensions and gap of the free finger at places on its pull path.

    Attributes:
        places: Places (k,) [m], from 0 to the path's length.
        tensions: Tensions (k, m) [N].
        gaps: Gap (k,) [m]: twice the distance of the tip disk's inmost point from the gripper's
            axis, counted along the way from the finger's base to the axis.
    """

    places: np.ndarray
    tensions: np.ndarray
    gaps: np.ndarray

    def tensions_at(self, place: float) -> np.ndarray:
        """Return the tensions (m,) [N] at a place [m]; beyond the ends those at the ends."""
        return np.array([np.interp(place, self.places, column) for column in self.tensions.T])

    def gap_at(self, place: float) -> float:
        """Return the gap [m] at a place [m]."""
        return float(np.interp(place, self.places, self.gaps))

    def place_of_gap(self, gap: float) -> float:
        """Return the first place [m] at which the gap is no more than this; else the last."""
        narrowing = np.minimum.accumulate(self.gaps)
        return float(np.interp(-gap, -narrowing, self.places))


def free_motion(mounted: MountedFinger, path: PullPath) -> FreeMotion:
    """Solve the finger without obstacles along its pull path.

    Raises:
        InvalidValue: The finger's Young's modulus is not known, so that there are no forces in
            newtons to hold with; or its base stands on the gripper's axis.
        NotConverged: There is no pose at some of the pulls.
    """
    finger = replace(mounted.finger, obstacles=())
    if finger.forces_are != "newton":
        raise InvalidValue(
            f"{finger.name}.youngs_modulus",
            None,
            "given in the finger's file: a grasp is told its force in newtons",
        )
    outward = np.asarray(mounted.base.position)[:2]
    distance = float(np.hypot(*outward))
    if distance < 1e-6:
        raise InvalidValue(f"{finger.name}.base.position", outward, "beside the gripper's axis")
    outward = outward / distance
    solver = FingerSolver(finger)
    places = np.linspace(0.0, path.length, _SAMPLES)
    tensions, gaps = [], []
    for place in places:
        solution = solver.solve(path.pulls(place))
        if not solution.certificate.converged:
            raise NotConverged(finger.name, solution.certificate.message)
        tensions.append(solution.tensions)
        gaps.append(2.0 * (mounted.base.points(_tip_points(solution))[:, :2] @ outward).min())
    return FreeMotion(places, np.array(tensions), np.array(gaps))


def _tip_points(solution: Solution) -> np.ndarray:
    """Return the tip disk's centre, holes and the points opposite them, (k, 3)."""
    last = len(solution.backbone) - 1
    points = [solution.backbone[-1]]
    for name, cable in solution.cables.items():
        if len(cable) == last + 1:  # it does not end before the tip
            points += [cable[-1], solution.antagonists[name][-1]]
    return np.array(points)
