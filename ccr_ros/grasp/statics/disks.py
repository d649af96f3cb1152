# SPDX-License-Identifier: Apache-2.0
"""Disks that press on each other: of different fingers, or far ones of one finger.

A pair of disks is one more constraint, -gap <= 0 (`disk_distance`), whose multiplier is the force
between them. Its row has a part in each of two fingers' coordinates and none in the object's. The
Hessian of force x -gap is

    sum over both fingers (force n on the nearest points, fixed on their disks: as any force)
    - force [w_A v_a w_B v_b]' K [w_A v_a w_B v_b],        K of `second_derivatives`

The first is in each finger's own block. The second, which joins two fingers, has a rank of five at
most and is kept as its eigenvectors' rows with their eigenvalues, for Newton's step to put in
beside the blocks. All here is in the gripper's frame and the hand's units.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ccr_ros.model import checks
from ccr_ros.model.errors import InvalidValue
from ccr_ros.model.sqp import ACTIVE, KktPoint

from .assembly import FingerBlock, Hand
from .disk_distance import DOME, Disks, Nearest, between, gaps_at_least, nearest, second_derivatives
from .disk_motion import DiskMotion

_BAND = 0.05  # of the length; disks nearer to each other than this enter the problem
_THIN = 0.01  # of the radius; a rim that is sharper has no normal to speak of
_LOOKS = 32  # at most, at disks on their way


@dataclass(frozen=True)
class DiskShape:
    """What of a disk may touch other disks: round, with a round rim.

    Attributes:
        rim: How far disks reach beyond their holes, which are at `Finger.disk_radius` [m].
        thickness: [m]; the rim is rounded with half of it. Neighbouring disks of a finger do not
            count: where they meet, the solver says so anyway.

    Raises:
        InvalidValue: A value is out of range.
    """

    rim: float = 0.0
    thickness: float = 2e-3

    def __post_init__(self) -> None:
        checks.real("disks.rim", self.rim, low=0, high=1.0, unit="m")
        checks.real("disks.thickness", self.thickness, above=0, high=1.0, unit="m")


@dataclass(frozen=True, eq=False)
class NearDisks:
    """The pairs of disks that are near each other at one pose.

    Attributes:
        disks: Where all are.
        pairs: (k,) which pairs, of `DiskRoom.first` and ``second``.
        near: Their nearest points, gaps and normals.
        forces: (k,) between them.
        rows: Per finger (k, N): gradients of -gap.
        ways: Per finger (m, N), stiffness: (m,): the Hessian that joins fingers is the sum of
            stiffness x ways' ways, over all fingers' coordinates.
        bends: Per finger (N, N), in its own units: what the forces add to its Hessian.
    """

    disks: Disks
    pairs: np.ndarray
    near: Nearest
    forces: np.ndarray
    rows: tuple[np.ndarray, ...]
    ways: tuple[np.ndarray, ...]
    stiffness: np.ndarray
    bends: tuple[np.ndarray | None, ...]

    def __len__(self) -> int:
        return len(self.pairs)

    @property
    def active(self) -> np.ndarray:
        """(k,) pairs that carry force."""
        return self.forces > ACTIVE

    def violation(self) -> float:
        """How deep disks cut each other, or how far those are apart that carry force."""
        over = np.where(self.active, np.abs(self.near.gaps), -self.near.gaps)
        return max(0.0, float(over.max(initial=0.0)))


class DiskRoom:
    """All disks of a hand and the pairs of them that may meet, built once.

    Attributes:
        shape: Of the disks.
        first, second: (P,) the pairs: disks of different fingers but for two that are fixed, and
            those of one finger that are no neighbours.

    Raises:
        InvalidValue: Disks are too thin or too thick for their radius, or cut each other at rest.
    """

    def __init__(self, hand: Hand, shape: DiskShape) -> None:
        self.shape = shape
        edge = 0.5 * shape.thickness
        cores = [m.finger.disk_radius + shape.rim - edge for m in hand.mounted]
        least, most = _THIN * (max(cores) + edge), min(cores) + edge
        if not least <= shape.thickness <= most:
            allowed = f"{_THIN:.0%} to 100% of the disks' radius, {least:.4g} to {most:.4g} m"
            raise InvalidValue("disks.thickness", shape.thickness, allowed)
        self._motion = DiskMotion(hand, cores, edge)
        self._names = [m.finger.name for m in hand.mounted]
        self._edge = edge / hand.length
        number, finger = self._motion.number, self._motion.finger
        first, second = np.triu_indices(len(finger), 1)
        own = finger[first] == finger[second]
        meet = np.where(own, number[second] - number[first] > 1, number[first] + number[second] > 0)
        self.first, self.second = first[meet], second[meet]
        reach = np.array(cores)[finger] / hand.length * (1 + 0.5 * DOME) + self._edge
        self._reach = reach[self.first] + reach[self.second]
        none = tuple(np.zeros((0, problem.size)) for problem in hand.problems)
        nothing, gone = np.zeros(0), np.zeros((0, 3))
        nearest_none = Nearest(
            np.zeros((0, 4)), np.zeros((0, 2, 3)), gone, nothing, nothing, nothing > 0
        )
        disks = self._motion.disks([problem.rest.rod for problem in hand.problems])
        self._check_rest(disks)
        self._apart = NearDisks(
            disks, np.zeros(0, dtype=int), nearest_none, nothing, none, none, nothing,
            (None,) * len(hand.problems),
        )  # fmt: skip

    def near_disks(
        self,
        points: Sequence[KktPoint],
        before: NearDisks | None = None,
        forces: np.ndarray | None = None,
    ) -> NearDisks:
        """Return the pairs that are near each other, with all derivatives.

        Args:
            points: Where the fingers stand.
            before: The same at a pose near by; None: there is none.
            forces: (k,) of the pairs of ``before``; None: its own.
        """
        disks = self._motion.disks([point.at.rod for point in points])
        pairs, start = self._closer(disks, _BAND), None
        if before is not None and len(before):
            forces = before.forces if forces is None else forces
            pairs = np.union1d(pairs, before.pairs[forces > 0])
        if not len(pairs):
            return replace(self._apart, disks=disks)
        pushed = np.zeros(len(pairs))
        if before is not None and len(before) and forces is not None:
            _, new, old = np.intersect1d(pairs, before.pairs, return_indices=True)
            pushed[new] = forces[old]
            start = np.full((len(pairs), 4), np.nan)
            start[new] = before.near.places[old]
        one, other = self.first[pairs], self.second[pairs]
        near = nearest(disks[one], disks[other], start)
        twists = [self._motion.twists(index, point) for index, point in enumerate(points)]
        rows = self._motion.rows(one, other, near, twists)
        ways, stiffness, bends = self._apart.ways, self._apart.stiffness, self._apart.bends
        pressed = np.flatnonzero(pushed > ACTIVE)
        if len(pressed):
            one, other, part, force = one[pressed], other[pressed], near[pressed], pushed[pressed]
            second = second_derivatives(disks[one], disks[other], part) * -force[:, None, None]
            ways, stiffness = self._motion.joining(one, other, part, second, twists)
            bends = tuple(
                self._motion.bend(index, point, one, other, part, force)
                for index, point in enumerate(points)
            )
        return NearDisks(disks, pairs, near, pushed, rows, ways, stiffness, bends)

    def in_words(self, pair: int) -> str:
        """Name a pair's disks for people."""
        return pair_in_words(*self.names(pair))

    def names(self, pair: int) -> tuple[tuple[str, str], tuple[int, int]]:
        """Return the fingers' names and the disks' numbers of a pair."""
        return self._named(int(self.first[pair]), int(self.second[pair]))

    def passed(self, start: NearDisks, end: NearDisks) -> int | None:
        """Return a pair of disks that would go through each other on the straight way, if any.

        Where neither cuts the other at start and end, they have gone through each other if on the
        way they cut each other by more than half their thickness: a way that follows equilibria
        in small steps is that straight.
        """
        far = np.linalg.norm(end.disks.centers - start.disks.centers, axis=1)
        turned = np.linalg.norm(end.disks.frames[:, :, 2] - start.disks.frames[:, :, 2], axis=1)
        far += end.disks.cores * turned
        first, second = self.first, self.second
        reach = far[first] + far[second]
        pairs = self._closer(start.disks, reach)
        if not len(pairs) or not reach[pairs].any():
            return None
        edge = self._edge
        steps = int(min(_LOOKS, np.ceil(float(reach[pairs].max()) / edge)))
        for share in np.arange(1, steps) / steps:
            disks = between(start.disks, end.disks, float(share))
            one, other = disks[first[pairs]], disks[second[pairs]]
            close = np.flatnonzero(gaps_at_least(one, other) < -edge)
            if len(close):
                gaps = nearest(one[close], other[close]).gaps
                if float(gaps.min()) < -edge:
                    return int(pairs[close[gaps.argmin()]])
        return None

    # -- inside ----------------------------------------------------------------------------

    def _closer(self, disks: Disks, distance: float | np.ndarray) -> np.ndarray:
        """Which pairs may be closer to each other than a distance, a number or one per pair."""
        distance = np.broadcast_to(distance, len(self.first))
        way = disks.centers[self.second] - disks.centers[self.first]
        near = np.einsum("ij,ij->i", way, way) < (self._reach + distance) ** 2
        pairs = np.flatnonzero(near)
        if not len(pairs):
            return pairs
        bound = gaps_at_least(disks[self.first[pairs]], disks[self.second[pairs]])
        return pairs[bound < distance[pairs]]

    def _check_rest(self, disks: Disks) -> None:
        finger, number = self._motion.finger, self._motion.number
        first, second = np.triu_indices(len(finger), 1)
        meet = (finger[first] != finger[second]) | (number[second] - number[first] > 1)
        first, second = first[meet], second[meet]
        close = gaps_at_least(disks[first], disks[second]) < 0
        first, second = first[close], second[close]
        gaps = nearest(disks[first], disks[second]).gaps
        if gaps.min(initial=0.0) < 0:
            worst = int(gaps.argmin())
            words = pair_in_words(*self._named(int(first[worst]), int(second[worst])))
            raise InvalidValue("disks", f"{words}, which cut each other at rest", "apart at rest")

    def _named(self, one: int, other: int) -> tuple[tuple[str, str], tuple[int, int]]:
        finger, number = self._motion.finger, self._motion.number
        fingers = self._names[finger[one]], self._names[finger[other]]
        return fingers, (int(number[one]), int(number[other]))


def pair_in_words(fingers: tuple[str, str], disks: tuple[int, int]) -> str:
    """Name two disks for people."""
    if fingers[0] == fingers[1]:
        return f"disks {disks[0]} and {disks[1]} of {fingers[0]}"
    return f"disk {disks[0]} of {fingers[0]} and disk {disks[1]} of {fingers[1]}"


def press(hand: Hand, blocks: Sequence[FingerBlock], near_disks: NearDisks) -> list[FingerBlock]:
    """Return the fingers' parts of the problem with the forces between disks in them."""
    if not near_disks.active.any():
        return list(blocks)
    parts = []
    for weight, part, rows, bend in zip(
        hand.weights, blocks, near_disks.rows, near_disks.bends, strict=True
    ):
        if bend is not None:
            pushed, before = near_disks.forces @ rows / weight, part.point
            point = replace(
                before, hessian=before.hessian + bend, unbalanced=before.unbalanced + pushed
            )
            derived = replace(part.derived, near=replace(part.derived.near, point=point))
            part = replace(part, derived=derived, unbalanced=part.unbalanced + pushed)
        parts.append(part)
    return parts
