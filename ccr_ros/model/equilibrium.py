# SPDX-License-Identifier: Apache-2.0
"""The equilibrium problem of a finger: least strain energy under cable lengths and obstacles.

In units of the finger's length L and of EI / L for energy, with y the departure from the rest
shape scaled so that the strain energy (the paper's Eq. 1-3) is 1/2 y.y:

    min_y  1/2 y.y   subject to   length of cable c      <=  rest length - pull      (tension T_c)
                                  -signed distance of k  <=  0                       (contact F_k)

The Lagrange multipliers are the tensions and contact forces, times L^2 / EI. This module builds
the problem and evaluates it with exact derivatives; `solver` solves it.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from .errors import InvalidValue
from .finger import Finger
from .obstacles import Obstacle
from .rod import Rod, RodState
from .settings import SolverSettings


@dataclass(frozen=True)
class PointLabel:
    """What a point of the finger is: disk index, kind of point, and the cable it belongs to."""

    disk: int
    point: str
    cable: str


class Points:
    """The backbone, cable and antagonist points of a finger, each once.

    Two cables in opposite holes share their points (one's antagonist is the other's cable point);
    a point is listed once, lest the multipliers of its contact be ambiguous.

    Attributes:
        labels: One per point, ordered by disk.
        disk: (P,) disk index.
        offset: (P, 3) position in the disk's frame, in units of L.
        backbone: (n+1,) indices of the disk centres.
        cable, antagonist: Per cable, (k+1,) indices of its points.
    """

    def __init__(self, finger: Finger) -> None:
        radius = finger.disk_radius / finger.length
        self.labels: list[PointLabel] = []
        offsets: list[np.ndarray] = []
        backbone: list[int] = []
        self.cable: list[list[int]] = [[] for _ in finger.cables]
        self.antagonist: list[list[int]] = [[] for _ in finger.cables]
        for disk in range(finger.segments + 1):
            first = len(offsets)

            def index(label: PointLabel, offset: np.ndarray, first: int = first) -> int:
                for i in range(first, len(offsets)):
                    if np.abs(offsets[i] - offset).max() < 1e-9:
                        return i
                self.labels.append(label)
                offsets.append(offset)
                return len(offsets) - 1

            backbone.append(index(PointLabel(disk, "backbone", ""), np.zeros(3)))
            for kind, sign, table in (
                ("cable", 1, self.cable),
                ("antagonist", -1, self.antagonist),
            ):
                for j, cable in enumerate(finger.cables):
                    if disk <= cable.last_disk:
                        angle = cable.angles[disk]
                        hole = sign * radius * np.array([np.cos(angle), np.sin(angle), 0.0])
                        table[j].append(index(PointLabel(disk, kind, cable.name), hole))
        self.disk = np.array([label.disk for label in self.labels])
        self.offset = np.array(offsets)
        self.backbone = np.array(backbone)


@dataclass(frozen=True, eq=False)
class Evaluation:
    """The problem at one y: the pose and the constraints' values (units of L).

    Attributes:
        y: (N,) scaled departure from the rest shape.
        z: (E, .) arc coordinates.
        rod: The rod's state.
        points: (P, 3) all tracked points.
        spans: (S, 3) unit vectors along the cables' spans.
        span_lengths: (S,).
        lengths: (C,) length of each cable (or of each span, in the proportional model).
        distances: (O, P) signed distance of every point from every obstacle.
    """

    y: np.ndarray
    z: np.ndarray
    rod: RodState
    points: np.ndarray
    spans: np.ndarray
    span_lengths: np.ndarray
    lengths: np.ndarray
    distances: np.ndarray


@dataclass(frozen=True, eq=False)
class Linearization:
    """First derivatives at an `Evaluation`.

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


