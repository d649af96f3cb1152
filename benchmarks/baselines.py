# SPDX-License-Identifier: Apache-2.0
"""General NLP solvers on the Cartesian formulation: CasADi/IPOPT, SciPy's trust-constr and SLSQP.

Each is warm-started from the last step, as the paper did with fmincon, and gets the exact
derivatives that its method can use: for SLSQP gradient and Jacobian, for the others Hessians too.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from scipy.optimize import NonlinearConstraint, OptimizeResult, minimize

from .cartesian import CartesianProblem

FEASIBLE = 1e-6  # largest violation, in segment lengths, of a step that counts as converged


@dataclass(frozen=True)
class Step:
    """One warm step of a sweep.

    Attributes:
        seconds: Wall time of the solve.
        cpu_seconds: CPU time of this process in it, all threads.
        iterations: Of the solver.
        converged: By the solver's own word, and feasible to `FEASIBLE`.
        finished: False if the deadline stopped it.
    """

    seconds: float
    cpu_seconds: float
    iterations: int
    converged: bool
    finished: bool = True


UNFINISHED = Step(0.0, 0.0, 0, converged=False, finished=False)


class _DeadlinePassed(Exception):
    """Raised in a solver's callback to stop it."""


class Baseline(ABC):
    """A solver on a Cartesian problem, holding the last step's unknowns ``w`` (6n,)."""

    def __init__(self, problem: CartesianProblem) -> None:
        self.problem = problem
        self.reset()

    def reset(self) -> None:
        """Go back to the rest shape."""
        self.w = self.problem.rest.copy()

    def step(self, pull: float, deadline: float = np.inf) -> Step:
        """Solve at a pull fraction from the last step; give up at ``deadline`` (perf_counter)."""
        parameters = self.problem.parameters(pull, self.w)
        cpu_begin, begin = time.process_time(), time.perf_counter()
        try:
            w, iterations, success = self._solve(parameters, deadline)
        except _DeadlinePassed:
            return UNFINISHED
        seconds, cpu_seconds = time.perf_counter() - begin, time.process_time() - cpu_begin
        self.w = w
        g, h = (f(w, parameters)[0].full().ravel() for f in (self.problem.g, self.problem.h))
        feasible = np.abs(g).max() < FEASIBLE and (h.size == 0 or h.min() > -FEASIBLE)
        return Step(seconds, cpu_seconds, iterations, bool(success and feasible))

    @abstractmethod
    def _solve(self, parameters: np.ndarray, deadline: float) -> tuple[np.ndarray, int, bool]:
        """Return unknowns, iterations, and whether the solver says it converged."""


class Ipopt(Baseline):
    """Interior point with exact Hessian, the kin of the paper's fmincon; multipliers warm too."""

    def __init__(self, problem: CartesianProblem) -> None:
        p = problem
        w, q = ca.MX.sym("w", p.rest.size), ca.MX.sym("p", p.objective.size1_in(1))
        (f, gradient), (g, g_jacobian), (h, h_jacobian) = (
            function(w, q) for function in (p.objective, p.g, p.h)
        )
        scale, v = ca.MX.sym("s"), ca.MX.sym("v", p.equalities + p.inequalities)
        hessian = ca.triu(p.lagrangian_hessian(w, q, scale, v))
        both, jacobian = ca.vertcat(g, h), ca.vertcat(g_jacobian, h_jacobian)
        names = ["x", "p", "lam_f", "lam_g"]
        gradient_function = ca.Function(
            "nlp_grad_f", [w, q], [f, gradient.T], names[:2], ["f", "grad_f_x"]
        )
        jacobian_function = ca.Function(
            "nlp_jac_g", [w, q], [both, jacobian], names[:2], ["g", "jac_g_x"]
        )
        hessian_function = ca.Function(
            "nlp_hess_l", [w, q, scale, v], [hessian], names, ["triu_hess_gamma_x_x"]
        )
        options: dict[str, Any] = {
            "grad_f": gradient_function,
            "jac_g": jacobian_function,
            "hess_lag": hessian_function,
            "print_time": False,
            "ipopt.print_level": 0,
            "ipopt.sb": "yes",
            "ipopt.max_iter": 200,
            "ipopt.warm_start_init_point": "yes",
            "ipopt.mu_init": 1e-6,
            "ipopt.warm_start_bound_push": 1e-8,
            "ipopt.warm_start_slack_bound_push": 1e-8,
            "ipopt.warm_start_mult_bound_push": 1e-8,
        }
        nlp = {"x": w, "p": q, "f": f, "g": both}
        self._solver = ca.nlpsol("ipopt", "ipopt", nlp, options)
        self._upper = np.concatenate([np.zeros(p.equalities), np.full(p.inequalities, np.inf)])
        super().__init__(problem)

    def reset(self) -> None:
        super().reset()
        self._multipliers = np.zeros(self._upper.size)

    def _solve(self, parameters: np.ndarray, deadline: float) -> tuple[np.ndarray, int, bool]:
        if time.perf_counter() > deadline:
            raise _DeadlinePassed
        result = self._solver(
            x0=self.w, p=parameters, lbg=0.0, ubg=self._upper, lam_g0=self._multipliers
        )
        stats = self._solver.stats()
        if stats["success"]:
            self._multipliers = result["lam_g"].full().ravel()
        return result["x"].full().ravel(), int(stats["iter_count"]), bool(stats["success"])


