# SPDX-License-Identifier: Apache-2.0
"""Where a finger's coordinates put its points and cables, with exact derivatives.

In units of the finger's length. The same code serves several like fingers at once, stacked: all
arrays then have a leading axis, one entry per finger, for which numpy's calls are paid once.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np

from .finger import Finger
from .points import Points
from .rod import Rod, RodState
from .settings import SolverSettings


@dataclass(frozen=True, eq=False)
class Placed:
    """A finger at one y (units of L).

    Attributes:
        y: (N,) scaled departure from the rest shape.
        z: (E, .) arc coordinates.
        rod: The rod's state.
        points: (P, 3) all tracked points.
        spans: (S, 3) unit vectors along the cables' spans.
        span_lengths: (S,).
        lengths: (C,) length of each cable (or of each span, in the proportional model).
    """

    y: np.ndarray
    z: np.ndarray
    rod: RodState
    points: np.ndarray
    spans: np.ndarray
    span_lengths: np.ndarray
    lengths: np.ndarray


@dataclass(frozen=True, eq=False)
class Linearization:
    """First derivatives of what is `Placed`.

    Attributes:
        twists: (N, 6) the rod's twists per scaled coordinate.
        points: (P, 3, N) Jacobian of all points.
        spans: (S, 3, N) Jacobian of the span vectors.
        stretch: (S, N) Jacobian of the span lengths.
        lengths: (C, N) Jacobian of the cable lengths.
    """

    twists: np.ndarray
    points: np.ndarray
    spans: np.ndarray
    stretch: np.ndarray
    lengths: np.ndarray


def rest_coordinates(finger: Finger, arcs_per_segment: int, order: int) -> np.ndarray:
    """Return the arc coordinates (E, 3 (order + 1)) of the rest shape.

    A part of a piece of linear curvature has linear curvature again; without a linear part
    (order 0) an arc gets its mean curvature.

    Args:
        finger: Its rest shape is meant.
        arcs_per_segment: A multiple of `Finger.rest_pieces`.
        order: Of the arcs' curvature.
    """
    start, end = finger.rest_curvature_ends[:, :, :, None].transpose(2, 0, 1, 3, 4)
    k = arcs_per_segment // finger.rest_pieces
    knots = start + np.arange(k + 1)[:, None] / k * (end - start)  # (n, pieces, k + 1, 3)
    turns = knots * (finger.segment_length / arcs_per_segment)
    mean, half = (turns[:, :, 1:] + turns[:, :, :-1]) / 2, (turns[:, :, 1:] - turns[:, :, :-1]) / 2
    return np.concatenate([mean, half][: order + 1], axis=3).reshape(-1, 3 * (order + 1))


class Kinematics:
    """A finger's arcs, points and cables.

    Attributes:
        rod: The chain of arcs.
        size: N, of y.
        points: Labels and offsets of the points.
        z_rest: (E, .) arc coordinates of the rest shape.
        coordinate_scale: (.,) of one arc: z = z_rest + scale y.
        span_cable, group_cable: The cable of each span, and of each length that is bounded.
    """

    def __init__(self, finger: Finger, settings: SolverSettings) -> None:
        k = self.arcs_per_segment = settings.arcs_per_segment * finger.rest_pieces
        order = settings.order(finger)
        self.arcs = finger.segments * k
        self.rod = Rod(self.arcs, order)
        h = 1.0 / self.arcs
        stiffness = np.array([1.0, 1.0, finger.torsion_ratio])
        # 1/2 h k (a - rest)^2 + 1/2 (h k / 3) b^2: Legendre polynomials are orthogonal.
        per_arc = np.concatenate([stiffness, stiffness / 3][: order + 1])
        self.coordinate_scale = np.sqrt(h / per_arc)  # z = rest + scale * y
        self.rod_step = h
        self.size = self.arcs * self.rod.size
        self.z_rest = rest_coordinates(finger, k, order)

        self.points = Points(finger)
        self._offset = self.points.offset
        spans = [
            (j, pts[i], pts[i + 1])
            for j, pts in enumerate(self.points.cable)
            for i in range(len(pts) - 1)
        ]
        self.span_cable = np.array([s[0] for s in spans])
        start, end = np.array([s[1] for s in spans]), np.array([s[2] for s in spans])
        groups = (
            self.span_cable if settings.cable_model == "frictionless" else np.arange(len(spans))
        )
        self.group_cable = np.array(
            [self.span_cable[groups == g][0] for g in range(groups.max() + 1)]
        )
        self._span_group = groups
        # +1 at a span's end, -1 at its start
        self._incidence = np.zeros((len(spans), len(self.points.disk)))
        self._incidence[np.arange(len(spans)), end] = 1.0
        self._incidence[np.arange(len(spans)), start] = -1.0
        self._gather = (groups[None, :] == np.arange(groups.max() + 1)[:, None]).astype(float)

        self._point_arc = self.points.disk * k
        coordinate_arc = np.repeat(np.arange(self.arcs), self.rod.size)
        self._moves = (coordinate_arc[None, :] < self._point_arc[:, None]).astype(float)[:, None, :]
        self._carried = (np.arange(self.arcs)[:, None] < self._point_arc[None, :]).astype(float)
        self.fixed = self.points.disk == 0  # points that do not move
        # The first group of each cable: its base end, where its tension is felt.
        self.base_group = np.array(
            [int(np.argmax(self.group_cable == j)) for j in range(len(finger.cables))]
        )
        self._prepare(())

    def _prepare(self, lead: tuple[int, ...]) -> None:
        self._scale = np.tile(self.coordinate_scale, self.arcs)
        self.largest_scale = float(self._scale.max())
        # of dx = w x x + v, to be filled
        self._lever = np.zeros((*lead, len(self.points.disk), 3, 6))
        for axis in range(3):
            self._lever[..., axis, 3 + axis] = 1.0

    @property
    def likeness(self) -> Hashable:
        """What two fingers have in common that can be stacked."""
        return (
            self.arcs,
            self.rod.order,
            self._point_arc.tobytes(),
            self._incidence.tobytes(),
            self._span_group.tobytes(),
        )

    @staticmethod
    def stacked(fingers: Sequence[Kinematics]) -> Kinematics:
        """Return the kinematics of like fingers, whose arrays have a leading axis.

        Rest shapes, holes and torsional stiffnesses may differ; points' labels are the first's.
        """
        stack = copy(fingers[0])
        stack.rod = Rod(stack.arcs, stack.rod.order, len(fingers))
        stack.z_rest = np.stack([f.z_rest for f in fingers])
        stack.coordinate_scale = np.stack([f.coordinate_scale for f in fingers])
        stack._offset = np.stack([f.points.offset for f in fingers])
        stack._prepare((len(fingers),))
        stack._scale = np.stack([f._scale for f in fingers])
        return stack

    # -- evaluation ------------------------------------------------------------------------

    def place(self, y: np.ndarray) -> Placed:
        """Evaluate the pose at y (N,)."""
        scale = self.coordinate_scale[..., None, :]
        z = self.z_rest + scale * y.reshape(self.z_rest.shape)
        rod = self.rod.state(z)
        # A disk's points lie in its x-y plane.
        frames, offset = rod.rotations[..., self._point_arc, :, :], self._offset
        points = rod.positions[..., self._point_arc, :]
        points += frames[..., 0] * offset[..., 0:1] + frames[..., 1] * offset[..., 1:2]
        vectors = self._incidence @ points
        span_lengths = np.sqrt(np.einsum("...ij,...ij->...i", vectors, vectors))
        spans = vectors / np.maximum(span_lengths, 1e-12)[..., None]
        return Placed(y, z, rod, points, spans, span_lengths, span_lengths @ self._gather.T)

    def linearize(self, at: Placed) -> Linearization:
        """First derivatives of a pose."""
        # One product for all points and coordinates.
        lead, count = at.points.shape[:-2], at.points.shape[-2]
        x, y, z = (at.points[..., axis] for axis in range(3))
        lever = self._lever
        lever[..., 0, 1], lever[..., 0, 2] = z, -y
        lever[..., 1, 0], lever[..., 1, 2] = -z, x
        lever[..., 2, 0], lever[..., 2, 1] = y, -x
        twists = at.rod.twists * self._scale[..., None]
        points = lever.reshape(*lead, -1, 6) @ twists.swapaxes(-1, -2)
        points = points.reshape(*lead, count, 3, self.size)
        points *= self._moves
        spans = self._incidence @ points.reshape(*lead, count, -1)
        spans = spans.reshape(*lead, -1, 3, self.size)
        stretch = (at.spans[..., None, :] @ spans)[..., 0, :]
        return Linearization(twists, points, spans, stretch, self._gather @ stretch)

    def curvature(
        self,
        at: Placed,
        first: Linearization,
        tensions: np.ndarray,
        pushes: np.ndarray | None = None,
    ) -> np.ndarray:
        """Hessian (N, N) of energy + tensions (C,) . lengths - pushes (P, 3) . points.

        The second derivative of a sum of functions of points splits into the functions' own
        curvature on the Jacobians and the points' curvature on the functions' gradients.
        """
        lead = at.points.shape[:-2]
        tension = tensions[..., self._span_group]
        # of all but the energy, with respect to the points
        gradient = self._incidence.T @ (tension[..., None] * at.spans)
        if pushes is not None:
            gradient -= pushes
        scale = np.sqrt(np.maximum(tension, 0.0) / np.maximum(at.span_lengths, 1e-12))
        across = first.spans - at.spans[..., None] * first.stretch[..., None, :]
        across *= scale[..., None, None]
        across = across.reshape(*lead, -1, self.size)
        hessian = across.swapaxes(-1, -2) @ across

        moments = (gradient[..., None] * at.points[..., None, :]).reshape(*lead, -1, 9)
        loads = self._carried @ np.concatenate([gradient, moments], axis=-1)
        hessian += self.rod.curvature_hessian(
            at.z, at.rod, first.twists, self.coordinate_scale, loads
        )
        # the elastic energy, 1/2 y.y
        hessian.reshape(*lead, -1)[..., :: self.size + 1] += 1.0
        return hessian
