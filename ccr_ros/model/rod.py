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

from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

# Terms of the series of B and C below: exact to rounding up to a turn of pi in one arc.
_TERMS = 14


def _series(t: ca.SX, first: int) -> ca.SX:
    """sum_k (-t)^k / (2k + first)!: (1 - cos x)/x^2 for first = 2, (x - sin x)/x^3 for 3; t = x^2.

    A series has no branch at x = 0, where the closed forms and their derivatives are 0/0.
    """
    coefficient = 1.0
    for i in range(2, first + 1):
        coefficient /= i
    coefficients = [coefficient]
    for k in range(1, _TERMS):
        coefficient /= -(2 * k + first - 1) * (2 * k + first)
        coefficients.append(coefficient)
    total = ca.SX(coefficients[-1])
    for c in reversed(coefficients[:-1]):
        total = total * t + c
    return total


def _arc(z: ca.SX, order: int, h: float) -> tuple[ca.SX, ca.SX]:
    """Rotation (3, 3) and translation (3,) along one arc; z = (h a, h b) or (h a)."""
    a = z[:3]
    b = z[3:6] if order else ca.SX.zeros(3)
    e3 = ca.SX([0, 0, 1])
    w = a + ca.cross(a, b) / 6
    v = h * (e3 - ca.cross(b, e3) / 6)
    t = ca.dot(w, w)
    big_b, big_c = _series(t, 2), _series(t, 3)
    k = ca.skew(w)
    rotation = ca.SX.eye(3) + (1 - t * big_c) * k + big_b * (k @ k)
    wv = ca.cross(w, v)
    return rotation, v + big_b * wv + big_c * ca.cross(w, wv)


class _Buffered:
    """A CasADi function called through its C buffers: no conversions, no allocation."""

    def __init__(self, function: ca.Function) -> None:
        self._function = function  # keeps the buffers' owner alive
        self._buffer, self._call = function.buffer()
        self.inputs = [np.zeros(function.nnz_in(i)) for i in range(function.n_in())]
        self.outputs = [np.zeros(function.nnz_out(i)) for i in range(function.n_out())]
        for i, array in enumerate(self.inputs):
            self._buffer.set_arg(i, memoryview(array))
        for i, array in enumerate(self.outputs):
            self._buffer.set_res(i, memoryview(array))

    def __call__(self) -> None:
        self._call()


@lru_cache(maxsize=32)
def _functions(arcs: int, order: int) -> tuple[ca.Function, ca.Function]:
    """The chain of arcs with its twists, and the arcs' contracted second derivatives."""
    size = 3 * (order + 1)
    z, state = ca.SX.sym("z", size), ca.SX.sym("state", 12)
    rotation, translation = _arc(z, order, 1.0 / arcs)
    r0, p0 = ca.reshape(state[:9], 3, 3), state[9:]
    r1, p1 = r0 @ rotation, p0 + r0 @ translation
    turn = ca.reshape(ca.jacobian(ca.vec(rotation), z), 9, size)
    shift = ca.jacobian(translation, z)
    twists = []
    for i in range(size):
        spin = ca.reshape(turn[:, i], 3, 3) @ rotation.T
        omega = r0 @ ca.vertcat(spin[2, 1], spin[0, 2], spin[1, 0])
        twists.append(ca.vertcat(omega, r0 @ shift[:, i] - ca.cross(omega, p1)))
    step = ca.Function(
        "step",
        [state, z],
        [ca.vertcat(ca.vec(r1), p1), ca.densify(ca.horzcat(*twists))],
        {"cse": True},
    )
    force, moment = ca.SX.sym("force", 3), ca.SX.sym("moment", 3, 3)
    work = ca.dot(force, translation) + ca.dot(moment, rotation)
    hessian = ca.densify(ca.hessian(work, z)[0])
    second = ca.Function("second", [z, force, moment], [hessian], {"cse": True})
    return step.mapaccum("chain", arcs), second.map(arcs)


