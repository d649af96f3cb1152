# SPDX-License-Identifier: Apache-2.0
"""Kinematics of an inextensible, unshearable rod as a chain of arcs, with exact derivatives.

An arc of length h has curvature u(s) = a + b s in its own frame, s in [-1, 1] (b = 0: constant
curvature). Its rigid increment is the SE(3) exponential of the fourth-order Magnus expansion of
T' = T (e3, u)^, which is exact for b = 0:

    rotation part     w = h a  + h^2/6 (a x b)
    translation part  v = h e3 - h^2/6 (b x e3)

(Magnus 1954; Hairer, Lubich, Wanner, Geometric Numerical Integration, IV.7, with the sign of the
commutator turned because the strain multiplies from the right.) CasADi differentiates one arc;
chaining arcs costs rigid-body algebra alone. Lengths are in units of the rod's length.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from .rotation import cross, skew

_EYE = np.eye(3)
# Terms of the series of the Stumpff functions: right to 1e-10 for half a turn in one arc.
_TERMS = 8


def _stumpff(t: ca.SX, first: int) -> ca.SX:
    """c_k(t) = sum_j (-t)^j / (2j + k)! for k = first: no branch, no 0/0 at t = 0."""
    coefficients = [(-1.0) ** j / math.factorial(2 * j + first) for j in range(_TERMS)]
    total = ca.SX(coefficients[-1])
    for c in reversed(coefficients[:-1]):
        total = total * t + c
    return total


def _arms() -> np.ndarray:
    """The linear map (12, 18) from F and M to the matrix (6, 3) that twists are multiplied by.

    A row (w, v) times it is M' w - tr(M) w + v x F; see `Rod.curvature_hessian`.
    """
    columns = []
    for unit in np.eye(12):
        force, moment = unit[:3], unit[3:].reshape(3, 3)
        columns.append(np.vstack([moment - np.trace(moment) * _EYE, skew(force)]).ravel())
    return np.array(columns)


_ARMS = _arms()


class Arc:
    """Rotation and translation along one arc as functions of z = (h a, h b) or (h a).

    All is written in x = (w, v) of the Magnus expansion, in which derivatives are short, and taken
    to z at the end (`in_z`). The exponential needs B = c_2(t) = (1 - cos)/t and C = c_3(t) =
    (1 - sin/sqrt t)/t with t = |w|^2. Differentiating their series would cost most of all;
    instead they stand as quadratics about t0 = t, whose coefficients c_k' = (k c_{k+2} -
    c_{k+1}) / 2 are put in after differentiating.
    """

    def __init__(self, order: int, h: float) -> None:
        self.z = ca.SX.sym("z", 3 * (order + 1))
        a = self.z[:3]
        b = self.z[3:6] if order else ca.SX.zeros(3)
        e3 = ca.SX([0, 0, 1])
        self.x = ca.SX.sym("x", 6)
        self.x_of_z = ca.vertcat(a + ca.cross(a, b) / 6, h * (e3 - ca.cross(b, e3) / 6))
        self.jacobian = ca.jacobian(self.x_of_z, self.z)
        self._symbols = ca.SX.sym("c", 7)  # t0, then B, C and their derivatives
        t0, b0, c0, b1, c1, b2, c2 = ca.vertsplit(self._symbols)
        self.w, self.v = self.x[:3], self.x[3:]
        self.t = ca.dot(self.w, self.w)
        step = self.t - t0
        self.big_b = b0 + b1 * step + b2 * step**2 / 2
        self.big_c = c0 + c1 * step + c2 * step**2 / 2
        k = ca.skew(self.w)
        self.left_jacobian = ca.SX.eye(3) + self.big_b * k + self.big_c * (k @ k)
        self.rotation = ca.SX.eye(3) + (1 - self.t * self.big_c) * k + self.big_b * (k @ k)
        self.translation = self.left_jacobian @ self.v

    def work(self, force: ca.SX, moment: ca.SX) -> ca.SX:
        """force . translation + moment : rotation, in the fewest operations."""
        w, v, t = self.w, self.v, self.t
        axial = ca.vertcat(
            moment[2, 1] - moment[1, 2], moment[0, 2] - moment[2, 0], moment[1, 0] - moment[0, 1]
        )
        trace = ca.trace(moment)
        turned = (1 - t * self.big_c) * ca.dot(axial, w) + self.big_b * (
            ca.dot(w, moment @ w) - t * trace
        )
        bent = self.big_b * ca.dot(w, ca.cross(v, force))
        bent += self.big_c * (ca.dot(force, w) * ca.dot(w, v) - ca.dot(force, v) * t)
        return trace + turned + ca.dot(force, v) + bent

    def hessian_in_z(self, scalar: ca.SX) -> ca.SX:
        """Hessian with respect to z of a scalar function of x."""
        hessian, gradient = ca.hessian(scalar, self.x)
        slope = ca.SX.sym("slope", 3)  # x is bilinear in z, in its first three rows alone
        bilinear = ca.hessian(ca.dot(slope, self.x_of_z[:3]), self.z)[0]
        bilinear = ca.substitute(bilinear, slope, gradient[:3])
        return self.jacobian.T @ hessian @ self.jacobian + bilinear

    def in_z(self, expression: ca.SX) -> ca.SX:
        """The expression in z alone: values put in for B, C, their derivatives and x."""
        t = self.t
        c6, c7 = _stumpff(t, 6), _stumpff(t, 7)
        c4, c5 = 1 / 24 - t * c6, 1 / 120 - t * c7
        c2, c3 = 1 / 2 - t * c4, 1 / 6 - t * c5
        first = (2 * c4 - c3) / 2, (3 * c5 - c4) / 2
        d4, d5 = (4 * c6 - c5) / 2, (5 * c7 - c6) / 2
        second = (2 * d4 - first[1]) / 2, (3 * d5 - d4) / 2
        values = ca.vertcat(t, c2, c3, *first, *second)
        expression = ca.substitute(expression, self._symbols, values)
        return ca.cse(ca.substitute(expression, self.x, self.x_of_z))


class Buffered:
    """A CasADi function called through its C buffers: no conversions, no allocation."""

    def __init__(self, function: ca.Function) -> None:
        self._function = function  # keeps the buffers' owner alive
        self._buffer, self._call = function.buffer()
        self.inputs = [np.zeros(function.nnz_in(i)) for i in range(function.n_in())]
        self.outputs = [np.zeros(function.nnz_out(i)) for i in range(function.n_out())]
        for i, array in enumerate(self.inputs):
            self._buffer.set_arg(i, memoryview(array))  # type: ignore[call-arg, arg-type]
        for i, array in enumerate(self.outputs):
            self._buffer.set_res(i, memoryview(array))  # type: ignore[call-arg, arg-type]

    def __call__(self) -> None:
        self._call()


@lru_cache(maxsize=32)
def _functions(arcs: int, order: int, rods: int) -> tuple[ca.Function, ca.Function]:
    """The chains of arcs with their twists, and the arcs' contracted second derivatives."""
    arc, state = Arc(order, 1.0 / arcs), ca.SX.sym("state", 12)
    z = arc.z
    r0, p0 = ca.reshape(state[:9], 3, 3), state[9:]
    # The rotation's derivative is the angular velocity J dw, in the frame of the arc's start.
    spin = r0 @ (arc.left_jacobian @ arc.jacobian[:3, :])
    shift = r0 @ (ca.jacobian(arc.translation, arc.x) @ arc.jacobian)
    p1 = p0 + r0 @ arc.translation
    twists = [
        ca.vertcat(spin[:, i], shift[:, i] - ca.cross(spin[:, i], p1)) for i in range(z.numel())
    ]
    both = arc.in_z(ca.vertcat(ca.vec(r0 @ arc.rotation), p1, *twists))
    step = ca.Function("step", [state, z], [both[:12], ca.reshape(both[12:], 6, z.numel())])
    force, moment = ca.SX.sym("force", 3), ca.SX.sym("moment", 3, 3)
    hessian = ca.densify(arc.in_z(arc.hessian_in_z(arc.work(force, moment))))
    second = ca.Function("second", [z, force, moment], [hessian])
    chain = step.mapaccum("chain", arcs)
    return chain if rods == 1 else chain.map(rods), second.map(rods * arcs)