class EquilibriumProblem:
    """The optimisation problem of one finger, built once and evaluated often."""

    def __init__(self, finger: Finger, settings: SolverSettings | None = None) -> None:
        self.finger = finger
        self.settings = settings or SolverSettings()
        k = self.arcs_per_segment = self.settings.arcs_per_segment * finger.rest_pieces
        order = self.settings.order(finger)
        self.arcs = finger.segments * k
        self.rod = Rod(self.arcs, order)
        h = 1.0 / self.arcs
        stiffness = np.array([1.0, 1.0, finger.torsion_ratio])
        # 1/2 h k (a - rest)^2 + 1/2 (h k / 3) b^2: Legendre polynomials are orthogonal.
        per_arc = np.concatenate([stiffness, stiffness / 3][: order + 1])
        self.coordinate_scale = np.sqrt(h / per_arc)  # z = rest + scale * y
        self.rod_step = h
        self.size = self.arcs * self.rod.size

        self.points = Points(finger)
        spans = [
            (j, pts[i], pts[i + 1])
            for j, pts in enumerate(self.points.cable)
            for i in range(len(pts) - 1)
        ]
        self.span_cable = np.array([s[0] for s in spans])
        start, end = np.array([s[1] for s in spans]), np.array([s[2] for s in spans])
        groups = (
            self.span_cable
            if self.settings.cable_model == "frictionless"
            else np.arange(len(spans))
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
        self._scale = np.tile(self.coordinate_scale, self.arcs)
        self.largest_scale = float(self._scale.max())
        self.fixed = self.points.disk == 0  # points that do not move
        self._lever = np.zeros((len(self.points.disk), 3, 6))  # of dx = w x x + v, to be filled
        self._lever[:, 0, 3] = self._lever[:, 1, 4] = self._lever[:, 2, 5] = 1.0
        # The first group of each cable: its base end, where its tension is felt.
        self.base_group = np.array(
            [int(np.argmax(self.group_cable == j)) for j in range(len(finger.cables))]
        )
        self.obstacles: tuple[Obstacle, ...] = finger.obstacles
        self._start_from(finger)

    def _start_from(self, finger: Finger) -> None:
        """Take the rest shape of ``finger``, from which y and the pulls count."""
        self.finger = finger
        self.z_rest = rest_coordinates(finger, self.arcs_per_segment, self.rod.order)
        self.rest = self.evaluate(np.zeros(self.size))
        self.rest_lengths = np.bincount(
            self.group_cable, self.rest.lengths, minlength=len(finger.cables)
        )
        self._shares = self.rest.lengths / self.rest_lengths[self.group_cable] / finger.length

    def with_rest_curvature(self, rest_curvature: np.ndarray) -> EquilibriumProblem:
        """Return this problem with another rest shape; see `Finger.rest_curvature`.

        All that does not depend on the rest shape is shared, so it costs little; not for use by
        several threads at once.

        Raises:
            InvalidValue: A curvature that no finger can have at rest, or one that is linear along
                more pieces of a segment than the problem's arcs can follow.
        """
        other = copy(self)
        finger = replace(self.finger, rest_curvature=rest_curvature)
        if self.arcs_per_segment % finger.rest_pieces:
            raise InvalidValue(
                "rest_curvature",
                rest_curvature,
                f"linear along pieces that {self.arcs_per_segment} arcs per segment can follow",
            )
        other._start_from(finger)
        return other

    # -- constraint bounds -----------------------------------------------------------------

    def length_bounds(self, pulls: np.ndarray) -> np.ndarray:
        """Upper bounds (C,) of the cable (or span) lengths, in units of L, for pulls (m,) [m]."""
        return self.rest.lengths - self._shares * pulls[self.group_cable]

    # -- evaluation ------------------------------------------------------------------------

    def evaluate(self, y: np.ndarray) -> Evaluation:
        """Evaluate pose and constraints at y (N,)."""
        z = self.z_rest + self.coordinate_scale * y.reshape(self.arcs, -1)
        rod = self.rod.state(z)
        # A disk's points lie in its x-y plane.
        frames, offset = rod.rotations[self._point_arc], self.points.offset
        points = rod.positions[self._point_arc]
        points += frames[:, :, 0] * offset[:, 0:1] + frames[:, :, 1] * offset[:, 1:2]
        vectors = self._incidence @ points
        span_lengths = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
        spans = vectors / np.maximum(span_lengths, 1e-12)[:, None]
        distances = np.empty((len(self.obstacles), len(points)))
        if self.obstacles:
            metres = points * self.finger.length
            for i, obstacle in enumerate(self.obstacles):
                distances[i] = obstacle.signed_distance(metres)
            distances /= self.finger.length
        return Evaluation(
            y, z, rod, points, spans, span_lengths, self._gather @ span_lengths, distances
        )

    def linearize(self, at: Evaluation) -> Linearization:
        """First derivatives at an evaluation."""
        # One product for all points and coordinates.
        x, y, z = at.points.T
        lever = self._lever
        lever[:, 0, 1], lever[:, 0, 2] = z, -y
        lever[:, 1, 0], lever[:, 1, 2] = -z, x
        lever[:, 2, 0], lever[:, 2, 1] = y, -x
        twists = at.rod.twists * self._scale[:, None]
        points = (lever.reshape(-1, 6) @ twists.T).reshape(len(x), 3, self.size)
        points *= self._moves
        spans = (self._incidence @ points.reshape(len(x), -1)).reshape(-1, 3, self.size)
        stretch = (at.spans[:, None, :] @ spans)[:, 0, :]
        return Linearization(twists, points, spans, stretch, self._gather @ stretch)

    def contact_rows(
        self, at: Evaluation, first: Linearization, pairs: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Gradients (c, N) of -distance at (obstacle, point) pairs (c, 2), normals and Hessians."""
        normals, hessians = np.empty((len(pairs), 3)), np.empty((len(pairs), 3, 3))
        for i, obstacle in enumerate(self.obstacles):
            of = pairs[:, 0] == i
            if of.any():
                where = at.points[pairs[of, 1]] * self.finger.length
                normals[of], hessians[of] = obstacle.derivatives(where)
        hessians *= self.finger.length
        rows = -(normals[:, None, :] @ first.points[pairs[:, 1]])[:, 0, :]
        return rows, normals, hessians

    def hessian(
        self,
        at: Evaluation,
        first: Linearization,
        tensions: np.ndarray,
        pairs: np.ndarray,
        normals: np.ndarray,
        curvatures: np.ndarray,
        forces: np.ndarray,
        pushes: np.ndarray | None = None,
    ) -> np.ndarray:
        """Hessian (N, N) of the Lagrangian, for tensions (C,) and contact forces (c,) on pairs.

        ``pushes`` (P, 3) are further forces on the points, which keep their directions: friction.

        The second derivative of a sum of functions of points splits into the functions' own
        curvature on the Jacobians and the points' curvature on the functions' gradients.
        """
        tension = tensions[self._span_group]
        # of the constraints' part of the Lagrangian, with respect to the points
        gradient = self._incidence.T @ (tension[:, None] * at.spans)
        if pushes is not None:
            gradient -= pushes

        scale = np.sqrt(np.maximum(tension, 0.0) / np.maximum(at.span_lengths, 1e-12))
        across = first.spans - at.spans[:, :, None] * first.stretch[:, None, :]
        across *= scale[:, None, None]
        across = across.reshape(-1, self.size)
        hessian = across.T @ across

        pressed = forces > 0
        if len(forces) and pressed.any():
            index, force = pairs[pressed, 1], forces[pressed]
            np.subtract.at(gradient, index, force[:, None] * normals[pressed])
            rows = first.points[index]
            bent = (force[:, None, None] * curvatures[pressed]) @ rows
            hessian -= rows.reshape(-1, self.size).T @ bent.reshape(-1, self.size)

        moments = (gradient[:, :, None] * at.points[:, None, :]).reshape(-1, 9)
        loads = self._carried @ np.concatenate([gradient, moments], axis=1)
        hessian += self.rod.curvature_hessian(
            at.z, at.rod, first.twists, self.coordinate_scale, loads
        )
        hessian.flat[:: self.size + 1] += 1.0  # the elastic energy, 1/2 y.y
        return hessian