@dataclass(frozen=True, eq=False)
class RodState:
    """The rod at one set of arc coordinates.

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
    """

    def __init__(self, arcs: int, order: int) -> None:
        self.arcs = arcs
        self.order = order
        self.size = 3 * (order + 1)
        chain, second = _functions(arcs, order)
        self._chain, self._second = _Buffered(chain), _Buffered(second)
        self._chain.inputs[0][:] = [1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]
        # arc index of each coordinate: the upper triangle of pairs of coordinates of unlike arcs
        arc = np.repeat(np.arange(arcs), self.size)
        self._earlier = (arc[:, None] < arc[None, :]).astype(float)

    def state(self, z: np.ndarray) -> RodState:
        """Evaluate frames, positions and twists at arc coordinates ``z``."""
        self._chain.inputs[1][:] = z.ravel()
        self._chain()
        states = self._chain.outputs[0].reshape(self.arcs, 12)
        rotations = np.empty((self.arcs + 1, 3, 3))
        positions = np.zeros((self.arcs + 1, 3))
        rotations[0] = np.eye(3)
        rotations[1:] = states[:, :9].reshape(-1, 3, 3).transpose(0, 2, 1)
        positions[1:] = states[:, 9:]
        return RodState(rotations, positions, self._chain.outputs[1].reshape(-1, 6).copy())

    def curvature_hessian(
        self, z: np.ndarray, state: RodState, forces: np.ndarray, moments: np.ndarray
    ) -> np.ndarray:
        """Second derivative (N, N) of sum_k F_k . x_k with the F_k held fixed.

        Args:
            z: Arc coordinates.
            state: Their `RodState`.
            forces: (E, 3) sum of the F_k acting on points beyond each arc's start.
            moments: (E, 3, 3) sum of F_k x_k^T over the same points.

        For coordinates of two arcs e before f, d2x = omega_e x (dx/df), a rotation of everything
        beyond e; for two of the same arc the arc's own second derivatives, contracted.
        """
        omega, velocity = state.twists[:, :3], state.twists[:, 3:]
        total = np.repeat(forces, self.size, axis=0)
        inertia = moments.transpose(0, 2, 1) - np.trace(moments, axis1=1, axis2=2)[:, None, None] * np.eye(3)
        arm = (omega.reshape(self.arcs, self.size, 3) @ inertia.transpose(0, 2, 1)).reshape(-1, 3)
        upper = (omega @ (np.cross(velocity, total) + arm).T) * self._earlier
        hessian = upper + upper.T

        before, after = state.rotations[:-1], state.rotations[1:]
        lever = moments - forces[:, :, None] * state.positions[1:, None, :]
        local = before.transpose(0, 2, 1) @ lever @ after
        self._second.inputs[0][:] = z.ravel()
        self._second.inputs[1][:] = (forces[:, None, :] @ before).ravel()
        self._second.inputs[2][:] = local.transpose(0, 2, 1).ravel()
        self._second()
        blocks = hessian.reshape(self.arcs, self.size, self.arcs, self.size)
        diagonal = np.arange(self.arcs)
        blocks[diagonal, :, diagonal, :] += self._second.outputs[0].reshape(-1, self.size, self.size)
        return hessian


def centerline(state: RodState, z: np.ndarray, points: int) -> np.ndarray:
    """Return a dense backbone curve (arcs * points + 1, 3) of unit length.

    Each arc is cut into ``points`` equal pieces; a piece from the start of an arc of linear
    curvature is an arc of linear curvature again.
    """
    arcs = len(z)
    a, b = z[:, :3], z[:, 3:] if z.shape[1] > 3 else np.zeros((arcs, 3))
    pieces = []
    for k in range(1, points + 1):
        f = k / points
        part_a, part_b = f * (a + (f - 1) * b), f * f * b
        w = part_a + np.cross(part_a, part_b) / 6
        v = f / arcs * (np.array([0.0, 0.0, 1.0]) - np.cross(part_b, [0.0, 0.0, 1.0]) / 6)
        t = np.sum(w * w, axis=1, keepdims=True)
        angle = np.sqrt(t)
        big_b = 0.5 * np.sinc(angle / (2 * np.pi)) ** 2
        big_c = np.where(t < 1e-4, 1 / 6 - t / 120, (1 - np.sinc(angle / np.pi)) / np.maximum(t, 1e-4))
        wv = np.cross(w, v)
        local = v + big_b * wv + big_c * np.cross(w, wv)
        pieces.append(state.positions[:-1] + (state.rotations[:-1] @ local[:, :, None])[:, :, 0])
    return np.concatenate([state.positions[:1], np.stack(pieces, axis=1).reshape(-1, 3)])
