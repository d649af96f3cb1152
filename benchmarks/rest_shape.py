# SPDX-License-Identifier: Apache-2.0
"""Rest shapes for a wanted shape: this project's equilibrium, and nested optimisation with SciPy.

The nested rows are the paper's Eq. 7-8 as they stand: the sum of squared disk errors of the forward
model (this project's, from rest), minimised over the rest curvature until it is below 1e-10 mm^2.
A step is one whole design; the row's error is the forward model's, pulled from rest.
"""

from __future__ import annotations

import time

import numpy as np
from scipy.optimize import Bounds, least_squares, minimize

from ccr_ros.design.curve_text import curve_from_text
from ccr_ros.design.placement import place
from ccr_ros.design.pull import Pull
from ccr_ros.design.rest_forward import RestForward
from ccr_ros.design.rest_shape import RestShapeSolver
from ccr_ros.design.target import DesiredShape
from ccr_ros.design.verify import TOLERANCE, pull_from_rest
from ccr_ros.model import Cable, Finger, FingerSolver, load_finger
from ccr_ros.resources import find_config

from .baselines import UNFINISHED, Step
from .cases import Case

#: Wanted curves: an arc for a finger of three segments; the paper's sphere; a helix in space.
CURVES = {
    "short": "arc:30",
    "sphere": "sphere:0.112,x=0.042,z=0.110",
    "space": "helix:0.03,turns=0.8",
}
_PULL = {"short": 0.03, "sphere": 0.03, "space": 0.04}


def rest_case(name: str) -> tuple[Case, DesiredShape]:
    """Return a wanted shape, and finger and pull as a case, whose truth are the shape's disks."""
    if name == "short":
        cable = Cable.from_holes("main", [1, 1, 1, 1])
        finger = Finger("short", 0.06, 3, 0.008, 0.0025, 0.35, (cable,))
    else:
        finger = load_finger(find_config("sphere_finger" if name == "sphere" else "helical"))
    shape = place(curve_from_text(CURVES[name], finger), finger)
    return Case(name, finger, np.array([_PULL[name]]), np.array(shape.points)), shape


class _Sweeper:
    """What both have: the wanted shape, and the pose that the last design is pulled into.

    Args:
        finger: Its first cable is pulled.
        shape: The wanted shape.
    """

    def __init__(self, finger: Finger, shape: DesiredShape) -> None:
        self.finger, self.shape = finger, shape
        self.cable = finger.cables[0].name
        self._last: tuple[Finger, np.ndarray] | None = None

    def reset(self) -> None:
        """Nothing is kept from one design to the next."""

    def step(self, pull: float, deadline: float) -> Step:
        """Design for a pull, a fraction of the rest length."""
        cpu_begin, begin = time.process_time(), time.perf_counter()
        found = self.design(pull, deadline)
        seconds, cpu_seconds = time.perf_counter() - begin, time.process_time() - cpu_begin
        if found is None:
            return UNFINISHED
        finger, pulls, iterations = found
        self._last = finger, pulls
        path = pull_from_rest(finger, pulls, self.shape, steps=2)
        return Step(seconds, cpu_seconds, iterations, path.reached)

    def design(self, pull: float, deadline: float) -> tuple[Finger, np.ndarray, int] | None:
        """Return the finger, its pulls [m] and iterations; None if the deadline came first."""
        raise NotImplementedError

    def backbone(self) -> np.ndarray:
        """Return the disk centres (n+1, 3) [m] that the pulls bend the last finger into."""
        assert self._last is not None
        return pull_from_rest(*self._last, self.shape, steps=2).last.backbone


class EquilibriumSweeper(_Sweeper):
    """This project's `RestShapeSolver`."""

    def __init__(self, finger: Finger, shape: DesiredShape) -> None:
        super().__init__(finger, shape)
        self._solver = RestShapeSolver(finger)

    def design(self, pull: float, deadline: float) -> tuple[Finger, np.ndarray, int] | None:
        if time.perf_counter() > deadline:
            return None
        design = self._solver.solve(self.shape, {self.cable: Pull(pull, relative=True)})
        best = design.shapes[0]
        return best.finger, best.pulls, 0


class _Late(Exception):
    """The deadline ended the search."""


class _Done(Exception):
    """The error is within the paper's tolerance."""

    def __init__(self, x: np.ndarray) -> None:
        self.x = x.copy()


class NestedSweeper(_Sweeper):
    """SciPy over the bending of the rest shape, the forward model from rest inside.

    The rest curvature is linear along two pieces per segment, as this project's; without twist, and
    in the plane of the shape where there is one. The first guess is straight, as in the paper.

    Args:
        finger, shape: As for `_Sweeper`.
        method: ``"least_squares"`` (trust region on the disks' errors) or ``"slsqp"`` (on the sum
            of their squares); derivatives by differences.
    """

    def __init__(self, finger: Finger, shape: DesiredShape, method: str) -> None:
        super().__init__(finger, shape)
        self._method = method
        planar = not np.asarray(self.shape.points)[:, 1].any()
        self._axes = [1] if planar else [0, 1]

    def design(self, pull: float, deadline: float) -> tuple[Finger, np.ndarray, int] | None:
        forward = RestForward(self.finger, [Pull(pull, relative=True)])
        shape = (self.finger.segments, forward.vectors, 3)
        bound = 0.4 * self.finger.largest_rest_curvature[0] / _UNIT
        solves = 0

        def curvature(x: np.ndarray) -> np.ndarray:
            full = np.zeros(shape)
            full[:, :, self._axes] = _UNIT * x.reshape(*shape[:2], -1)
            return full

        def errors(x: np.ndarray) -> np.ndarray:
            nonlocal solves
            if time.perf_counter() > deadline:
                raise _Late
            solves += 1
            pose = forward.from_rest(curvature(x))
            if pose is None:  # no equilibrium: worse than any
                return np.full(self.shape.points.size, 1e3 * self.finger.length)
            error = 1e3 * (pose.backbone - self.shape.points).ravel()  # mm, as in the paper
            if np.sum(error**2) <= 1e6 * TOLERANCE:  # Eq. 8
                raise _Done(x)
            return error

        start = np.zeros(shape[0] * shape[1] * len(self._axes))
        limits = Bounds(np.full(len(start), -bound), np.full(len(start), bound))
        try:
            if self._method == "least_squares":
                goal = {"ftol": 1e-15, "xtol": 1e-15, "gtol": 1e-15}
                x = least_squares(errors, start, bounds=limits, **goal).x
            else:
                x = minimize(
                    lambda x: float(np.sum(errors(x) ** 2)),
                    start,
                    method="SLSQP",
                    bounds=limits,
                    options={"ftol": 1e-14, "maxiter": 1000},
                ).x
        except _Done as done:
            x = done.x
        except _Late:
            return None
        finger = forward.with_rest(curvature(x))
        return finger, pull * FingerSolver(finger).rest_lengths, solves


_UNIT = 10.0  # 1/m; what SciPy's variables are in, so that they are about 1