@dataclass(frozen=True, eq=False)
class RodState:
    """The rod at one set of arc coordinates; of several rods, all arrays have a leading axis.

    Attributes:
        rotations: (E+1, 3, 3) frame at each arc's ends, base first; columns are the axes.
        positions: (E+1, 3) position of each arc's ends.
        twists: (N, 6) spatial twist of everything beyond the arc, per arc coordinate:
            angular part, then the velocity at the origin, so that dx = twist[3:] + twist[:3] x x.
    """

    rotations: np.ndarray
    positions: np.ndarray
    twists: np.ndarray


class Rod:
    """A chain of ``arcs`` equal arcs, of unit total length, clamped at the origin along +z.

    Arc coordinates ``z`` (arcs, 3 (order + 1)) are h a (and h b) of each arc [rad].

    Args:
        arcs: How many.
        order: Of their curvature.
        rods: Evaluate so many like rods at once: all arrays then have a leading axis; None: one.
    """

    def __init__(self, arcs: int, order: int, rods: int | None = None) -> None:
        self.arcs = arcs
        self.order = order
        self.size = 3 * (order + 1)
        self._lead = () if rods is None else (rods,)
        chain, second = _functions(arcs, order, rods or 1)
        self._chain, self._second = Buffered(chain), Buffered(second)
        start = self._chain.inputs[0].reshape(-1, 12)
        start[:, [0, 4, 8]] = 1.0
        # arc index of each coordinate: the upper triangle of pairs of coordinates of unlike arcs
        arc = np.repeat(np.arange(arcs), self.size)
        self._earlier = (arc[:, None] < arc[None, :]).astype(float)

    def state(self, z: np.ndarray) -> RodState:
        """Evaluate frames, positions and twists at arc coordinates ``z``."""
        lead, arcs = self._lead, self.arcs
        self._chain.inputs[1][:] = z.ravel()
        self._chain()
        states = self._chain.outputs[0].reshape(*lead, arcs, 12)
        rotations = np.empty((*lead, arcs + 1, 3, 3))
        positions = np.zeros((*lead, arcs + 1, 3))
        rotations[..., 0, :, :] = _EYE
        rotations[..., 1:, :, :] = states[..., :9].reshape(*lead, arcs, 3, 3).swapaxes(-1, -2)
        positions[..., 1:, :] = states[..., 9:]
        return RodState(rotations, positions, self._chain.outputs[1].reshape(*lead, -1, 6).copy())

    def curvature_hessian(
        self,
        z: np.ndarray,
        state: RodState,
        scaled: np.ndarray,
        scale: np.ndarray,
        loads: np.ndarray,
    ) -> np.ndarray:
        """Second derivative (N, N) of sum_k F_k . x_k in scaled coordinates, the F_k held fixed.

        Args:
            z: Arc coordinates.
            state: Their `RodState`.
            scaled: (N, 6) its twists, per scaled coordinate.
            scale: (size,) what an arc's scaled coordinates are multiplied by to give z.
            loads: (E, 12) sums of F_k, and of F_k x_k^T, over the points beyond each arc's start.

        For coordinates of two arcs e before f, d2x = omega_e x (dx/df), a rotation of everything
        beyond e, contracted to omega_e . (v_f x F + (M' - tr M) omega_f), M = sum F x^T; for two
        of the same arc the arc's own second derivatives, contracted.
        """
        lead, arcs, size = self._lead, self.arcs, self.size
        arms = (loads @ _ARMS).reshape(*lead, arcs, 6, 3)
        arm = (scaled.reshape(*lead, arcs, size, 6) @ arms).reshape(*lead, -1, 3)
        hessian = scaled[..., :3] @ arm.swapaxes(-1, -2)
        hessian *= self._earlier
        hessian += hessian.swapaxes(-1, -2).copy()

        force, moment = loads[..., None, :3], loads[..., 3:].reshape(*lead, arcs, 3, 3)
        before = state.rotations[..., :-1, :, :]
        lever = moment - loads[..., :3, None] * state.positions[..., 1:, None, :]
        local = before.swapaxes(-1, -2) @ lever @ state.rotations[..., 1:, :, :]
        self._second.inputs[0][:] = z.ravel()
        self._second.inputs[1][:] = (force @ before).ravel()
        self._second.inputs[2][:] = local.swapaxes(-1, -2).ravel()
        self._second()
        blocks = self._second.outputs[0].reshape(*lead, arcs, size, size)
        # The arcs' own blocks, as a view.
        own = np.einsum("...eaeb->...eab", hessian.reshape(*lead, arcs, size, arcs, size))
        own += blocks * (scale[..., None, :, None] * scale[..., None, None, :])
        return hessian


