# SPDX-License-Identifier: Apache-2.0
"""How near the disks of a gripper's fingers come to each other.

The equilibrium knows contacts with obstacles and with the object; of finger with finger, and of a
finger that is rolled up with itself, only where it is told to (`statics.DiskShape`). This tells
afterwards whether there would be any. Disks are flat, round and filled, without thickness.

The distance of two disks is that of two convex sets A and B: accelerated projections (FISTA) give
points a and b, and with them an upper bound |a - b|; for any unit vector u,

    u.(c_B - c_A) - r_A |u across A's axis| - r_B |u across B's axis|

is a lower bound, so that the answer is known to be right.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ccr_ros.model import checks
from ccr_ros.model.errors import InvalidValue
from ccr_ros.model.rotation import Pose
from ccr_ros.model.solution import Solution

TOLERANCE = 1e-6  # m
_MOST_STEPS = 2000  # some 200 in the worst of 6000 random pairs


@dataclass(frozen=True, eq=False)
class DiskClearance:
    """The two disks of a gripper that are nearest to each other.

    Attributes:
        gap: [m], to within `TOLERANCE`; 0 where they touch or cut each other.
        fingers: Names of the fingers they belong to; the same twice for a finger and itself.
        disks: Their numbers, 0 at the base.
        points: (2, 3) their nearest points, in the gripper's frame [m].
    """

    gap: float
    fingers: tuple[str, str]
    disks: tuple[int, int]
    points: np.ndarray

    @property
    def touching(self) -> bool:
        """Whether the disks touch or cut each other."""
        return self.gap == 0.0

    def in_words(self) -> str:
        """Say it for people, in one line."""
        (one, other), (i, j) = self.fingers, self.disks
        apart = "meet" if self.touching else f"are {self.gap * 1e3:.3g} mm apart"
        if one == other:
            return f"disks {i} and {j} of {one} {apart}"
        return f"disk {i} of {one} and disk {j} of {other} {apart}"


@dataclass(frozen=True, eq=False)
class _Disks:
    """Centres (k, 3), unit axes (k, 3) and radii (k,) of disks in the gripper's frame."""

    centers: np.ndarray
    axes: np.ndarray
    radii: np.ndarray

    def __getitem__(self, which: np.ndarray) -> _Disks:
        return _Disks(self.centers[which], self.axes[which], self.radii[which])

    def nearest(self, points: np.ndarray) -> np.ndarray:
        """Return each disk's point that is nearest to a point (k, 3)."""
        across = self.across(points - self.centers)
        far = np.linalg.norm(across, axis=1)
        share = np.minimum(1.0, self.radii / np.maximum(far, 1e-300))
        return self.centers + share[:, None] * across

    def across(self, vectors: np.ndarray) -> np.ndarray:
        """Return what of vectors (k, 3) lies in each disk's plane."""
        along = np.einsum("ij,ij->i", vectors, self.axes)
        return vectors - along[:, None] * self.axes


def disk_clearance(
    solutions: Sequence[Solution], bases: Sequence[Pose], rim: float = 0.0
) -> DiskClearance:
    """Return the smallest gap between disks of different fingers, or far ones of one finger.

    Neighbouring disks of a finger are left out: where they meet, the solver says so.

    Args:
        solutions: Poses of the fingers, each in its base frame.
        bases: Of the fingers in the gripper's frame, one per solution.
        rim: How far disks reach beyond their holes, which are at `Finger.disk_radius` [m].

    Raises:
        InvalidValue: No finger, a count of bases that does not fit, or a rim that is negative.
    """
    if not solutions or len(bases) != len(solutions):
        raise InvalidValue("bases", f"{len(bases)} bases", "one per finger, of at least one")
    rim = checks.real("rim", rim, low=0, high=1.0, unit="m")
    counts = [len(s.backbone) for s in solutions]
    finger = np.repeat(np.arange(len(counts)), counts)
    number = np.concatenate([np.arange(count) for count in counts])
    disks = _Disks(
        np.concatenate([b.points(s.backbone) for s, b in zip(solutions, bases, strict=True)]),
        np.concatenate(
            [b.vectors(s.frames[:, :, 2]) for s, b in zip(solutions, bases, strict=True)]
        ),
        np.repeat([s.finger.disk_radius + rim for s in solutions], counts),
    )
    first, second = np.triu_indices(len(finger), 1)
    counted = (finger[first] != finger[second]) | (number[second] - number[first] > 1)
    first, second = first[counted], second[counted]
    one, other, points = _nearest_pair(disks, first, second)
    gap = float(np.linalg.norm(points[1] - points[0]))
    names = [s.finger.name for s in solutions]
    return DiskClearance(
        gap=gap if gap > TOLERANCE else 0.0,
        fingers=(names[finger[one]], names[finger[other]]),
        disks=(int(number[one]), int(number[other])),
        points=points,
    )


def _nearest_pair(
    disks: _Disks, first: np.ndarray, second: np.ndarray
) -> tuple[int, int, np.ndarray]:
    """Return the two disks, of the pairs given, that are nearest, and their points (2, 3)."""
    middle = 0.5 * (disks.centers[first] + disks.centers[second])
    a, b = disks[first].nearest(middle), disks[second].nearest(middle)
    momentum_a, momentum_b, pace = a, b, 1.0
    for _ in range(_MOST_STEPS):
        one, other = disks[first], disks[second]
        gap = np.linalg.norm(b - a, axis=1)
        best = int(gap.argmin())
        # Only who may still be nearest goes on.
        alive = _at_least(one, other, a, b) < gap[best] - TOLERANCE
        if not alive.any() or gap[best] <= TOLERANCE:
            break
        alive[best] = True
        first, second, one, other = first[alive], second[alive], one[alive], other[alive]
        middle = 0.5 * (momentum_a[alive] + momentum_b[alive])
        new_a, new_b = one.nearest(middle), other.nearest(middle)
        next_pace = 0.5 * (1 + np.sqrt(1 + 4 * pace**2))
        push = (pace - 1) / next_pace
        momentum_a = new_a + push * (new_a - a[alive])
        momentum_b = new_b + push * (new_b - b[alive])
        a, b, pace = new_a, new_b, next_pace
    best = int(np.linalg.norm(b - a, axis=1).argmin())
    return int(first[best]), int(second[best]), np.stack([a[best], b[best]])


def _at_least(one: _Disks, other: _Disks, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return a lower bound (k,) of the distances, from points of the disks."""
    way = b - a
    way = way / np.maximum(np.linalg.norm(way, axis=1), 1e-300)[:, None]
    reach = one.radii * np.linalg.norm(one.across(way), axis=1)
    reach += other.radii * np.linalg.norm(other.across(way), axis=1)
    return np.einsum("ij,ij->i", way, other.centers - one.centers) - reach
