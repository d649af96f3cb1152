# SPDX-License-Identifier: Apache-2.0
"""A whole gripper for an object: pre-bent fingers that a pull lays on its contour.

The paper's section 4.1. For each finger: the contour of the object's section, `contours`, a disk's
radius (and a clearance) off it, touched below and above the object's middle; the disks placed on
it; the rest shape that the pull bends into it, `rest_shape`; and the forward model with the object
as obstacle, from rest to the pull, as the proof.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..model import checks
from ..model.errors import CcrError, InvalidValue
from ..model.files import Gripper, MountedFinger
from ..model.finger import Finger
from ..model.rotation import Pose
from ..model.solution import Solution
from .contours import LeadIn, follow, lead_in, least_lead_in
from .curves import Curve
from .gripper_layout import GripperLayout, check_above_bases, check_apart, check_facing
from .placement import place
from .press import Press
from .pull import Pull
from .rest_shape import RestShape, RestShapeSolver
from .section import Section
from .target import DesiredShape
from .verify import PullPath, pull_from_rest

TOUCHING = 1e-5  # m; a disk no farther off the object touches it
_BEYOND = 0.25  # of a segment; so far from the object's middle a disk must touch, to either side
_STEPS = 10  # of the pull, in the forward proof


class NoRestShape(CcrError):
    """No rest shape was found that the pull bends into the wanted shape.

    Attributes:
        reasons: Why, one line each.
    """

    def __init__(self, reasons: tuple[str, ...]) -> None:
        self.reasons = reasons
        super().__init__(f"no rest shape leads to the contour: {'; '.join(reasons)}")


@dataclass(frozen=True)
class GripperTask:
    """What is to be designed.

    Attributes:
        layout: The object and where the bases stand.
        template: The fingers' geometry, material and cables; its rest shape and its obstacles do
            not matter.
        pulls: At which the fingers lie on the contour, by cable.
        clearance: Between the disks' hole circle and the object's surface [m], >= 0.
        press: Normal force of one finger on the object [N, or per EI], shared evenly by the disks
            on the contour; 0: the finger only touches.
        join: Where the lead-in ends; see `contours.contour` [m]. ``None``: where it bends least
            with disks on the contour below and above the object's middle.

    Raises:
        InvalidValue: A value out of its range, or no cable that is pulled.
    """

    layout: GripperLayout
    template: Finger
    pulls: Mapping[str, Pull]
    clearance: float = 0.0
    press: float = 0.0
    join: float | None = None

    def __post_init__(self) -> None:
        checks.real("clearance", self.clearance, low=0, high=1, unit="m")
        checks.real("press", self.press, low=0)
        if not any(pull.value > 0 for pull in self.pulls.values()):
            pulls = {name: pull.value for name, pull in self.pulls.items()}
            raise InvalidValue("pulls", pulls, "> 0 for a cable, or the fingers would never open")
        if self.press > 0 and self.clearance > 0:
            raise InvalidValue("clearance", self.clearance, "0 where fingers are to press")


@dataclass(frozen=True, eq=False)
class FingerDesign:
    """One finger of a gripper, designed and proved.

    Attributes:
        curve: The wanted curve, in the frame of the base; shape: the disks on it.
        first_on_contour: Index of the first disk on the contour.
        rest: Its rest shape, without the object.
        path: The forward model: pulled from rest, with the object.
        gaps: (n+1,) distance of each disk's nearest modelled point from the object, actuated [m].
        heights: (n+1,) of the disk centres above the object's middle, actuated [m].
    """

    curve: Curve
    shape: DesiredShape
    first_on_contour: int
    rest: RestShape
    path: PullPath
    gaps: np.ndarray
    heights: np.ndarray

    @property
    def finger(self) -> Finger:
        """The finger, without the object."""
        return self.rest.finger

    @property
    def solution(self) -> Solution:
        """The actuated pose, of the forward model with the object."""
        return self.path.last

    @property
    def touching(self) -> tuple[int, ...]:
        """Disks that touch the object."""
        return tuple(int(i) for i in np.flatnonzero(self.gaps <= TOUCHING))


@dataclass(frozen=True, eq=False)
class GripperDesign:
    """A gripper, and the designs of its fingers, in the same order; like ones are shared."""

    task: GripperTask
    gripper: Gripper
    fingers: tuple[FingerDesign, ...]

    @property
    def reached(self) -> bool:
        """Whether every finger is pulled onto its contour, without a jump, and is stable there."""
        return all(
            f.path.smooth and f.solution.certificate.stable and not f.path.unstable
            for f in self.fingers
        )


def design_gripper(task: GripperTask, name: str = "gripper") -> GripperDesign:
    """Design all fingers of a gripper.

    Args:
        task: What is wanted.
        name: Of the gripper; its fingers are finger_1, finger_2, ...

    Raises:
        InvalidValue, UnknownName: Geometry that cannot be, or pulls that the finger does not have;
            names the number that is wrong.
        NoRestShape: No rest shape leads there.
    """
    layout, template = task.layout, replace(task.template, rest_curvature=None, obstacles=())
    layout.check_room(template.disk_radius)
    bases = layout.bases
    known: dict[Section, FingerDesign] = {}
    designs = []
    for i, base in enumerate(bases):
        section = layout.section(i)
        if section not in known:
            known[section] = _design_finger(task, template, section, base)
        designs.append(known[section])
    for when, centers in (
        ("once they are pulled", [d.solution.backbone for d in designs]),
        ("at rest", [d.rest.rest for d in designs]),
    ):
        shapes = [base.points(c) for base, c in zip(bases, centers, strict=True)]
        check_apart(shapes, template.disk_radius, when)
        check_above_bases(shapes, template.disk_radius, when)
    mounted = tuple(
        MountedFinger(replace(d.finger, name=f"finger_{i}"), base)
        for i, (d, base) in enumerate(zip(designs, bases, strict=True), 1)
    )
    return GripperDesign(task, Gripper(checks.name("name", name), mounted), tuple(designs))


def wanted_curve(task: GripperTask, section: Section) -> tuple[Curve, LeadIn]:
    """Return the curve that a finger shall take, and its lead-in.

    Raises:
        InvalidValue: As `contours.lead_in` and `contours.follow`; or the finger touches on one side
            of the object's middle only, or reaches above the top of a cylinder.
    """
    finger = task.template
    wanted = section.grown(finger.disk_radius + task.clearance)

    def positions(lead: LeadIn) -> np.ndarray:
        s = np.arange(finger.segments + 1) * finger.segment_length
        return lead.join + s[s >= lead.length] - lead.length

    def both_sides(lead: LeadIn) -> bool:
        on = positions(lead)
        far = _BEYOND * finger.segment_length
        return len(on) > 0 and on[0] <= -far and on[-1] >= far

    if task.join is None:
        lead = least_lead_in(wanted)
        if not both_sides(lead):
            try:
                lead = least_lead_in(wanted, both_sides)
            except InvalidValue:
                on = positions(lead)
                reach = f"from {on[0] * 1e3:.4g} to {on[-1] * 1e3:.4g} mm" if len(on) else "nowhere"
                raise InvalidValue(
                    "length",
                    finger.length,
                    "such that disks touch below and above the object's middle: with the gentlest"
                    f" lead-in, of {lead.length * 1e3:.4g} mm, they touch {reach} along the contour"
                    " from there, and no other lead-in does better",
                ) from None
    else:
        lead = lead_in(wanted, task.join)
    name = f"contour of the {task.layout.body.kind}"
    curve = follow(name, finger.length, wanted, lead)
    if task.layout.body.kind == "cylinder":
        s = np.linspace(0, finger.length, 401)
        above = float(curve.points(s)[:, 2].max()) - section.up - section.half_height
        if above > 0:
            raise InvalidValue(
                "length",
                finger.length,
                f"less by {above * 1e3:.4g} mm: the finger reaches so far above the cylinder's top,"
                " and the model's cylinder is infinite",
            )
    return curve, lead


def _design_finger(
    task: GripperTask, template: Finger, section: Section, base: Pose
) -> FingerDesign:
    curve, lead = wanted_curve(task, section)
    s = np.arange(template.segments + 1) * template.segment_length
    first = int(np.searchsorted(s, lead.length))
    check_facing(template, first)
    body = task.layout.obstacle().moved(base.inverse())
    template.check_clear_of_base(body, "base_radius")
    shape = place(curve, template)
    on_contour = range(first, template.segments + 1)
    each = task.press / len(on_contour)
    presses = [Press(disk, each) for disk in on_contour] if task.press > 0 else []
    solver = RestShapeSolver(replace(template, obstacles=(body,)))
    found = solver.solve(shape, task.pulls, presses)
    if not found.shapes:
        raise NoRestShape(found.refused)
    rest, path = _proved(found.shapes, shape)
    gaps = _gaps(path.last)
    return FingerDesign(
        curve=curve,
        shape=shape,
        first_on_contour=first,
        rest=replace(rest, finger=replace(rest.finger, obstacles=())),
        path=path,
        gaps=gaps,
        heights=path.last.backbone[:, 2] - section.up,
    )


def _proved(shapes: tuple[RestShape, ...], wanted: DesiredShape) -> tuple[RestShape, PullPath]:
    """The first rest shape from which pulling leads to the wanted one, stable; else the first."""
    tried = []
    for rest in shapes:
        path = pull_from_rest(rest.finger, rest.pulls, wanted, _STEPS)
        tried.append((rest, path))
        if path.smooth and not path.unstable and path.last.certificate.stable:
            return rest, path
    return tried[0]


def _gaps(solution: Solution) -> np.ndarray:
    """Distance (n+1,) of each disk's nearest modelled point from the nearest obstacle [m]."""
    gaps = np.full(len(solution.backbone), np.inf)
    for points in (solution.backbone, *solution.cables.values(), *solution.antagonists.values()):
        for obstacle in solution.finger.obstacles:
            near = obstacle.signed_distance(points)
            gaps[: len(points)] = np.minimum(gaps[: len(points)], near)
    return gaps
