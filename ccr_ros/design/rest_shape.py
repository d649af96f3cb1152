# SPDX-License-Identifier: Apache-2.0
"""The paper's algorithm Pre-bent: the rest shape that given pulls bend into a wanted shape.

No nested optimisation is needed: at the wanted shape the rest curvature follows from equilibrium
(`rest_statics`), with one unknown tension per taut cable that its pull decides (`tension_roots`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ccr_ros.model import checks
from ccr_ros.model.equilibrium import EquilibriumProblem
from ccr_ros.model.errors import InvalidValue, UnknownName
from ccr_ros.model.finger import Finger
from ccr_ros.model.result import smallest_eigenvalue
from ccr_ros.model.settings import SolverSettings
from ccr_ros.model.sqp import KktPoint, derive

from .pose_fit import PIECES, PoseFit, fit_pose
from .press import INSIDE, Press, deepest, pushes
from .pull import Pull
from .rest_statics import Push, RestStatics, curvature_ends
from .target import DesiredShape
from .tension_roots import taut_sets, tension_roots

_SLACK = 1e-12  # of the finger's length; a slack cable may be so much too long
_STABLE = 1e-6  # of the reduced Hessian's eigenvalues, as in certificates


@dataclass(frozen=True, eq=False)
class RestShape:
    """A rest shape, and the equilibrium in the wanted shape that the pulls bend it into.

    Attributes:
        finger: The finger with this rest shape (``rest_curvature``), all else as it was given.
        pulls: (m,) pull of each cable [m]; rest_lengths: (m,) what percentages are of [m].
        tensions: (m,) [N, or per EI]; 0: slack.
        rest: (n+1, 3) disk centres at rest [m].
        actuated: (n+1, 3) disk centres in equilibrium [m]; frames: (n+1, 3, 3) disk frames.
        energy: Elastic energy in equilibrium [J, or per EI].
        largest_curvature: Largest bending of the rest shape [1/m].
        rest_gap: Smallest distance of the rest shape from an obstacle [m]; inf without one.
        residual: Largest unbalanced generalised force, relative to the largest elastic one.
        smallest_eigenvalue: Of the reduced Hessian; see `Certificate`.
        squared_error: Sum of the squared distances of the disk centres from the wanted ones [m^2].
    """

    finger: Finger
    pulls: np.ndarray
    rest_lengths: np.ndarray
    tensions: np.ndarray
    rest: np.ndarray
    actuated: np.ndarray
    frames: np.ndarray
    energy: float
    largest_curvature: float
    rest_gap: float
    residual: float
    smallest_eigenvalue: float
    squared_error: float

    @property
    def stable(self) -> bool:
        """Whether the actuated shape is a strict minimum of the energy."""
        return self.smallest_eigenvalue > _STABLE


@dataclass(frozen=True, eq=False)
class RestDesign:
    """What was found for a wanted shape and pulls.

    Attributes:
        shapes: The rest shapes, that of the least tension first.
        refused: Where there is none, lines that say why.
        fit: The pose that stands for the wanted shape.
    """

    shapes: tuple[RestShape, ...]
    refused: tuple[str, ...]
    fit: PoseFit


class RestShapeSolver:
    """Finds rest shapes of one finger; built once, for as many wanted shapes as one likes.

    Args:
        finger: Its own rest shape does not matter; its obstacles are those of the wanted shape.
    """

    def __init__(self, finger: Finger) -> None:
        straight = np.zeros((finger.segments, 2 * PIECES, 3))
        self.finger = finger
        self.problem = EquilibriumProblem(
            replace(finger, rest_curvature=straight), SolverSettings(tolerance=1e-12)
        )

    def solve(
        self,
        shape: DesiredShape,
        pulls: Mapping[str, Pull],
        presses: Sequence[Press] = (),
        max_curvature: float | None = None,
    ) -> RestDesign:
        """Return all rest shapes found that the pulls bend into the wanted shape.

        Args:
            shape: Where the disks shall be.
            pulls: By cable; those not named are not pulled (and hold, if the shape wants them
                longer than at rest).
            presses: Contact forces in the wanted shape; every other point presses with none.
            max_curvature: Largest bending of the rest shape [1/m]; ``None``: where disks meet.

        Raises:
            InvalidValue: The finger cannot span the shape, the shape stands in an obstacle, or a
                press does not touch one.
            UnknownName: A cable that the finger does not have.
        """
        finger, problem = self.finger, self.problem
        shape.check_fits(finger)
        given = checked_pulls(finger, pulls)
        largest = finger.largest_rest_curvature
        limit = largest[0]
        if max_curvature is not None:
            limit = checks.real("max_curvature", max_curvature, above=0, high=limit, unit="1/m")
        fit = fit_pose(problem, shape)
        at = problem.evaluate(fit.y)
        depth, disk, name = deepest(problem, at)
        if depth > INSIDE:
            raise InvalidValue(
                "shape",
                f"disk {disk}",
                f"clear of obstacle {name!r} (it is {depth * 1e3:.4g} mm inside); `best_fit`, or"
                " --fit, finds the nearest",
            )
        forces = pushes(problem, at, presses)
        statics = RestStatics(problem, fit.y, given, forces, *largest)
        shapes: list[RestShape] = []
        pushing: list[str] = []
        held: list[str] = []
        for taut in taut_sets(len(given)):
            for tensions in tension_roots(statics, taut, len(given)):
                spare = statics.missing(tensions)[0]
                short = [j for j in range(len(given)) if j not in taut and spare[j] < -_SLACK]
                if tensions.min() < 0:
                    pushing.append(_pushing(finger, tensions))
                elif short:  # it would be taut, and stands in a set in which it is
                    held += [_held(finger, spare, short)] if taut else []
                else:
                    shapes.append(self._shape(statics, tensions, forces, shape, fit))
        shapes.sort(key=lambda s: float(s.tensions.max(initial=0.0)))
        tight = [_too_tight(s, limit) for s in shapes if s.largest_curvature > limit]
        shapes = [s for s in shapes if s.largest_curvature <= limit]
        if tight and not shapes:
            return RestDesign((), tuple(tight), fit)
        # What cables cannot do matters where there is nothing that they can.
        refused = [] if shapes else [_out_of_reach(statics, given, finger), *pushing, *held]
        return RestDesign(tuple(shapes), tuple(dict.fromkeys(refused)), fit)

    def _shape(
        self,
        statics: RestStatics,
        tensions: np.ndarray,
        forces: Sequence[Push],
        shape: DesiredShape,
        fit: PoseFit,
    ) -> RestShape:
        rest = statics.rest(tensions)
        curvature = curvature_ends(self.problem, rest).reshape(shape.segments, 2 * PIECES, 3)
        problem = self.problem.with_rest_curvature(curvature)
        table = np.zeros((len(problem.obstacles), len(problem.points.labels)))
        for push in forces:
            table[push.obstacle, push.point] = push.force
        point = derive(problem, problem.evaluate(fit.y - rest), tensions, table)
        spare = np.where(tensions > 0, 0.0, np.maximum(statics.missing(tensions)[0], 0.0))
        pulls = (problem.rest_lengths - point.at.lengths - spare) * problem.finger.length
        return rest_shape_at(problem, point, pulls, fit.squared_error)


def rest_shape_at(
    problem: EquilibriumProblem, point: KktPoint, pulls: np.ndarray, squared_error: float
) -> RestShape:
    """Return the rest shape of a problem with an equilibrium of it, in metres and newtons."""
    finger, length = problem.finger, problem.finger.length
    centres, arcs = problem.points.backbone, problem.arcs_per_segment
    bending = np.linalg.norm(finger.rest_curvature_ends[..., :2], axis=-1)
    gaps = problem.rest.distances[:, ~problem.fixed]
    return RestShape(
        finger=finger,
        pulls=pulls,
        rest_lengths=problem.rest_lengths * length,
        tensions=point.tensions * finger.bending_stiffness / length**2,
        rest=problem.rest.points[centres] * length,
        actuated=point.at.points[centres] * length,
        frames=point.at.rod.rotations[::arcs],
        energy=0.5 * float(point.at.y @ point.at.y) * finger.bending_stiffness / length,
        largest_curvature=float(bending.max()),
        rest_gap=float(gaps.min(initial=np.inf)) * length,
        residual=point.residual,
        smallest_eigenvalue=smallest_eigenvalue(point),
        squared_error=squared_error,
    )


def _too_tight(shape: RestShape, limit: float) -> str:
    return (
        f"the one for a tension of {shape.tensions.max():.4g} bends by"
        f" {shape.largest_curvature:.4g} 1/m at rest, more than the {limit:.4g} 1/m allowed"
    )


def _pushing(finger: Finger, tensions: np.ndarray) -> str:
    """Which cables would have to push, and how hard."""
    unit = finger.bending_stiffness / finger.length**2
    word = "N" if finger.forces_are == "newton" else "1/m^2 per EI"
    return "; ".join(
        f"cable {name} would have to push with {-tension * unit:.4g} {word}, which a cable cannot"
        for name, tension in zip(finger.cable_names, tensions, strict=True)
        if tension < 0
    )


def _held(finger: Finger, spare: np.ndarray, short: Sequence[int]) -> str:
    """What cables that would hold must be paid out by, for the others alone to bend the finger."""
    return " and ".join(
        f"cable {finger.cable_names[j]} paid out by {-spare[j] * finger.length * 1e3:.4g} mm more"
        " would be slack, and there would be one"
        for j in short
    )


def checked_pulls(finger: Finger, pulls: Mapping[str, Pull]) -> list[Pull]:
    """Return a pull for each cable; 0 for those not named.

    Raises:
        UnknownName: A cable that the finger does not have.
        InvalidValue: No `Pull`, not finite, or more than a cable can be pulled.
    """
    for name, pull in pulls.items():
        if name not in finger.cable_names:
            raise UnknownName("cable", name, finger.cable_names)
        if not isinstance(pull, Pull):
            raise InvalidValue(f"pulls.{name}", pull, "a Pull")
        if pull.relative:
            checks.real(f"pulls.{name}", pull.value, low=-2, below=1)
        else:
            limit = 2 * finger.length
            checks.real(f"pulls.{name}", pull.value, low=-limit, high=limit, unit="m")
    return [pulls.get(name, Pull(0.0)) for name in finger.cable_names]


def _out_of_reach(statics: RestStatics, given: Sequence[Pull], finger: Finger) -> str:
    """Why no tensions were found: for one cable, the pulls between the bounds are told."""
    bending = statics.limits[0]
    line = f"no tensions give these pulls while the rest shape bends by less than {bending:.4g} 1/m"
    ends = curvature_ends(statics.problem, statics.free_rest)
    tightest = float(np.hypot(ends[:, 0], ends[:, 1]).max())
    if tightest >= bending:
        return f"{line}; the shape itself bends by {tightest:.4g} 1/m"
    if len(given) > 1:
        return f"{line}: pull less, or differently"
    unit = np.ones(1)
    end = statics.reach(np.zeros(1), unit)
    tensions = np.linspace(0.0, end, 25)
    longest = max(
        float(statics.problem.evaluate(statics.rest(t * unit)).lengths[0]) for t in tensions
    )
    room = longest - float(statics.at.lengths[0])
    most = f"{room / longest:.3%}" if given[0].relative else f"{room * finger.length * 1e3:.4g} mm"
    return f"{line}: the pull can be {most} at most"
