# SPDX-License-Identifier: Apache-2.0
"""A pose of the model that puts the disks where they are wanted.

Given centres and tangents at its ends, one arc of linear curvature has no freedom left to be as
long as the curve between the disks; two have. So the pose has two arcs per segment, and segments
are solved on their own, each for the way to its end and the tangent there (or the frame, where
frames are wanted), by Gauss-Newton steps of least change from a guess that bends smoothly. Where
frames are not given the pose is free of twist, u_z = 0: its frames are rotation-minimising.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ccr_ros.model.equilibrium import EquilibriumProblem
from ccr_ros.model.rod import RodState
from ccr_ros.model.rotation import cross, skew

from .target import DesiredShape

PIECES = 2  # arcs per segment
_ITERATIONS = 60
_DONE = 1e-12  # of a segment's length, and rad
_LARGEST_STEP = 0.3  # rad in one arc
_DAMPING = 1e-24  # of a straight segment, whose length no small bend changes
# Of an arc's coordinates (mean and linear part of both arcs): how dear a change is of curvature's
# jumps in the middle of a segment, of its values at the disks, and of any other change.
_JUMP, _AT_DISK, _ANY = 10.0, 3.0, 1.0


@dataclass(frozen=True, eq=False)
class PoseFit:
    """A pose near a wanted shape.

    Attributes:
        y: (N,) coordinates of the pose, as scaled in `EquilibriumProblem`, from straight.
        squared_error: Sum of squared distances of the disk centres from the wanted ones [m^2].
        angle_error: Largest angle of a disk's axis from the wanted tangent [rad].
    """

    y: np.ndarray
    squared_error: float
    angle_error: float


def fit_pose(problem: EquilibriumProblem, shape: DesiredShape) -> PoseFit:
    """Return the pose, of a problem whose rest shape is straight in ``PIECES`` arcs per segment."""
    n = shape.segments
    length = problem.finger.length
    points = shape.points / length
    tangents = _wanted_tangents(shape, length)
    twisted = shape.frames is not None
    frames = shape.frames if shape.frames is not None else _untwisted(tangents)
    free = np.tile([True, True, twisted], 2 * PIECES)
    weigh = _cheapest(np.flatnonzero(free))
    rod, z = problem.rod, _guess(frames)
    for _ in range(_ITERATIONS):
        gap, rows = _gaps(rod.state(z), points, frames, twisted)
        if np.abs(gap).max() < _DONE:
            break
        rows = rows[:, :, free]
        back = weigh @ rows.transpose(0, 2, 1)
        gram = rows @ back
        gram += _DAMPING * np.eye(gram.shape[1])
        step = -(back @ np.linalg.solve(gram, gap[:, :, None]))[:, :, 0]
        largest = np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-300)
        step *= np.minimum(1.0, _LARGEST_STEP / largest)
        change = np.zeros((n, free.size))
        change[:, free] = step
        z = z + change.reshape(z.shape)
    if not twisted:
        z = _joined(rod.state(z), z, frames)
    state = rod.state(z)
    centres, axes = state.positions[::PIECES], state.rotations[::PIECES, :, 2]
    off = (centres - points) * length
    return PoseFit(
        (z / problem.coordinate_scale).ravel(),
        float(np.sum(off * off)),
        float(np.linalg.norm(cross(axes, tangents), axis=1).max()),
    )


def smooth_guess(problem: EquilibriumProblem, shape: DesiredShape) -> np.ndarray:
    """Return coordinates (N,) of a pose that turns as wanted from disk to disk, free of twist."""
    frames = _untwisted(_wanted_tangents(shape, problem.finger.length))
    return (_guess(frames) / problem.coordinate_scale).ravel()


def _wanted_tangents(shape: DesiredShape, length: float) -> np.ndarray:
    return _tangents(shape.points / length) if shape.tangents is None else shape.tangents


def _gaps(
    state: RodState, points: np.ndarray, frames: np.ndarray, twisted: bool
) -> tuple[np.ndarray, np.ndarray]:
    """What each segment's end misses (n, c), and its derivatives (n, c, 12) by its coordinates.

    All is seen from the segment's first disk, in ``frames``: a segment alone is looked at, whatever
    those before it do. What its end shall meet is the way there and the tangent, or the frame.
    """
    n = len(points) - 1
    rotations, centres = state.rotations[::PIECES], state.positions[::PIECES]
    seen = frames[:-1].transpose(0, 2, 1)
    way = (seen @ (points[1:] - points[:-1])[:, :, None])[:, :, 0]
    back = rotations[:-1].transpose(0, 2, 1)
    local = back @ rotations[1:]
    gone = (back @ (centres[1:] - centres[:-1])[:, :, None])[:, :, 0]
    twists = state.twists.reshape(n, -1, 6)
    spin = twists[:, :, :3]
    shift = twists[:, :, 3:] + cross(spin, centres[1:, None, :])
    spin, shift = spin @ rotations[:-1], shift @ rotations[:-1]
    if twisted:
        relative = frames[1:].transpose(0, 2, 1) @ frames[:-1] @ local
        turn = 0.5 * (relative - relative.transpose(0, 2, 1))[:, [2, 0, 1], [1, 2, 0]]
        turn_rows = (spin @ local).transpose(0, 2, 1)
    else:
        wanted = seen @ frames[1:, :, 2, None]
        sides = local[:, :, :2].transpose(0, 2, 1)  # of the end's disk, in it
        turn = (sides @ wanted)[:, :, 0]
        turn_rows = cross(sides, wanted.transpose(0, 2, 1)) @ spin.transpose(0, 2, 1)
    gap = np.concatenate([(gone - way) * n, turn], axis=1)
    rows = np.concatenate([shift.transpose(0, 2, 1) * n, turn_rows], axis=1)
    return gap, rows


def _joined(state: RodState, z: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """Coordinates (2 n, 6) of segments that were solved in ``frames``, in the frames of a chain.

    A segment free of twist is the same in any frame turned about its first tangent; its bending
    alone is turned. A chain's frames are turned by all that the segments before end off ``frames``.
    """
    rotations = state.rotations[::PIECES]
    ends = frames[:-1] @ rotations[:-1].transpose(0, 2, 1) @ rotations[1:]
    off = frames[1:].transpose(0, 2, 1) @ ends  # about z, as the tangents agree
    angles = np.cumsum(np.arctan2(off[:, 1, 0] - off[:, 0, 1], off[:, 0, 0] + off[:, 1, 1]))
    angles = np.concatenate([[0.0], angles[:-1]])
    c, s = np.cos(angles)[:, None], np.sin(angles)[:, None]
    vectors = z.reshape(len(angles), -1, 3)
    x, y = vectors[:, :, 0], vectors[:, :, 1]
    turned = np.stack([c * x + s * y, c * y - s * x, vectors[:, :, 2]], axis=2)
    return turned.reshape(z.shape)


def _cheapest(columns: np.ndarray) -> np.ndarray:
    """Inverse (c, c) of the form that says how dear a change of a segment's coordinates is."""
    # rows: curvature at both ends of both arcs, per coordinates (a1, b1, a2, b2)
    ends = np.array([[1, -1, 0, 0], [1, 1, 0, 0], [0, 0, 1, -1], [0, 0, 1, 1.0]])
    dear = _ANY * np.eye(4) + _JUMP * np.outer(ends[1] - ends[2], ends[1] - ends[2])
    for disk in (ends[0], ends[3]):
        dear += _AT_DISK * np.outer(disk, disk)
    return np.linalg.inv(np.kron(dear, np.eye(3))[np.ix_(columns, columns)])


