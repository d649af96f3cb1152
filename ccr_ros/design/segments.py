# SPDX-License-Identifier: Apache-2.0
"""Segments of a finger in equilibrium under given cable tensions, many at once.

A frictionless cable pulls on all that lies beyond a segment with its tension T along the one span
that crosses the segment, whatever its other holes are: of its length, that span's alone depends
on the segment's own coordinates. With z the arc coordinates of one segment and y = (z - rest) /
scale, as in `model.equilibrium`, the segment's equilibrium is therefore local,

    y + scale * sum_c T_c d(span length_c)/dz = 0,

and follows from the two hole angles of each cable and the tensions. A finger in equilibrium is a
chain of such segments under common tensions. Lengths are in units of L, tensions are T L^2 / EI.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from ..model.finger import Finger
from ..model.kinematics import rest_coordinates
from ..model.rod import Arc, Buffered
from ..model.rotation import cross
from ..model.settings import SolverSettings

_CHUNKS = (16, 128)  # segments that one call evaluates: of one finger, and of many
_ITERATIONS = 25
_TOLERANCE = 1e-11  # of y; the forces are this well in balance
_LONGEST_STEP = 0.5  # of z [rad]


@lru_cache(maxsize=16)
def _functions(segments: int, order: int, chunk: int) -> tuple[ca.Function, ca.Function]:
    """The rigid increment with its twists, and second derivatives of the work of given loads."""
    arc = Arc(order, 1.0 / segments)
    shift = ca.jacobian(arc.translation, arc.x) @ arc.jacobian
    spin = arc.left_jacobian @ arc.jacobian[:3, :]
    moved = ca.vertcat(ca.vec(arc.rotation), arc.translation, ca.vec(ca.vertcat(spin, shift)))
    increment = ca.Function("increment", [arc.z], [arc.in_z(ca.densify(moved))])
    force, moment = ca.SX.sym("force", 3), ca.SX.sym("moment", 3, 3)
    second = ca.densify(arc.in_z(arc.hessian_in_z(arc.work(force, moment))))
    work = ca.Function("work", [arc.z, force, moment], [second])
    return increment.map(chunk), work.map(chunk)


def _rest(finger: Finger, order: int) -> np.ndarray:
    """Arc coordinates (n, s) at rest; of several pieces the mean and the mean slope."""
    pieces = finger.rest_pieces
    arcs = rest_coordinates(finger, pieces, order).reshape(finger.segments, pieces, -1, 3)
    middle = (2 * np.arange(pieces) + 1) / pieces - 1  # of the pieces, in s of [-1, 1]
    mean = arcs[:, :, 0].sum(axis=1)
    if not order:
        return mean
    # Projection on the Legendre polynomial s: 3/2 of the integral of u s.
    slope = 3.0 * (middle[:, None] * arcs[:, :, 0] + arcs[:, :, 1] / (3 * pieces)).sum(axis=1)
    return np.concatenate([mean, slope], axis=1)


@dataclass(frozen=True, eq=False)
class Segments:
    """Segments at arc coordinates z, with the spans of C cables.

    Attributes:
        z: (k, s) arc coordinates.
        rotation, translation: (k, 3, 3) and (k, 3) from a segment's start to its end.
        twists: (k, 6, s) per arc coordinate: angular velocity, then the end's velocity.
        lengths: (k, C) of the spans.
        spans: (k, C, 3) unit vectors along them, in the frame of the start.
        holes: (k, C, 3) the spans' end points, from the end's centre, in the frame of the start.
        gradient: (k, C, s) of the lengths.
    """

    z: np.ndarray
    rotation: np.ndarray
    translation: np.ndarray
    twists: np.ndarray
    lengths: np.ndarray
    spans: np.ndarray
    holes: np.ndarray
    gradient: np.ndarray

    def poses(self) -> tuple[np.ndarray, np.ndarray]:
        """Frames (k+1, 3, 3) and centres (k+1, 3) of the disks, the segments being one chain."""
        frames, points = [np.eye(3)], [np.zeros(3)]
        for turn, shift in zip(self.rotation, self.translation, strict=True):
            points.append(points[-1] + frames[-1] @ shift)
            frames.append(frames[-1] @ turn)
        return np.array(frames), np.array(points)


class SegmentModel:
    """Evaluates and solves segments of one finger: one arc each, as the default settings have.

    Attributes:
        rest: (n, s) arc coordinates of every segment at rest.
        scale: (s,) what y is multiplied by to give z - rest.
    """

    def __init__(self, finger: Finger) -> None:
        n = finger.segments
        order = SolverSettings().order(finger)
        self.size = 3 * (order + 1)
        self.radius = finger.disk_radius / finger.length
        calls = [[Buffered(f) for f in _functions(n, order, chunk)] for chunk in _CHUNKS]
        self._increment, self._second = zip(*calls, strict=True)
        stiffness = np.array([1.0, 1.0, finger.torsion_ratio])
        self.scale = np.sqrt(1.0 / n / np.concatenate([stiffness, stiffness / 3])[: self.size])
        self.rest = _rest(finger, order)

    def evaluate(self, z: np.ndarray, start: np.ndarray, end: np.ndarray) -> Segments:
        """Evaluate segments z (k, s) with spans between hole angles start and end (k, C) [rad]."""
        values = self._call(self._increment, z)
        rotation = values[:, :9].reshape(-1, 3, 3).transpose(0, 2, 1)
        translation = values[:, 9:12]
        twists = values[:, 12:].reshape(-1, self.size, 6).transpose(0, 2, 1)
        holes = self.holes(end) @ rotation.transpose(0, 2, 1)
        vectors = translation[:, None] + holes - self.holes(start)
        lengths = np.sqrt((vectors * vectors).sum(axis=2))
        spans = vectors / lengths[:, :, None]
        gradient = cross(holes, spans) @ twists[:, :3] + spans @ twists[:, 3:]
        return Segments(z, rotation, translation, twists, lengths, spans, holes, gradient)

    def rest_points(self) -> np.ndarray:
        """Disk centres (n+1, 3) at rest."""
        none = np.zeros((len(self.rest), 0))
        return self.evaluate(self.rest, none, none).poses()[1]

    def hessian(self, at: Segments, tensions: np.ndarray) -> np.ndarray:
        """Second derivatives (k, s, s) in y of the energy and of tensions (k, C) times lengths."""
        pull = tensions[:, :, None] * at.spans
        local = at.holes @ at.rotation
        moment = pull.transpose(0, 2, 1) @ local
        hessian = self._call(self._second, at.z, pull.sum(axis=1), moment.transpose(0, 2, 1))
        hessian = hessian.reshape(-1, self.size, self.size)
        for c in range(tensions.shape[1]):
            moved = self.end_points(at, c)
            slope = at.gradient[:, c]
            weight = (tensions[:, c] / at.lengths[:, c])[:, None, None]
            hessian += weight * (moved.transpose(0, 2, 1) @ moved)
            hessian -= weight * (slope[:, :, None] * slope[:, None])
        hessian *= self.scale[:, None] * self.scale
        hessian += np.eye(self.size)
        return hessian

    def end_points(self, at: Segments, cable: int) -> np.ndarray:
        """Jacobian (k, 3, s) in z of the end points of a cable's spans."""
        arm = at.holes[:, cable, :, None]
        spin = at.twists[:, :3]
        return at.twists[:, 3:] + np.stack(
            [
                spin[:, 1] * arm[:, 2] - spin[:, 2] * arm[:, 1],
                spin[:, 2] * arm[:, 0] - spin[:, 0] * arm[:, 2],
                spin[:, 0] * arm[:, 1] - spin[:, 1] * arm[:, 0],
            ],
            axis=1,
        )

    def per_tension(self, at: Segments, hessian: np.ndarray) -> np.ndarray:
        """Derivatives (k, s, C) of z in equilibrium with respect to the tensions."""
        return self.response(hessian, at.gradient.transpose(0, 2, 1))

    def response(self, hessian: np.ndarray, forces: np.ndarray) -> np.ndarray:
        """Change (k, s, m) of z in equilibrium under further generalised forces (k, s, m) in z."""
        scale = self.scale[:, None]
        return -scale * np.linalg.solve(hessian, scale * forces)

    def solve(
        self,
        rest: np.ndarray,
        start: np.ndarray,
        end: np.ndarray,
        tensions: np.ndarray,
        guess: np.ndarray | None = None,
        tolerance: float = _TOLERANCE,
    ) -> tuple[Segments, np.ndarray, np.ndarray]:
        """Return segments in equilibrium, their Hessians (k, s, s) in y, and whether each is one.

        Args:
            rest: (k, s) arc coordinates at rest.
            start, end: (k, C) hole angles [rad].
            tensions: (k, C) >= 0, T L^2 / EI.
            guess: (k, s) arc coordinates to begin at; default: at rest.
        """
        z = rest if guess is None else guess
        for _ in range(_ITERATIONS):
            at = self.evaluate(z, start, end)
            hessian = self.hessian(at, tensions)
            pulled = (tensions[:, None] @ at.gradient)[:, 0]
            unbalanced = (z - rest) / self.scale + self.scale * pulled
            good = np.abs(unbalanced).max(axis=1) < tolerance
            if good.all():
                break
            lost = ~np.isfinite(hessian).all(axis=(1, 2))  # under tensions beyond reason
            hessian[lost], unbalanced[lost] = np.eye(self.size), np.nan
            step = self.scale * np.linalg.solve(hessian, unbalanced[:, :, None])[:, :, 0]
            longest = np.abs(step).max(axis=1, keepdims=True)
            step *= np.minimum(1.0, _LONGEST_STEP / np.maximum(longest, 1e-300))
            z = z - step
        return at, hessian, good

    def holes(self, angles: np.ndarray) -> np.ndarray:
        """Holes (..., 3) at angles (...) [rad] in their disk's frame."""
        return self.radius * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=-1)

    def _call(self, calls: tuple[Buffered, ...], *arguments: np.ndarray) -> np.ndarray:
        """Values (k, .) of a mapped function at arguments (k, ...), chunk by chunk."""
        total = len(arguments[0])
        chunk, call = next(
            (c, f) for c, f in zip(_CHUNKS, calls, strict=True) if total <= c or c == _CHUNKS[-1]
        )
        flat = [a.reshape(total, -1) for a in arguments]
        values = np.empty((total, len(call.outputs[0]) // chunk))
        for first in range(0, total, chunk):
            count = min(chunk, total - first)
            for array, into in zip(flat, call.inputs, strict=True):
                into[: count * array.shape[1]] = array[first : first + count].ravel()
            call()
            values[first : first + count] = call.outputs[0].reshape(chunk, -1)[:count]
        return values