def centerline(curvature: np.ndarray, length: float, points: int) -> np.ndarray:
    """Return a dense backbone curve (E * points + 1, 3) from its curvature, in units of ``length``.

    Integrated in numpy on its own, without the chain above. A piece from the start of an arc of
    linear curvature is an arc of linear curvature again.

    Args:
        curvature: (E, order + 1, 3) curvature coefficients of each arc [1/unit of length].
        length: Length of the whole rod.
        points: Points per arc.
    """
    arcs, order = len(curvature), curvature.shape[1] - 1
    h = length / arcs
    f = np.arange(1, points + 1)[None, :, None] / points
    a = h * curvature[:, None, 0]
    b = h * curvature[:, None, 1] if order else np.zeros_like(a)
    part_a, part_b = f * (a + (f - 1) * b), f * f * b
    e3 = np.array([0.0, 0.0, 1.0])
    w = part_a + cross(part_a, part_b) / 6
    v = f * h * (e3 - cross(part_b, e3) / 6)
    angle = np.linalg.norm(w, axis=2, keepdims=True)
    square = np.maximum(angle, 1e-3) ** 2
    sine = np.sinc(angle / np.pi)
    big_b = 0.5 * np.sinc(angle / (2 * np.pi)) ** 2
    big_c = np.where(angle < 1e-3, 1 / 6 - angle**2 / 120, (1 - sine) / square)
    wv = cross(w, v)
    shifts = v + big_b * wv + big_c * cross(w, wv)
    k = skew(w[:, -1])
    turns = np.eye(3) + sine[:, -1, :, None] * k + big_b[:, -1, :, None] * (k @ k)
    curve = np.zeros((arcs * points + 1, 3))
    frame = np.eye(3)
    for e in range(arcs):
        first = e * points
        curve[first + 1 : first + points + 1] = curve[first] + shifts[e] @ frame.T
        frame = frame @ turns[e]
    return curve
