# SPDX-License-Identifier: Apache-2.0
"""The gap of two disks, and its first and second derivatives as they move.

A disk is the set of points within half its thickness e of a flat core of radius R - e, so its rim
is round and the normal between two disks is defined also where they touch or cut a little. Points
of the cores are a = c_A + E_A s and b = c_B + E_B t, E the two axes in a disk's plane. With
p = (s, t) and q(p) = |s|^2 / r_A + |t|^2 / r_B, r the cores' radii,

    gap = min_p |b - a| + D/2 (q(p) - r_A - r_B) - e_A - e_B        over |s| <= r_A, |t| <= r_B

The term with D (`DOME`) domes the faces by at most D r / 2 (a few micrometres for disks of some
millimetres): it makes the nearest points unique and the gap smooth where disks are parallel, where
it chooses the middle of what overlaps. Rims keep their places, and the gap is never overestimated.

The minimum is one of a strictly convex function: a semismooth Newton method on
p = P(p - step * gradient), P the projection onto both cores, takes the best of its own step, parts
of it, and the projected gradient's.
By the envelope theorem the gap's derivative is that of |b - a| with a and b fixed on their disks,
n.(db - da). With K_wp and K_pp the mixed and second derivatives by p along the cores (on a rim:
along the rim), the second derivative is that with a and b fixed, less K_wp K_pp^-1 K_pw.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ccr_ros.model.rotation import cross

DOME = 2e-3  # slope of the faces at the rim; a pair of faces is so much of a radius thicker
_STEPS = 60
_EASY = 3  # steps that mostly are enough; then shorter ones are tried, too
_SHARES = (1.0, 0.25, 0.06, 0.015)  # of Newton's steps
_EXACT = 1e-11  # of the cores' radii: change of the nearest points at which they are found
_NOWHERE = 1e-12  # of the units; centres that are nearer are in one place
_CUT = 1e-4  # of the cores' radii; cores that are nearer cut each other


@dataclass(frozen=True, eq=False)
class Disks:
    """Poses of k disks in one frame.

    Attributes:
        centers: (k, 3).
        frames: (k, 3, 3) orientations; disks lie in the plane of the first two columns.
        cores: (k,) radii of the flat cores; edges: (k,) half thicknesses.
    """

    centers: np.ndarray
    frames: np.ndarray
    cores: np.ndarray
    edges: np.ndarray

    def __getitem__(self, which: np.ndarray) -> Disks:
        return Disks(self.centers[which], self.frames[which], self.cores[which], self.edges[which])


@dataclass(frozen=True, eq=False)
class Nearest:
    """Nearest points of k pairs of disks.

    Attributes:
        places: (k, 4) where they are in the cores' planes, (s, t).
        points: (k, 2, 3) the cores' nearest points a and b.
        normals: (k, 3) unit vectors n from a to b.
        apart: (k,) distances of the cores.
        gaps: (k,) of the disks; negative where they cut each other.
        cut: (k,) the cores cut each other: the normal is along the line of centres, points are the
            farthest along it, ``apart`` is how far they are past each other, negative.
    """

    places: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    apart: np.ndarray
    gaps: np.ndarray
    cut: np.ndarray

    def __getitem__(self, which: np.ndarray) -> Nearest:
        return Nearest(
            self.places[which], self.points[which], self.normals[which], self.apart[which],
            self.gaps[which], self.cut[which],
        )  # fmt: skip

    @property
    def touch(self) -> np.ndarray:
        """(k, 3) middles between the disks' surfaces."""
        return self.points.mean(axis=1)


def gaps_at_least(one: Disks, other: Disks) -> np.ndarray:
    """Return lower bounds (k,) of the gaps, at little cost: along the line of the centres."""
    way = other.centers - one.centers
    far = np.sqrt(np.einsum("ij,ij->i", way, way))
    way = way / np.maximum(far, _NOWHERE)[:, None]
    bound = far - one.edges - other.edges - 0.5 * DOME * (one.cores + other.cores)
    for disks in (one, other):
        along = np.einsum("ij,ij->i", way, disks.frames[:, :, 2])
        bound -= disks.cores * np.sqrt(np.maximum(0.0, 1.0 - along**2))
    return bound


