# SPDX-License-Identifier: Apache-2.0
"""How disks move with the fingers' coordinates, and what forces on them do to the fingers.

All is in the gripper's frame and the hand's units, but for what is said to be a finger's own.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ccr_ros.model.rod import RodState
from ccr_ros.model.rotation import cross
from ccr_ros.model.sqp import KktPoint

from .assembly import Hand
from .disk_distance import Disks, Nearest

_FLAT = 1e-9  # relative; smaller eigenvalues of a pair's second derivatives are rounding


class DiskMotion:
    """The disks of a hand, numbered finger by finger from base to tip.

    Attributes:
        hand: The fingers.
        finger, number: (D,) whose disk, and which, 0 at the base.

    Args:
        cores: Per finger, radius of its disks' flat cores; edge: half their thickness [m].
    """

    def __init__(self, hand: Hand, cores: Sequence[float], edge: float) -> None:
        self.hand = hand
        counts = [m.finger.segments + 1 for m in hand.mounted]
        self.finger = np.repeat(np.arange(len(counts)), counts)
        self.number = np.concatenate([np.arange(count) for count in counts])
        self._cores = np.repeat(cores, counts) / hand.length
        self._edges = np.full(len(self.finger), edge / hand.length)
        self._arcs = [np.arange(n) * p.arcs_per_segment
                      for n, p in zip(counts, hand.problems, strict=True)]  # fmt: skip
        self._moves = [
            (np.arange(p.size) // p.rod.size < arcs[:, None]).astype(float)
            for p, arcs in zip(hand.problems, self._arcs, strict=True)
        ]
        self._shares = [m.finger.length / hand.length for m in hand.mounted]
        self._places = [m.base.position / hand.length for m in hand.mounted]

    def disks(self, rods: Sequence[RodState]) -> Disks:
        """Return where the disks are."""
        centers, frames = [], []
        for index, rod in enumerate(rods):
            turn, arcs = self.hand.mounted[index].base.rotation, self._arcs[index]
            share, place = self._shares[index], self._places[index]
            centers.append(rod.positions[arcs] @ turn.T * share + place)
            frames.append(turn @ rod.rotations[arcs])
        return Disks(np.concatenate(centers), np.concatenate(frames), self._cores, self._edges)

    def twists(self, index: int, point: KktPoint) -> np.ndarray:
        """Return a finger's twists (N, 6) about the gripper's origin."""
        turn = self.hand.mounted[index].base.rotation
        spin = point.first.twists[:, :3] @ turn.T
        shift = point.first.twists[:, 3:] @ turn.T * self._shares[index]
        shift += cross(self._places[index], spin)
        return np.concatenate([spin, shift], axis=1)

    def rows(
        self, one: np.ndarray, other: np.ndarray, near: Nearest, twists: Sequence[np.ndarray]
    ) -> tuple[np.ndarray, ...]:
        """Return per finger the gradients (k, N) of -gap of pairs of disks (k,)."""
        none = np.zeros_like(near.normals)
        motions = np.concatenate([none, near.normals, none, -near.normals], axis=1)
        return self._along(one, other, near.points, motions, twists)

    def joining(
        self,
        one: np.ndarray,
        other: np.ndarray,
        near: Nearest,
        second: np.ndarray,
        twists: Sequence[np.ndarray],
    ) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
        """Return forms (k, 12, 12) of pairs' motions (`second_derivatives`) in coordinates.

        As rows, per finger (m, N), and their factors (m,): the sum of factor x row' row.
        """
        values, vectors = np.linalg.eigh(second)
        large = np.abs(values) > _FLAT * np.abs(values).max(axis=1, keepdims=True)
        of, which = np.nonzero(large)
        rows = self._along(one[of], other[of], near.points[of], vectors[of, :, which], twists)
        return rows, values[of, which]

    def bend(
        self,
        index: int,
        point: KktPoint,
        one: np.ndarray,
        other: np.ndarray,
        near: Nearest,
        forces: np.ndarray,
    ) -> np.ndarray | None:
        """Return what forces that keep their directions add to a finger's Hessian.

        (N, N), in the finger's own units; None where none acts on it.
        """
        sides = self._sides(one, other, index)
        if not sides:
            return None
        problem, share = self.hand.problems[index], self._shares[index]
        turn = self.hand.mounted[index].base.rotation
        loads = np.zeros((problem.arcs, 12))
        for side, own, disks in sides:
            push = (near.normals if side == 0 else -near.normals)[own] @ turn
            push = push * (forces[own] * share / self.hand.weights[index])[:, None]
            where = (near.points[own, side] - self._places[index]) @ turn / share
            moments = (push[:, :, None] * where[:, None, :]).reshape(-1, 9)
            carried = np.arange(problem.arcs)[:, None] < self._arcs[index][disks]
            loads += carried.astype(float) @ np.concatenate([push, moments], axis=1)
        return problem.rod.curvature_hessian(
            point.at.z, point.at.rod, point.first.twists, problem.coordinate_scale, loads
        )

    # -- inside ----------------------------------------------------------------------------

    def _sides(
        self, one: np.ndarray, other: np.ndarray, index: int
    ) -> list[tuple[int, np.ndarray, np.ndarray]]:
        """Per side (0, 1) of the pairs which of them are a finger's, and with which disks."""
        found = []
        for side, disks in enumerate((one, other)):
            own = np.flatnonzero(self.finger[disks] == index)
            if len(own):
                found.append((side, own, self.number[disks[own]]))
        return found

    def _along(
        self,
        one: np.ndarray,
        other: np.ndarray,
        points: np.ndarray,
        motions: np.ndarray,
        twists: Sequence[np.ndarray],
    ) -> tuple[np.ndarray, ...]:
        """Per finger (k, N) of motions' (k, 12) products with (w_A, v_a, w_B, v_b)."""
        rows = []
        for index, twist in enumerate(twists):
            row = np.zeros((len(motions), len(twist)))
            for side, own, disks in self._sides(one, other, index):
                spin, shift = np.split(motions[own, 6 * side : 6 * side + 6], 2, axis=1)
                spin = spin + cross(points[own, side], shift)
                wrench = np.concatenate([spin, shift], axis=1)
                row[own] += (wrench @ twist.T) * self._moves[index][disks]
            rows.append(row)
        return tuple(rows)