class _SciPy(Baseline):
    """What SciPy's methods share: compiled derivatives and a callback that minds the deadline."""

    def __init__(self, problem: CartesianProblem) -> None:
        super().__init__(problem)
        self._parameters = np.zeros(0)

    def _objective(self, w: np.ndarray) -> tuple[float, np.ndarray]:
        value, gradient = self.problem.objective(w, self._parameters)
        return float(value), gradient.full().ravel()

    def _value(self, function: ca.Function) -> Callable[[np.ndarray], np.ndarray]:
        return lambda w: function(w, self._parameters)[0].full().ravel()

    def _minimize(self, method: str, deadline: float, **arguments: Any) -> OptimizeResult:
        def watch(*_: Any) -> None:
            if time.perf_counter() > deadline:
                raise _DeadlinePassed

        watch()
        return minimize(
            self._objective, self.w, method=method, jac=True, callback=watch, **arguments
        )


class TrustConstr(_SciPy):
    """SciPy's trust-constr (Byrd-Omojokun, barrier for inequalities); sparse exact Hessians."""

    def _solve(self, parameters: np.ndarray, deadline: float) -> tuple[np.ndarray, int, bool]:
        self._parameters = parameters

        p = self.problem

        def constraint(function: ca.Function, hessian: ca.Function, upper: float) -> Any:
            return NonlinearConstraint(
                self._value(function),
                0.0,
                upper,
                jac=lambda w: function(w, self._parameters)[1].sparse(),
                hess=lambda w, v: hessian(w, self._parameters, v).sparse(),
            )

        constraints = [constraint(p.g, p.g_hessian, 0.0)]
        if p.inequalities:
            constraints.append(constraint(p.h, p.h_hessian, np.inf))
        result = self._minimize(
            "trust-constr",
            deadline,
            hess=lambda w: p.f_hessian(w, self._parameters).sparse(),
            constraints=constraints,
            options={"gtol": 1e-7, "xtol": 1e-9, "barrier_tol": 1e-7, "maxiter": 1000},
        )
        return result.x, int(result.nit), result.status in (1, 2)


class Slsqp(_SciPy):
    """SciPy's SLSQP: dense, quasi-Newton; exact gradients and Jacobians."""

    def _solve(self, parameters: np.ndarray, deadline: float) -> tuple[np.ndarray, int, bool]:
        self._parameters = parameters

        p = self.problem

        def constraint(kind: str, function: ca.Function) -> dict[str, Any]:
            return {
                "type": kind,
                "fun": self._value(function),
                "jac": lambda w: function(w, self._parameters)[1].full(),
            }

        constraints = [constraint("eq", p.g)]
        if p.inequalities:
            constraints.append(constraint("ineq", p.h))
        result = self._minimize(
            "SLSQP", deadline, constraints=constraints, options={"ftol": 1e-12, "maxiter": 500}
        )
        return result.x, int(result.nit), bool(result.success)


BASELINES: dict[str, type[Baseline]] = {
    "ipopt": Ipopt,
    "trust-constr": TrustConstr,
    "slsqp": Slsqp,
}