def between(start: Disks, end: Disks, share: float) -> Disks:
    """Return disks on their way from one pose to another, which are not far from each other."""
    centers = start.centers + share * (end.centers - start.centers)
    mixed = start.frames + share * (end.frames - start.frames)
    z = mixed[:, :, 2] / np.linalg.norm(mixed[:, :, 2], axis=1)[:, None]
    y = cross(z, mixed[:, :, 0])
    y /= np.linalg.norm(y, axis=1)[:, None]
    frames = np.stack([cross(y, z), y, z], axis=2)
    return Disks(centers, frames, start.cores, start.edges)


def nearest(one: Disks, other: Disks, start: np.ndarray | None = None) -> Nearest:
    """Return the nearest points of pairs of disks.

    Args:
        one, other: The k pairs.
        start: (k, 4) guesses at `Nearest.places`, NaN where there is none.
    """
    task = _Task(one, other)
    places = task.guess() if start is None else np.where(np.isnan(start), task.guess(), start)
    places = task.inside(places)
    least = task.cost(places)
    busy = np.ones(len(places), dtype=bool)
    for turn in range(_STEPS):
        here = task.of(busy)
        shares: tuple[float, ...] = _SHARES if turn > _EASY else _SHARES[:1]
        if start is not None and turn < _EASY:
            shares = ()
        new, cost, done = here.improved(places[busy], least[busy], shares)
        places[busy], least[busy] = new, cost
        busy[busy] = ~done
        if not busy.any():
            break
    return task.found(places)