def _guess(frames: np.ndarray) -> np.ndarray:
    """Arc coordinates (2 n, 6) of curvature that is continuous and turns from frame to frame."""
    turns = _rotation_vectors(frames[:-1].transpose(0, 2, 1) @ frames[1:])
    at_disk = np.empty((len(frames), 3))  # turn per segment
    at_disk[1:-1] = (turns[1:] + turns[:-1]) / 2
    at_disk[0], at_disk[-1] = 2 * turns[0] - at_disk[1], 2 * turns[-1] - at_disk[-2]
    middle = 2 * turns - (at_disk[1:] + at_disk[:-1]) / 2
    knots = np.stack([at_disk[:-1], middle, at_disk[1:]], axis=1) / PIECES
    mean, half = (knots[:, 1:] + knots[:, :-1]) / 2, (knots[:, 1:] - knots[:, :-1]) / 2
    return np.concatenate([mean, half], axis=2).reshape(-1, 6)


def _untwisted(tangents: np.ndarray) -> np.ndarray:
    """Frames (n+1, 3, 3) along tangents, each turned from the last by the smallest turn."""
    frames = [np.eye(3)]
    for tangent in tangents[1:]:
        frames.append(_turned_to(frames[-1][None], tangent[None])[0])
    return np.array(frames)


def _turned_to(frames: np.ndarray, tangents: np.ndarray) -> np.ndarray:
    """Frames (k, 3, 3) turned the shortest way so that their z axes are the tangents (k, 3)."""
    axes = frames[:, :, 2]
    k = skew(cross(axes, tangents))
    cosine = np.einsum("ij,ij->i", axes, tangents)
    # Rodrigues; at a half turn there is no shortest way, and any finite result serves.
    factor = 1.0 / np.maximum(1.0 + cosine, 1e-9)
    return (np.eye(3) + k + factor[:, None, None] * (k @ k)) @ frames


def _rotation_vectors(rotations: np.ndarray) -> np.ndarray:
    """Rotation vectors (k, 3) of rotation matrices (k, 3, 3) of less than half a turn."""
    odd = rotations - rotations.transpose(0, 2, 1)
    sine = 0.5 * np.stack([odd[:, 2, 1], odd[:, 0, 2], odd[:, 1, 0]], axis=1)
    size = np.linalg.norm(sine, axis=1)
    angle = np.arctan2(size, (np.trace(rotations, axis1=1, axis2=2) - 1.0) / 2)
    return sine * np.where(size > 1e-12, angle / np.maximum(size, 1e-12), 1.0)[:, None]


def _tangents(points: np.ndarray) -> np.ndarray:
    """Tangents (n+1, 3) of the cubic spline through points that leaves the first along +z.

    Its last piece is a parabola; the points are taken as equally far along it.
    """
    n = len(points) - 1
    slopes = np.zeros((n + 1, 3))
    matrix = np.zeros((n + 1, n + 1))
    matrix[0, 0], slopes[0] = 1.0, [0.0, 0.0, 1.0 / n]
    for i in range(1, n):
        matrix[i, i - 1 : i + 2] = 1.0, 4.0, 1.0
        slopes[i] = 3 * (points[i + 1] - points[i - 1])
    matrix[n, n - 1 :], slopes[n] = 1.0, 2 * (points[n] - points[n - 1])
    slopes = np.linalg.solve(matrix, slopes)
    return slopes / np.maximum(np.linalg.norm(slopes, axis=1, keepdims=True), 1e-12)
