# SPDX-License-Identifier: Apache-2.0
"""One damped Gauss-Newton step towards a target, within the limits of tensions and pulls.

What is moved, v, is the pull of every taut cable and the tension of every slack one, so that a
slack cable can begin to act. With residual r(v), J = dr/dv and the pose's dy/dv:

    min_d  1/2 |r + J d|^2 + 1/2 d' S d + mu/2 |dy/dv d|^2     subject to  A d <= b           (1)

with the rows A: tensions stay >= 0 and below their limits, pulls stay within theirs. S is the
residual's own curvature, by the structured secant of Dennis, Gay and Welsch (1981) in its
symmetric rank-one form: without it the steps towards a target out of reach would creep. Where
cables outnumber what the target asks for, the step that is left over, in the null space of J,
goes to the least sum of squared tensions, within the same rows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ccr_ros.model.equilibrium import EquilibriumProblem
from ccr_ros.model.qp import solve_multipliers
from ccr_ros.model.sensitivity import response
from ccr_ros.model.sqp import KktPoint

from .pulls_limits import PullLimits
from .pulls_targets import Target

_FREE = 1e-6  # a direction that moves the residual by less than this, relative, is redundant
_LEAST = 1e-9  # weight of a change of tensions, relative: what makes (1) definite
_CARRIES = 1e-6  # T L^2 / EI; a cable that shall carry less is let out


@dataclass(frozen=True, eq=False)
class Step:
    """A step from a point.

    Attributes:
        change: (m,) of v; d in (1) and the null-space step together.
        tensions: (m,) that are to be expected after it (units of the solver).
        lengths: (m,) pulls at which the cables are just taut after it, units of L.
        gain: Expected fall of 1/2 |r|^2, by its linear part alone.
        relief: Size of the null-space step, as a change of tensions relative to them.
        price: Largest multiplier of the limits, for the merit function.
        size: Largest change of a pull, units of L.
    """

    change: np.ndarray
    tensions: np.ndarray
    lengths: np.ndarray
    gain: float
    relief: float
    price: float
    size: float


class PullModel:
    """The first-order model of target, tensions and pulls at a converged point.

    Attributes:
        residual: (r,) of the target, units of L.
        jacobian: (r, m); slope: (m,) gradient of 1/2 |r|^2.
        taut: (m,) bool, the cables that are driven by their pull, the others by tension.
        tensions: (m,) units of the solver; lengths: (m,) pulls at which the cables are just taut,
            units of L: of a taut cable its pull.
        excess: (m,) by how much tensions are above their limits, relative to these.
    """

    def __init__(
        self, problem: EquilibriumProblem, point: KktPoint, target: Target, limits: PullLimits
    ) -> None:
        length = problem.finger.length
        self.taut = point.active[: len(point.tensions)].copy()
        self.tensions = np.where(self.taut, point.tensions, 0.0)
        self.lengths = problem.rest.lengths - point.at.lengths
        answer = response(problem, point, self.taut)
        self.residual = target.residual(problem, point)
        self.jacobian = target.jacobian(problem, point, answer)
        self.slope = self.jacobian.T @ self.residual
        self._moved = answer.y.T @ answer.y
        self._tension_slopes = answer.tensions
        self._length_slopes = -(point.rows[: len(self.taut)] @ answer.y)
        unit = problem.finger.bending_stiffness / length**2
        self._most, self._low, self._high = limits.tension / unit, limits.low, limits.high
        self._low, self._high = limits.low / length, limits.high / length
        self.excess = np.maximum(self.tensions / self._most - 1.0, 0.0)
        self._rows, self._room = self._limits()

    @property
    def error(self) -> float:
        """Norm |r| of the residual, in units of L."""
        return float(np.linalg.norm(self.residual))

    def step(self, curvature: np.ndarray, damping: float) -> Step | None:
        """Return the step of (1), for S (m, m) and mu; None where the limits contradict."""
        change_of_tension = self._tension_slopes.T @ self._tension_slopes
        gauss = self.jacobian.T @ self.jacobian
        least = _LEAST * max(np.trace(gauss), 1e-12) / max(np.trace(change_of_tension), 1e-300)
        matrix = _positive(
            gauss + curvature + damping * self._moved + least * change_of_tension,
            least * change_of_tension,
        )
        found = _quadratic(matrix, self.slope, self._rows, self._room)
        if found is None:
            return None
        change, multipliers = found
        left = self.residual + self.jacobian @ change
        relief = 0.0
        if np.linalg.norm(left) <= max(0.5 * self.error, 1e-9):  # there, or on the way there
            rest = self._relieved(change)
            if rest is not None:
                eased = self._tension_slopes @ rest
                relief = float(np.linalg.norm(eased))
                relief /= max(float(np.linalg.norm(self.tensions)), 1.0)
                change = change + rest
        gain = -float(self.slope @ change + 0.5 * change @ gauss @ change)
        price = float(multipliers.max(initial=0.0))
        return self._ended(change, max(gain, 0.0), relief, price)

    def shortened(self, step: Step, largest: float) -> Step:
        """Return a step that changes no pull by more than ``largest`` (units of L)."""
        if step.size <= largest:
            return step
        part = largest / step.size
        return self._ended(part * step.change, part * step.gain, step.relief, step.price)

    def pulls(self, step: Step, slack: float) -> np.ndarray:
        """Return the pulls (m,) of a step, units of L; what shall be slack is let out by more."""
        carrying = step.tensions > _CARRIES
        wanted = np.where(carrying, step.lengths, step.lengths - slack)
        return np.clip(wanted, self._low, self._high)

    def settled_pulls(self, slack: float) -> np.ndarray:
        """Return the pulls (m,) of the point, units of L; slack cables are let out by ``slack``."""
        wanted = np.where(self.taut, self.lengths, self.lengths - slack)
        return np.clip(wanted, self._low, self._high)

    def at_limits(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Tell (m,) which tensions are at their limits, and pulls at the low and at the high."""
        full = self.tensions >= self._most * (1 - 1e-6)
        low = self.lengths <= self._low + 1e-9
        high = (self.lengths >= self._high - 1e-9) & np.isfinite(self._high)
        return full, low, high

    def offset(self, step: Step) -> float:
        """Return the relative offset of Bates and Watts (1981): 0 at a minimum of the error.

        It is the share of the residual that directions within the limits could still take away,
        were the problem linear.
        """
        return float(np.sqrt(2.0 * step.gain)) / max(self.error, 1e-300)

    def _ended(self, change: np.ndarray, gain: float, relief: float, price: float) -> Step:
        tensions = np.maximum(self.tensions + self._tension_slopes @ change, 0.0)
        lengths = self.lengths + self._length_slopes @ change
        size = float(np.abs(lengths - self.lengths).max())
        return Step(change, tensions, lengths, gain, relief, price, size)

    def _limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Rows A (k, m) and room b (k,) of A d <= b."""
        rows = [-self._tension_slopes]
        room = [self.tensions]
        bounded = np.isfinite(self._most)
        # A slack cable that is loose even at its largest pull cannot act.
        loose = ~self.taut & (self.lengths > self._high)
        most = np.where(loose, 0.0, self._most)
        rows.append(self._tension_slopes[bounded | loose])
        room.append((most - self.tensions)[bounded | loose])
        above, below = np.isfinite(self._low), np.isfinite(self._high) & ~loose
        rows.append(-self._length_slopes[above])
        room.append((self.lengths - self._low)[above])
        rows.append(self._length_slopes[below])
        room.append((self._high - self.lengths)[below])
        return np.concatenate(rows), np.concatenate(room)

    def _relieved(self, change: np.ndarray) -> np.ndarray | None:
        """The change (m,) in the null space of J that leaves the least tensions, if any."""
        scale = 1.0 / np.maximum(np.linalg.norm(self._tension_slopes, axis=0), 1e-12)
        _, sizes, ways = np.linalg.svd(self.jacobian * scale)
        rank = int((sizes > _FREE * max(float(sizes[0]), 1e-12)).sum())
        null = scale[:, None] * ways[rank:].T
        if not null.shape[1]:
            return None
        eased = self._tension_slopes @ null
        matrix = eased.T @ eased
        matrix += 1e-12 * np.trace(matrix) * np.eye(len(matrix))
        slope = eased.T @ (self.tensions + self._tension_slopes @ change)
        rows = self._rows @ null
        found = _quadratic(matrix, slope, rows, np.maximum(self._room - self._rows @ change, 0.0))
        return None if found is None else null @ found[0]


def _quadratic(
    matrix: np.ndarray, slope: np.ndarray, rows: np.ndarray, room: np.ndarray
) -> tuple[np.ndarray, np.ndarray] | None:
    """min 1/2 d'Bd + g'd subject to A d <= b: d and the multipliers; None if infeasible."""
    felt = np.linalg.norm(rows, axis=1) > 1e-12  # else the row bounds nothing that can change
    rows, room = rows[felt], room[felt]
    solved = np.linalg.solve(matrix, np.column_stack([slope, rows.T]))
    gram = rows @ solved
    # Rows differ by many orders in what they are worth: each in a unit of its own.
    unit = 1.0 / np.sqrt(np.maximum(np.diag(gram[:, 1:]), 1e-300))
    worth = 0.5 * (gram[:, 1:] + gram[:, 1:].T) * unit[:, None] * unit
    found = solve_multipliers(worth, (room + gram[:, 0]) * unit, room <= 1e-12)
    if found is None:
        return None
    multipliers = np.zeros(len(felt))
    multipliers[felt] = found * unit
    change = -(solved[:, 0] + solved[:, 1:] @ multipliers[felt])
    return (change, multipliers) if np.all(np.isfinite(change)) else None


def _positive(matrix: np.ndarray, floor: np.ndarray) -> np.ndarray:
    """Return the matrix, shifted along its negative directions until it is definite."""
    try:
        np.linalg.cholesky(matrix)
        return matrix
    except np.linalg.LinAlgError:
        values, vectors = np.linalg.eigh(matrix)
        least = 1e-9 * max(float(np.abs(values).max()), 1e-300)
        return (vectors * np.maximum(np.abs(values), least)) @ vectors.T + floor