class _Task:
    """The minimisation for k pairs, each in p (4,)."""

    def __init__(self, one: Disks, other: Disks) -> None:
        self.one, self.other = one, other
        self.moves = np.concatenate([-one.frames[:, :, :2], other.frames[:, :, :2]], axis=2)
        self.offset = other.centers - one.centers
        self.radii = np.stack([one.cores, other.cores], axis=1)
        self.dome = np.repeat(DOME / self.radii, 2, axis=1)

    def of(self, which: np.ndarray) -> _Task:
        return self if which.all() else _Task(self.one[which], self.other[which])

    def guess(self) -> np.ndarray:
        """Places (k, 4) nearest to the middle between the centres."""
        half = 0.5 * np.stack([self.offset, -self.offset], axis=1)
        frames = np.stack([self.one.frames, self.other.frames], axis=1)[..., :2]
        return self.inside(np.einsum("kdi,kdij->kdj", half, frames).reshape(-1, 4))

    def inside(self, places: np.ndarray) -> np.ndarray:
        """The nearest places (k, 4) within the cores."""
        both = places.reshape(-1, 2, 2)
        far = np.sqrt(np.einsum("kdi,kdi->kd", both, both))
        return (both * np.minimum(1.0, self.radii / np.maximum(far, 1e-300))[..., None]).reshape(
            -1, 4
        )

    def ways(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """b - a (k, 3), and its length, kept off zero."""
        way = self.offset + np.einsum("kij,kj->ki", self.moves, places)
        apart = np.sqrt(np.einsum("ki,ki->k", way, way))
        return way, np.maximum(apart, 0.1 * _CUT * self.radii.min(axis=1))

    def cost(self, places: np.ndarray) -> np.ndarray:
        """What is minimised (k,)."""
        return self.ways(places)[1] + 0.5 * np.einsum("kj,kj->k", self.dome * places, places)

    def improved(
        self, places: np.ndarray, cost: np.ndarray, shares: tuple[float, ...]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Places after the best of some steps, their costs, and whether they are the minimum.

        ``shares`` of Newton's step are tried: along a rim it may be too long. None at all where the
        minimum is thought to be near.
        """
        way, apart = self.ways(places)
        normal = way / apart[:, None]
        gradient = np.einsum("kij,ki->kj", self.moves, normal) + self.dome * places
        along = np.einsum("kij,ki->kj", self.moves, normal)
        bent = np.einsum("kij,kil->kjl", self.moves, self.moves)
        bent -= along[:, :, None] * along[:, None, :]
        bent /= apart[:, None, None]
        bent[:, range(4), range(4)] += self.dome
        models = [bent]
        if shares:
            # Far from the minimum the square of |b - a| is the better model: smooth at 0, too.
            flat = np.einsum("kij,kil->kjl", self.moves, self.moves) / apart[:, None, None]
            flat[:, range(4), range(4)] += self.dome
            models = [flat, bent]
        size = 1.0 / (2.0 / apart + self.dome.max(axis=1))  # below 1 / largest curvature
        ahead = places - size[:, None] * gradient
        downhill = self.inside(ahead)
        left = (places - downhill)[:, :, None]
        shadow, scale = self.shadow(ahead), size[:, None, None]
        tries = [downhill]
        for model in models:
            matrix = np.eye(4) - shadow @ (np.eye(4) - scale * model)
            step = -np.linalg.solve(matrix, left)[:, :, 0]
            if shares:
                tries.append(places + self.room(places, step) * step)
            for share in shares:
                tries += self.followed(self.inside(places + share * step))
            tries.append(self.inside(places + step))
        costs = np.stack([self.cost(x) for x in tries])
        # Near the minimum costs differ by rounding alone: there Newton's step is the best one.
        costs[-1] -= 1e-14 * (np.abs(cost) + self.radii.max(axis=1))
        best = costs.argmin(axis=0)
        every = np.arange(len(places))
        new = np.stack(tries)[best, every]
        moved = np.abs(new - places).max(axis=1)
        done = (moved <= _EXACT * self.radii.max(axis=1)) & (best == len(tries) - 1)
        done |= apart <= _CUT * self.radii.min(axis=1)
        return new, costs[best, every], done

    def followed(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Places where one of the two is moved to what is nearest to the other."""
        frames = [self.one.frames[:, :, :2], self.other.frames[:, :, :2]]
        a = np.einsum("kij,kj->ki", frames[0], places[:, :2]) - self.offset
        b = np.einsum("kij,kj->ki", frames[1], places[:, 2:]) + self.offset
        first, second = places.copy(), places.copy()
        first[:, 2:] = np.einsum("kij,ki->kj", frames[1], a)
        second[:, :2] = np.einsum("kij,ki->kj", frames[0], b)
        return self.inside(first), self.inside(second)

    def room(self, places: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Largest share (k, 1) of a step, at most 1, that stays within both cores."""
        here, way = places.reshape(-1, 2, 2), step.reshape(-1, 2, 2)
        square = np.maximum(np.einsum("kdi,kdi->kd", way, way), 1e-300)
        half = np.einsum("kdi,kdi->kd", here, way)
        left = np.maximum(0.0, self.radii**2 - np.einsum("kdi,kdi->kd", here, here))
        share = (np.sqrt(half**2 + square * left) - half) / square
        return np.minimum(1.0, share.min(axis=1))[:, None]

    def shadow(self, ahead: np.ndarray) -> np.ndarray:
        """Derivative (k, 4, 4) of `inside`."""
        both = ahead.reshape(-1, 2, 2)
        far = np.sqrt(np.einsum("kdi,kdi->kd", both, both))
        out = far > self.radii
        unit = both / np.maximum(far, 1e-300)[..., None]
        share = np.where(out, self.radii / np.maximum(far, 1e-300), 1.0)
        block = np.eye(2) - np.where(out, 1.0, 0.0)[..., None, None] * (
            unit[..., :, None] * unit[..., None, :]
        )
        block *= share[..., None, None]
        whole = np.zeros((len(ahead), 4, 4))
        whole[:, :2, :2], whole[:, 2:, 2:] = block[:, 0], block[:, 1]
        return whole

    def found(self, places: np.ndarray) -> Nearest:
        """The result at the minimum."""
        a = self.one.centers + np.einsum("kij,kj->ki", self.one.frames[:, :, :2], places[:, :2])
        b = self.other.centers + np.einsum("kij,kj->ki", self.other.frames[:, :, :2], places[:, 2:])
        way = b - a
        apart = np.sqrt(np.einsum("ki,ki->k", way, way))
        cut = apart <= _CUT * self.radii.min(axis=1)
        if cut.any():
            self.separate(a, b, way, apart, places, cut)
        normal = way / np.maximum(np.linalg.norm(way, axis=1), 1e-300)[:, None]
        dome = 0.5 * (np.einsum("kj,kj->k", self.dome * places, places) - DOME * self.radii.sum(1))
        gaps = apart + dome - self.one.edges - self.other.edges
        return Nearest(places, np.stack([a, b], axis=1), normal, apart, gaps, cut)

    def separate(
        self,
        a: np.ndarray,
        b: np.ndarray,
        way: np.ndarray,
        apart: np.ndarray,
        places: np.ndarray,
        cut: np.ndarray,
    ) -> None:
        """Put in for pairs that cut each other how far they are past each other (see `Nearest`)."""
        line = self.offset[cut]
        far = np.linalg.norm(line, axis=1)[:, None]
        line = np.where(
            far > _NOWHERE, line / np.maximum(far, _NOWHERE), self.one.frames[cut, :, 2]
        )
        for disks, points, sign, own in (
            (self.one, a, 1.0, slice(0, 2)),
            (self.other, b, -1.0, slice(2, 4)),
        ):
            axes = disks.frames[cut][:, :, :2]
            flat = sign * np.einsum("kij,ki->kj", axes, line)
            flat *= (disks.cores[cut] / np.maximum(np.linalg.norm(flat, axis=1), 1e-9))[:, None]
            points[cut] = disks.centers[cut] + np.einsum("kij,kj->ki", axes, flat)
            places[cut, own] = flat
        apart[cut] = np.einsum("ki,ki->k", line, b[cut] - a[cut])
        way[cut] = line


def second_derivatives(one: Disks, other: Disks, at: Nearest) -> np.ndarray:
    """Return (k, 12, 12) second derivatives of the gaps but for the points' own accelerations.

    Per pair with respect to (w_A, v_a, w_B, v_b): the disks' angular velocities, and the velocities
    of a and b fixed on them. The gap's second derivative along a motion is that form, and
    n.(b'' - a''), the accelerations of those points. Zero where cores cut each other.
    """
    count = len(at.gaps)
    task = _Task(one, other)
    eye = np.eye(3)
    across = eye - at.normals[:, :, None] * at.normals[:, None, :]
    across /= np.where(at.cut, 1.0, at.apart)[:, None, None]
    apart = np.zeros((3, 12))  # of b - a by the motion
    apart[:, 3:6], apart[:, 9:] = -eye, eye
    mixed = apart.T @ across @ task.moves
    turned = cross(task.moves.transpose(0, 2, 1), at.normals[:, None, :]).transpose(0, 2, 1)
    mixed[:, :3, :2] += turned[:, :, :2]
    mixed[:, 6:9, 2:] += turned[:, :, 2:]
    bent = task.moves.transpose(0, 2, 1) @ across @ task.moves
    # A place on a rim moves along it; its multiplier curves it as the rim does.
    both = at.places.reshape(-1, 2, 2)
    far = np.linalg.norm(both, axis=2)
    unit = both / np.maximum(far, 1e-300)[..., None]
    push = np.einsum("kij,ki->kj", task.moves, at.normals).reshape(-1, 2, 2)
    outwards = -np.einsum("kdi,kdi->kd", push, unit)  # n.e_r, on either disk seen from it
    on_rim = (far >= task.radii * (1 - 1e-9)) & (outwards > DOME)
    curve = np.where(on_rim, outwards, DOME) / task.radii
    bent[:, range(4), range(4)] += np.repeat(curve, 2, axis=1)
    bent[at.cut] = np.eye(4)
    held = np.zeros((count, 4, 4))
    rim = np.where(on_rim[..., None, None], unit[..., :, None] * unit[..., None, :], 0.0)
    held[:, :2, :2], held[:, 2:, 2:] = rim[:, 0], rim[:, 1]
    free = np.eye(4) - held
    answer = free @ np.linalg.inv(free @ bent @ free + held) @ free
    second = apart.T @ across @ apart - mixed @ answer @ mixed.transpose(0, 2, 1)
    second[at.cut] = 0.0
    return 0.5 * (second + second.transpose(0, 2, 1))
