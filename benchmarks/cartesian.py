# SPDX-License-Identifier: Apache-2.0
"""The literature's formulation: Eq. 3-6 of Mahapatra & Ghosal (Robotica, 2024), Cartesian.

Unknown are the disk centres x0^i and the cable points xa^i, i = 1..n (Eq. 4); segment lengths, disk
radius, perpendicular disks and cable lengths are constraints (Eq. 5 and section 2.2.2), obstacles
inequalities (Eq. 6). Every derivative is exact: CasADi generates it, for every solver alike.

Inside, lengths are in units of the segment length l0 and energy in units of EI / l0, so that
unknowns, constraints and multipliers are near one, which all the solvers like.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

import casadi as ca
import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import expm

from ccr_ros.model import Cylinder, Finger, Obstacle, Sphere

# asin(s) / s = sum of c_k s^(2k); below the threshold (of s^2) the series is exact to rounding.
_SERIES = (1.0, 1 / 6, 3 / 40, 15 / 336, 105 / 3456, 945 / 42240, 10395 / 599040)
_SERIES_BELOW = 1e-2


Matrix: TypeAlias = Any  # ca.SX of unknowns, or ca.DM of numbers: the same code serves both


@dataclass(frozen=True)
class Formulation:
    """Which reading of the paper's equations.

    Attributes:
        angles: ``"relative"``: rotation of disk i relative to disk i - 1, measured against the
            rest shape, which is what Eq. 1-3 mean; ``"literal"``: change of each absolute tangent
            and normal since the last iterate, which is what Eq. 4 says.
        tangents: ``"spline"``: of the C2 cubic spline through the disk centres (section 3.1);
            ``"chord"``: along x0^i - x0^(i-1) (section 2.1).
        cable_model: ``"proportional"``: every span's length l_a^i is given (Eq. 5, section 2.2.2);
            ``"frictionless"``: only their sum is.
    """

    angles: str = "relative"
    tangents: str = "spline"
    cable_model: str = "proportional"


LITERAL = Formulation(angles="literal", tangents="chord")


class CartesianProblem:
    """Minimise f(w, p) subject to g(w, p) = 0 and h(w, p) >= 0.

    w (6n,) stacks x0^1, xa^1, x0^2, ... in units of l0; p is the pull fraction, followed, for
    literal angles, by the last iterate (6n,).

    Tangents are linear in w before they are normalised. So every function is one of y = A w + b,
    which stacks x0, arms xa - x0 and raw tangents disk by disk; in y it is local, and its
    derivatives in w follow from those in y by A: the same numbers, at a fraction of the cost.

    Attributes:
        finger: The finger.
        formulation: Which reading of the equations.
        rest: (6n,) unknowns of the rest shape.
        equalities, inequalities: Number of rows of g and of h.
        objective: CasADi function (w, p) -> f, gradient.
        g, h: (w, p) -> values, Jacobian.
        f_hessian: (w, p) -> Hessian of f.
        g_hessian, h_hessian: (w, p, v) -> Hessian of v . g, of v . h.
        lagrangian_hessian: (w, p, s, v) -> Hessian of s f + v . (g, h).
    """

    def __init__(self, finger: Finger, formulation: Formulation | None = None) -> None:
        if len(finger.cables) != 1 or finger.cables[0].last_disk != finger.segments:
            raise ValueError(f"{finger.name}: the paper's formulation has one cable, base to tip")
        self.finger = finger
        self.formulation = formulation or Formulation()
        self._radius = finger.disk_radius / finger.segment_length
        self._angles = finger.cables[0].angles
        self._map, self._offset = self._linear_map()
        self.rest = self._rest_unknowns()
        self._build()

    def _build(self) -> None:
        n = self.finger.segments
        w, y = ca.MX.sym("w", 6 * n), ca.SX.sym("y", 9 * n)
        pull = ca.SX.sym("pull")
        last = ca.SX.sym("last", 6 * n if self.formulation.angles == "literal" else 0)
        p, p_of_w = ca.vertcat(pull, last), ca.MX.sym("p", 1 + last.numel())
        f, g, h = self._energy(y, last), self._equalities(y, pull), self._distances(y)
        at = ca.mtimes(self._map, w) + self._offset

        def values(expression: ca.SX) -> ca.Function:
            # Two functions, so that a solver that asks for values alone pays for them alone.
            value = ca.Function("local", [y, p], [expression])(at, p_of_w)
            jacobian = ca.Function("local", [y, p], [ca.jacobian(expression, y)])(at, p_of_w)
            return ca.Function("values", [w, p_of_w], [value, ca.mtimes(jacobian, self._map)])

        def hessian(weighted: ca.SX, *weights: ca.SX) -> ca.Function:
            local = ca.Function("local", [y, p, *weights], [ca.hessian(weighted, y)[0]])
            arguments = [ca.MX.sym("v", v.numel()) for v in weights]
            inner = local(at, p_of_w, *arguments)
            outer = ca.mtimes([self._map.T, inner, self._map])
            return ca.Function("hessian", [w, p_of_w, *arguments], [outer])

        self.equalities, self.inequalities = g.numel(), h.numel()
        self.objective, self.g, self.h = values(f), values(g), values(h)
        scale, v_g, v_h = (ca.SX.sym("v", size) for size in (1, g.numel(), h.numel()))
        self.f_hessian = hessian(f)
        self.g_hessian, self.h_hessian = hessian(ca.dot(v_g, g), v_g), hessian(ca.dot(v_h, h), v_h)
        v = ca.SX.sym("v", g.numel() + h.numel())
        self.lagrangian_hessian = hessian(scale * f + ca.dot(v, ca.vertcat(g, h)), scale, v)

    def parameters(self, pull: float, last: np.ndarray) -> np.ndarray:
        """Return p for a pull (a fraction of the cable's rest length), given the last iterate."""
        return (
            np.concatenate([[pull], last])
            if self.formulation.angles == "literal"
            else np.array([pull])
        )

    def backbone(self, w: np.ndarray) -> np.ndarray:
        """Return the disk centres (n+1, 3) [m] of unknowns (6n,)."""
        x0 = np.asarray(w).reshape(-1, 6)[:, :3]
        return np.vstack([np.zeros(3), x0]) * self.finger.segment_length

    def _linear_map(self) -> tuple[ca.DM, ca.DM]:
        """Return A (9n, 6n) and b (9n,) of y = A w + b: x0, arm, raw tangent of disks 1..n."""
        n = self.finger.segments
        # Raw tangents from (base tangent, x0^0, ..., x0^n), of which the first two are given.
        if self.formulation.tangents == "spline":
            weights = _spline_weights(n)
        else:
            weights = np.eye(n, n + 2, 2) - np.eye(n, n + 2, 1)
        a, b = np.zeros((n, 9, n, 6)), np.zeros((n, 9))
        arm = np.eye(6) - np.eye(6, 6, -3)
        a[:, :6] = np.einsum("ij,kl->ikjl", np.eye(n), arm)
        a[:, 6:, :, :3] = np.einsum("ij,kl->ikjl", weights[:, 2:], np.eye(3))
        b[:, 8] = weights[:, 0]
        return ca.sparsify(ca.DM(a.reshape(9 * n, 6 * n))), ca.DM(b.ravel())

    def _centres(self, y: Matrix) -> Matrix:
        """Return x0 (3, n+1), the base's included."""
        return ca.horzcat(ca.DM.zeros(3), _columns(y)[:3, :])

    def _arms(self, y: Matrix) -> Matrix:
        """Return xa - x0 (3, n+1), the base's included."""
        angle = self._angles[0]
        hole = self._radius * np.array([np.cos(angle), np.sin(angle), 0.0])
        return ca.horzcat(ca.DM(hole), _columns(y)[3:6, :])

    def _tangents(self, y: Matrix) -> Matrix:
        """Return unit tangents (3, n+1) at the disks; at the base it is z."""
        raw = _columns(y)[6:, :]
        return ca.horzcat(ca.DM([0, 0, 1]), _scaled(raw, 1 / _norms(raw)))

    def _lifted(self, w: Matrix) -> Matrix:
        return ca.mtimes(self._map, w) + self._offset

    def _turns(self, y: Matrix) -> Matrix:
        """Rotation vectors (3, n) of disk i relative to i - 1, in the material frame of i - 1."""
        arms, ez = self._arms(y), self._tangents(y)
        out = _scaled(arms, 1 / _norms(arms))
        side = _cross(ez, out)
        # The material frame does not follow the cable from hole to hole: turn back by its angle.
        c, s = ca.DM(np.cos(self._angles)).T, ca.DM(np.sin(self._angles)).T
        ex, ey = _scaled(out, c) - _scaled(side, s), _scaled(out, s) + _scaled(side, c)

        def dot(a: ca.SX, b: ca.SX) -> ca.SX:  # of axis a of disk i - 1 and axis b of disk i
            return ca.sum1(a[:, :-1] * b[:, 1:])

        # The axial vector of the relative rotation is its axis times the sine of its angle.
        axial = ca.vertcat(
            dot(ez, ey) - dot(ey, ez), dot(ex, ez) - dot(ez, ex), dot(ey, ex) - dot(ex, ey)
        )
        return _scaled(axial / 2, _asin_over(ca.sum1(axial**2) / 4))

    def _energy(self, y: ca.SX, last: ca.SX) -> ca.SX:
        """Eq. 3: sum of (dtheta_i^2 + D dphi_i^2) / 2, with the angles of the formulation."""
        ratio = self.finger.torsion_ratio
        if self.formulation.angles == "relative":
            strain = self._turns(y) - self._turns(self._lifted(ca.DM(self.rest)))
            return ca.sumsqr(strain[:2, :]) / 2 + ratio * ca.sumsqr(strain[2, :]) / 2
        old = self._lifted(last)
        bend = _squared_angles(self._tangents(y), self._tangents(old))
        twist = _squared_angles(self._arms(y) / self._radius, self._arms(old) / self._radius)
        return (bend + ratio * twist) / 2

    def _equalities(self, y: ca.SX, pull: ca.SX) -> ca.SX:
        """Eq. 5 and section 2.2.2's perpendicular disks, as residuals that vanish.

        A segment's length is that of its rest chord: l0 for a straight finger, and what the given
        X0 of section 2.3 has for a pre-bent one.
        """
        rest = self._lifted(ca.DM(self.rest))
        arms = self._arms(y)

        def lengths(points: Matrix) -> Matrix:
            return _norms(points[:, 1:] - points[:, :-1])

        chords = lengths(self._centres(y)) - lengths(self._centres(rest))
        radii = _norms(arms[:, 1:]) - self._radius
        upright = ca.sum1(self._tangents(y)[:, 1:] * arms[:, 1:])
        rest_spans = lengths(self._centres(rest) + self._arms(rest))
        spans = lengths(self._centres(y) + arms) - (1 - pull) * rest_spans
        if self.formulation.cable_model == "frictionless":
            spans = ca.sum2(spans)
        return ca.horzcat(chords, radii, upright, spans).T

    def _distances(self, y: ca.SX) -> ca.SX:
        """Eq. 6: distances to every obstacle of x0, xa and xb = 2 x0 - xa, i = 1..n."""
        x0, arms = self._centres(y)[:, 1:], self._arms(y)[:, 1:]
        unit = self.finger.segment_length
        rows = [
            _distance(obstacle, points * unit) / unit
            for obstacle in self.finger.obstacles
            for points in (x0, x0 + arms, x0 - arms)
        ]
        return ca.horzcat(*rows).T if rows else ca.SX(0, 1)

    def _rest_unknowns(self) -> np.ndarray:
        """The rest shape: constant-curvature segments, holes perpendicular to the tangents used."""
        if self.finger.rest_varies:
            raise ValueError("the baseline takes a rest curvature that is constant per segment")
        pose, centres, holes = np.eye(4), [np.zeros(3)], [np.zeros(3)]
        rest_curvature = np.asarray(self.finger.rest_curvature)
        for curvature, angle in zip(rest_curvature, self._angles[1:], strict=True):
            twist = np.zeros((4, 4))
            twist[:3, :3] = np.cross(np.eye(3), curvature * self.finger.segment_length)
            twist[2, 3] = 1.0
            pose = pose @ expm(twist)
            centres.append(pose[:3, 3])
            holes.append(pose[:3, :3] @ [np.cos(angle), np.sin(angle), 0.0])
        x0, arms = np.array(centres), np.array(holes)
        centres_only = np.hstack([x0[1:], np.zeros_like(x0[1:])]).ravel()
        tangents = self._tangents(self._lifted(ca.DM(centres_only))).full().T
        arms -= np.sum(arms * tangents, axis=1, keepdims=True) * tangents
        arms = arms[1:] * self._radius / np.linalg.norm(arms[1:], axis=1, keepdims=True)
        return np.hstack([x0[1:], x0[1:] + arms]).ravel()


def _spline_weights(n: int) -> np.ndarray:
    """Weights (n, n+2) that take (base tangent, x0^0, ..., x0^n) to the spline's tangents at 1..n.

    The spline is clamped at the base and not-a-knot at the tip, where a cable's moment acts.
    """
    weights = np.empty((n, n + 2))
    for column, unit in enumerate(np.eye(n + 2)):
        end = "not-a-knot" if n > 2 else (2, 0.0)
        spline = CubicSpline(np.arange(n + 1.0), unit[1:], bc_type=((1, unit[0]), end))
        weights[:, column] = spline(np.arange(1.0, n + 1), 1)
    weights[np.abs(weights) < 1e-12] = 0.0  # they fall by 0.27 per disk
    return weights


def _columns(y: Matrix) -> Matrix:
    """One column (9,) per disk 1..n: x0, arm, raw tangent."""
    columns: Matrix = ca.reshape(y, 9, y.numel() // 9)
    return columns


def _norms(columns: Matrix) -> Matrix:
    return ca.sqrt(ca.sum1(columns**2))


def _scaled(columns: Matrix, factors: Matrix) -> Matrix:
    return columns * ca.repmat(factors, 3, 1)


def _cross(a: Matrix, b: Matrix) -> Matrix:
    return ca.vertcat(
        a[1, :] * b[2, :] - a[2, :] * b[1, :],
        a[2, :] * b[0, :] - a[0, :] * b[2, :],
        a[0, :] * b[1, :] - a[1, :] * b[0, :],
    )


def _asin_over(squared: Matrix) -> Matrix:
    """asin(s) / s of s^2, smooth at 0, where arccos of Eq. 4 has no derivative."""
    small = squared < _SERIES_BELOW
    # The bound keeps a solver's wild trial points, turned past 88 degrees, from being NaN.
    s = ca.sqrt(ca.if_else(small, _SERIES_BELOW, ca.fmin(squared, 0.999)))
    series = sum(c * squared**k for k, c in enumerate(_SERIES))
    return ca.if_else(small, series, ca.asin(s) / s)


def _squared_angles(a: ca.SX, b: ca.SX) -> ca.SX:
    """Sum over columns 1.. of the squared angles between unit vectors, from their chord."""
    half = ca.sum1((a - b)[:, 1:] ** 2) / 4
    return ca.sum2(4 * half * _asin_over(half) ** 2)


def _distance(obstacle: Obstacle, points: ca.SX) -> ca.SX:
    """Signed distance (1, P) [m] of points (3, P)."""
    if isinstance(obstacle, Sphere):
        return (
            _norms(points - ca.repmat(ca.DM(obstacle.center), 1, points.size2())) - obstacle.radius
        )
    if isinstance(obstacle, Cylinder):
        across = np.eye(3) - np.outer(obstacle.axis, obstacle.axis)
        offset = ca.mtimes(
            ca.DM(across), points - ca.repmat(ca.DM(obstacle.point), 1, points.size2())
        )
        return _norms(offset) - obstacle.radius
    raise TypeError(f"obstacle {obstacle.name!r}: must be a sphere or a cylinder")
