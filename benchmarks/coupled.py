# SPDX-License-Identifier: Apache-2.0
"""Fingers and a ball without friction as one problem for IPOPT, as one would state it in CasADi.

The unknowns are those of this project's solver: the arcs' scaled coordinates y_f of each finger,
and the ball's centre p; so both solve the same equations, and their poses agree.

    min  sum_f 1/2 y_f.y_f - W.p    s.t.  cable lengths <= bounds,  |x_k(y_f) - p| >= radius

IPOPT is warm-started from the last pose with its multipliers, and gets exact first and second
derivatives by CasADi, of one finger at a time: the problem's structure is used.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np

from ccr_ros.grasp.statics import GraspSolver
from ccr_ros.model import Sphere
from ccr_ros.model.equilibrium import EquilibriumProblem
from ccr_ros.model.rod import Arc

_OPTIONS: dict[str, Any] = {
    "print_time": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.max_iter": 200,
    "ipopt.tol": 1e-9,
    "ipopt.warm_start_init_point": "yes",
    "ipopt.mu_init": 1e-6,
    "ipopt.warm_start_bound_push": 1e-8,
    "ipopt.warm_start_slack_bound_push": 1e-8,
    "ipopt.warm_start_mult_bound_push": 1e-8,
}


def finger_constraints(problem: EquilibriumProblem) -> tuple[ca.Function, ca.Function]:
    """Return a finger's constraints with their Jacobian, and their weighted sum's Hessian.

    Constraints are cable lengths, then distances of all points that move from a place c; functions
    are of (y, c), and of multipliers; in units of the finger's length, in its base frame.
    """
    arc, before = Arc(problem.rod.order, problem.rod_step), ca.SX.sym("before", 12)
    turn, place = ca.reshape(before[:9], 3, 3), before[9:]
    after = ca.vertcat(ca.vec(turn @ arc.rotation), place + turn @ arc.translation)
    step = ca.Function("step", [before, arc.z], [arc.in_z(after)])

    y, c = ca.SX.sym("y", problem.size), ca.SX.sym("c", 3)
    scale = np.tile(problem.coordinate_scale, problem.arcs)
    z = ca.reshape(problem.z_rest.ravel() + scale * y, -1, problem.arcs)
    states = [ca.SX(np.append(np.eye(3).ravel(), np.zeros(3)))]
    for arc_index in range(problem.arcs):
        states.append(step(states[-1], z[:, arc_index]))
    points = []
    for disk, offset in zip(problem.points.disk, problem.points.offset, strict=True):
        state = states[disk * problem.arcs_per_segment]
        points.append(state[9:] + ca.reshape(state[:9], 3, 3) @ offset)

    def distance(a: ca.SX, b: ca.SX) -> ca.SX:
        return ca.sqrt(ca.sumsqr(a - b))

    values = [
        sum(distance(points[i], points[j]) for i, j in pairwise(cable))
        for cable in problem.points.cable
    ]
    values += [distance(points[i], c) for i in np.flatnonzero(~problem.fixed)]
    unknown, constraint = ca.vertcat(y, c), ca.vertcat(*values)
    multipliers = ca.SX.sym("multipliers", constraint.numel())
    hessian = ca.hessian(ca.dot(multipliers, constraint), unknown)[0]
    return (
        ca.Function("first", [unknown], [constraint, ca.jacobian(constraint, unknown)]),
        ca.Function("second", [unknown, multipliers], [hessian]),
    )


class CoupledIpopt:
    """IPOPT on a grasp, from where a solver stands.

    Args:
        solver: It holds a ball without friction; its fingers are alike.

    Raises:
        ValueError: The object is no ball, or has friction, or the fingers are not alike.
    """

    def __init__(self, solver: GraspSolver) -> None:
        shape, hand = solver.body.shape, solver.hand
        if not isinstance(shape, Sphere) or solver.body.friction > 0 or solver.point is None:
            raise ValueError("stated for a ball that is held without friction")
        first = hand.problems[0]
        alike = all(np.array_equal(p.z_rest, first.z_rest) for p in hand.problems)
        if not alike or not np.allclose(hand.weights, 1.0):
            raise ValueError("stated for fingers that are alike")
        self._problems, self.length = hand.problems, hand.length
        self._radius = shape.radius / hand.length
        self._bases = [m.base for m in hand.mounted]
        load = solver.body.mass * solver.gravity * hand.length / hand.energy
        self._solver = self._built(finger_constraints(first), load)
        at = solver.point
        self._x = np.concatenate(
            [*(part.point.at.y for part in at.blocks), at.pose.position / hand.length]
        )
        self._multipliers = np.concatenate([self._start(part.point) for part in at.blocks])

    def _start(self, point: Any) -> np.ndarray:
        moving = ~self._problems[0].fixed
        return np.concatenate([point.tensions, -point.forces[-1, moving]])

    def _built(self, functions: tuple[ca.Function, ca.Function], load: np.ndarray) -> ca.Function:
        first, second = functions
        size, count = self._problems[0].size, len(self._problems)
        x, scale = ca.MX.sym("x", count * size + 3), ca.MX.sym("scale")
        rows = first.size1_out(0)
        multipliers, none = ca.MX.sym("multipliers", count * rows), ca.MX.sym("p", 0)
        values, jacobian, hessian = [], [], ca.MX(x.numel(), x.numel())
        diagonal = ca.DM(np.append(np.ones(count * size), np.zeros(3)))
        hessian += scale * ca.diag(diagonal)
        for index, base in enumerate(self._bases):
            # The ball's centre in the finger's base frame is linear in x.
            into = np.zeros((size + 3, x.numel()))
            into[:size, index * size : (index + 1) * size] = np.eye(size)
            into[size:, -3:] = base.rotation.T
            chosen = ca.sparsify(ca.DM(into))
            shift = np.append(np.zeros(size), -(base.position / self.length) @ base.rotation)
            own = chosen @ x + shift
            value, slope = first(own)
            values.append(value)
            jacobian.append(slope @ chosen)
            part = multipliers[index * rows : (index + 1) * rows]
            hessian += chosen.T @ second(own, part) @ chosen
        objective = 0.5 * ca.sumsqr(x[:-3]) - ca.dot(ca.DM(load), x[-3:])
        constraint, names = ca.vertcat(*values), ["x", "p", "lam_f", "lam_g"]
        given = {
            "grad_f": ca.Function(
                "nlp_grad_f", [x, none], [objective, ca.gradient(objective, x)],
                names[:2], ["f", "grad_f_x"],
            ),
            "jac_g": ca.Function(
                "nlp_jac_g", [x, none], [constraint, ca.vertcat(*jacobian)],
                names[:2], ["g", "jac_g_x"],
            ),
            "hess_lag": ca.Function(
                "nlp_hess_l", [x, none, scale, multipliers], [ca.triu(hessian)],
                names, ["triu_hess_gamma_x_x"],
            ),
        }  # fmt: skip
        nlp = {"x": x, "p": none, "f": objective, "g": constraint}
        return ca.nlpsol("coupled", "ipopt", nlp, {**_OPTIONS, **given})

    @property
    def centre(self) -> np.ndarray:
        """(3,) of the ball, in the gripper's frame [m]."""
        return self._x[-3:] * self.length

    def solve(self, pulls: list[np.ndarray]) -> tuple[bool, int]:
        """Solve for pulls [m] per finger; return whether it converged, and the iterations."""
        lower, upper = [], []
        for problem, pull in zip(self._problems, pulls, strict=True):
            bounds = problem.length_bounds(pull)
            moving = int((~problem.fixed).sum())
            lower += [np.full(len(bounds), -np.inf), np.full(moving, self._radius)]
            upper += [bounds, np.full(moving, np.inf)]
        found = self._solver(
            x0=self._x,
            lam_g0=self._multipliers,
            lbg=np.concatenate(lower),
            ubg=np.concatenate(upper),
        )
        stats = self._solver.stats()
        if stats["success"]:
            self._x = found["x"].full().ravel()
            self._multipliers = found["lam_g"].full().ravel()
        return bool(stats["success"]), int(stats["iter_count"])
