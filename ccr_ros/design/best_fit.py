# SPDX-License-Identifier: Apache-2.0
"""The paper's Eq. 7-8 in general: the rest shape that pulls bend nearest to a wanted shape.

For what equilibrium at the wanted shape cannot give. Where that is out of reach or inside an
obstacle, equilibrium at the nearest pose that is not (`nearest_pose`) is the answer. Where the rest
shape may only bend so far, or be constant along segments, the forward model's sum of squared disk
errors, obstacles active, is minimised over the rest curvature from there: Gauss-Newton in a trust
region (Levenberg-Marquardt), with the exact Jacobian of `RestForward`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ccr_ros.model import checks
from ccr_ros.model.equilibrium import EquilibriumProblem
from ccr_ros.model.errors import NotConverged
from ccr_ros.model.finger import Finger
from ccr_ros.model.settings import SolverSettings

from .bounded_step import bounded_step, curvature_bounds, kept
from .nearest_pose import nearest_pose
from .pose_fit import PIECES, fit_pose, smooth_guess
from .press import INSIDE, deepest
from .pull import Pull
from .rest_forward import RestForward, RestPose
from .rest_shape import RestShape, checked_pulls, rest_shape_at
from .rest_statics import RestStatics, curvature_ends
from .target import DesiredShape
from .tension_roots import taut_sets, tension_roots

_ITERATIONS = 100
_TIME_LIMIT = 20.0  # s of CPU; forward solves far from any equilibrium are slow
_EXACT = 1e-19  # m^2; a thousandth of the paper's tolerance: nothing is left to win
_FLAT = 1e-6  # relative decrease of the error that a step still promises
_WORTH = 1e-4  # of the promise, that a step must keep
_SAME = 1e-7  # m; poses nearer than this are one
_MODEST = 0.5  # of the finger's own limits: the bounds unless told otherwise


@dataclass(frozen=True, eq=False)
class BestFit:
    """The nearest that was found.

    Attributes:
        shape: The rest shape and the equilibrium of the forward model; its ``squared_error`` is
            what remains.
        first_error: What the first guess had [m^2].
        solves: Forward solves.
        optimal: No step promises a smaller error; else the search was ended.
        at_bound: Number of ends of pieces whose bending is at its bound.
    """

    shape: RestShape
    first_error: float
    solves: int
    optimal: bool
    at_bound: int


def best_fit(
    finger: Finger,
    shape: DesiredShape,
    pulls: Mapping[str, Pull],
    kind: str = "pieces",
    max_curvature: float | None = None,
) -> BestFit:
    """Return the rest shape that pulls bend nearest to a wanted shape, from a good first guess on.

    The least error near the guess; another one, far from it, may have less.

    Args:
        finger: Its own rest shape does not matter; its obstacles count.
        shape: Where the disks shall be.
        pulls: By cable; those not named are not pulled.
        kind: Of the rest curvature: ``"constant"`` along segments, ``"linear"``, or linear along
            the two ``"pieces"`` of each.
        max_curvature: Largest bending of the rest shape [1/m]; ``None``: half of that at which
            disks meet.

    Raises:
        InvalidValue, UnknownName: As for `RestShapeSolver.solve`; a wanted shape may be in an
            obstacle or too long here.
        NotConverged: The pulls lead from no guess to an equilibrium.
    """
    shape.check_count(finger)
    given = checked_pulls(finger, pulls)
    forward = RestForward(finger, given, kind)
    largest = np.array(finger.largest_rest_curvature)
    widest, limits = 0.999 * largest, _MODEST * largest
    if max_curvature is not None:
        high = float(largest[0])
        limit = checks.real("max_curvature", max_curvature, above=0, high=high, unit="1/m")
        limits[0] = min(widest[0], limit)
    pose, whole = _first_pose(forward, shape, given, limits, widest)
    first = shape.squared_error(pose.backbone)
    if whole:  # equilibrium at the nearest pose: nothing is nearer
        best, solves, optimal = pose, 1, True
    else:
        best, solves, optimal = _minimise(forward, shape, pose, limits, forward.near)
        again = forward.from_rest(best.curvature)
        if again is None or not np.allclose(again.backbone, best.backbone, atol=_SAME):
            # The pulls lead elsewhere from rest: minimise what they lead to, step by step.
            trial = _from_rest(forward)
            best, more, optimal = _minimise(forward, shape, pose, limits, trial)
            solves += more
    error = shape.squared_error(best.backbone)
    bending = np.linalg.norm(best.curvature[..., :2], axis=-1)
    return BestFit(
        rest_shape_at(best.problem, best.point, best.pulls, error),
        first,
        solves,
        optimal or error < _EXACT,
        int(np.sum(bending > 0.9999 * limits[0])),
    )


def _first_pose(
    forward: RestForward,
    shape: DesiredShape,
    pulls: Sequence[Pull],
    limits: np.ndarray,
    widest: np.ndarray,
) -> tuple[RestPose, bool]:
    """The rest shape of equilibrium at the nearest pose; true: as it is, not pulled into bounds."""
    finger = forward.finger
    straight = np.zeros((finger.segments, 2 * PIECES, 3))
    problem = EquilibriumProblem(replace(finger, rest_curvature=straight), SolverSettings())
    smooth = smooth_guess(problem, shape)
    fit = fit_pose(problem, shape)
    reached = fit.squared_error < _EXACT and deepest(problem, problem.evaluate(fit.y))[0] < INSIDE
    nearest = fit.y if reached else nearest_pose(problem, shape, _MODEST * widest)
    guesses = [(nearest, rest) for rest in _rests(problem, nearest, pulls, widest)]
    guesses += [(smooth, rest) for rest in _rests(problem, smooth, pulls, widest)]
    for group in (guesses, [(nearest, nearest), (smooth, smooth)], [(smooth, 0.0 * smooth)]):
        found = []
        for y, rest in group:
            ends = curvature_ends(problem, rest).reshape(finger.segments, 2 * PIECES, 3)
            wanted = _projected(ends, forward.vectors)
            pose = forward.from_rest(kept(wanted, limits))
            if pose is None:
                continue
            there = problem.evaluate(y).points[problem.points.backbone] * finger.length
            whole = (
                group is guesses and y is nearest and np.allclose(there, pose.backbone, atol=_SAME)
            )
            found.append((pose, bool(whole)))
        if found:
            return min(found, key=lambda p: (not p[1], shape.squared_error(p[0].backbone)))
    raise NotConverged(
        finger.name, "these pulls lead no rest shape that was tried to an equilibrium: pull less"
    )


def _rests(
    problem: EquilibriumProblem, y: np.ndarray, pulls: Sequence[Pull], widest: np.ndarray
) -> list[np.ndarray]:
    """Rest coordinates (N,) that the pulls bend into a pose, without contact forces."""
    statics = RestStatics(problem, y, pulls, (), *widest)
    tensions = [
        t for taut in taut_sets(len(pulls)) for t in tension_roots(statics, taut, len(pulls))
    ]
    return [statics.rest(t) for t in tensions if t.min() >= 0]


def _from_rest(forward: RestForward) -> Callable[[np.ndarray, RestPose], RestPose | None]:
    return lambda curvature, _: forward.from_rest(curvature)


def _projected(ends: np.ndarray, vectors: int) -> np.ndarray:
    """Curvature (n, v, 3) nearest to that of two pieces (n, 4, 3), in the mean square."""
    if vectors == 2 * PIECES:
        return ends
    mean = ends.mean(axis=1)
    if vectors == 1:
        return mean[:, None]
    # Legendre's first coefficient of both pieces together: 3/2 of the integral of u s.
    means = (ends[:, 0::2] + ends[:, 1::2]) / 2
    halves = (ends[:, 1::2] - ends[:, 0::2]) / 2
    slope = 0.75 * (means[:, 1] - means[:, 0]) + 0.25 * (halves[:, 0] + halves[:, 1])
    return np.stack([mean - slope, mean + slope], axis=1)


def _minimise(
    forward: RestForward,
    shape: DesiredShape,
    pose: RestPose,
    limits: np.ndarray,
    solve: Callable[[np.ndarray, RestPose], RestPose | None],
) -> tuple[RestPose, int, bool]:
    """Return the best pose, the number of forward solves, and whether it is a minimum.

    Where a point touches without force the error has a kink: the steps of either side are tried.
    """
    unit = forward.finger.segment_length  # curvature in units of 1/l0: the turn of a segment
    damping, solves = 1e-4, 1
    deadline = time.thread_time() + _TIME_LIMIT
    for _ in range(_ITERATIONS):
        if time.thread_time() > deadline:
            break
        residual = (pose.backbone - shape.points).ravel()
        error = float(residual @ residual)
        if error < _EXACT:
            return pose, solves, True
        bends = (pose.curvature * unit).reshape(-1, 3)
        rows, room = curvature_bounds(bends, limits * unit)
        best, most, promised, held = pose, 0.0, 0.0, 0.0
        for jacobian in _jacobians(forward, pose, unit):
            scale = float(np.einsum("ij,ij->j", jacobian, jacobian).max())
            solution = bounded_step(residual, jacobian, damping * scale, rows, room)
            if solution is None:
                continue
            step, _ = solution
            promise = error - float(np.sum((residual + jacobian @ step) ** 2))
            promised, held = max(promised, promise), promise  # the last is held
            if promise < _FLAT * error:
                continue
            change = step.reshape(pose.curvature.shape) / unit
            trial = solve(kept(pose.curvature + change, limits), pose)
            solves += 1
            gained = -np.inf if trial is None else error - shape.squared_error(trial.backbone)
            if trial is not None and gained > max(_WORTH * promise, most):
                best, most = trial, gained
        if best is not pose:
            damping = max(damping * (0.1 if most > 0.5 * promised else 1.0), 1e-10)
            pose = best
        elif promised < _FLAT * error:
            if damping < 1e-7:
                return pose, solves, True
            damping *= 0.1
        else:
            damping *= 10.0
            if damping > 1e6:
                return pose, solves, held < _FLAT * error
    return pose, solves, False


def _jacobians(forward: RestForward, pose: RestPose, unit: float) -> list[np.ndarray]:
    """Derivatives (3 (n+1), c) by the curvature in units of 1/l0; at a kink those of both sides."""
    size = pose.curvature.size
    free = forward.jacobian(pose).reshape(-1, size) / unit
    held = forward.jacobian(pose, held=True).reshape(-1, size) / unit
    return [free] if np.array_equal(free, held) else [free, held]
