# SPDX-License-Identifier: Apache-2.0
"""What is measured: the groups of rows, in full and in quick mode."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

from ccr_ros.model import SolverSettings

from .baselines import BASELINES
from .cartesian import LITERAL, CartesianProblem, Formulation
from .cases import CONTACT, TABLE_I, Case, load_case
from .measure import OWN, BaselineSweeper, OwnSweeper, Plan, Sweeper
from .rest_shape import CURVES, EquilibriumSweeper, NestedSweeper, rest_case

STRAIGHT_BACKBONE = ("straight", "helical", "general_1", "general_2")
# Where the slow solvers are run with more disks: without contact, winding, pre-bent in contact.
FEW = ("straight", "general_1", "contact_cylinder")

# A frictionless cable, so that all solve the same physics; and because given span lengths leave a
# finger no way to yield to an obstacle (see the group "cable model").
COMPARED = Formulation(cable_model="frictionless")

LITERAL_TOTAL = replace(LITERAL, cable_model="frictionless")

GROUPS: dict[str, str] = {
    "sweep": "Warm sweeps from rest to the pull of Table I",
    "eq4": "Eq. 4 read literally, and as Eq. 1-3 mean it (IPOPT, cable spans given)",
    "cable-model": "Frictionless cable (total length given) or proportional spans (the paper's)",
    "discretisation": "Accuracy against arcs per segment and their order",
    "pulls": "Pulls that follow a path of the tip (200 points; 25 if quick)",
    "rest-shape": "Rest shapes for a wanted shape (errors: of the forward model, from rest)",
    "routing": "Routings for disk centres, found among 12 holes a disk",
    "grasp": "Fingers and the object they hold, solved together along a stream of pulls",
    "memory": "Peak resident memory of build and five steps, above the imported libraries",
    "transport": "Messages between two processes, and a node that idles",
}


@dataclass(frozen=True)
class Effort:
    """How much is measured.

    Attributes:
        steps: Of a sweep.
        repeats: Of the fast solvers' sweeps.
        cap: Seconds for a slow solver's sweep.
    """

    steps: int
    repeats: int
    cap: float


FULL = Effort(steps=20, repeats=6, cap=5.0)
QUICK = Effort(steps=5, repeats=2, cap=2.0)


def plans(quick: bool) -> Iterator[Plan]:
    """Yield every timed row in the order of the table."""
    effort = QUICK if quick else FULL
    yield from _sweeps(quick, effort)
    yield from _eq4(quick, effort)
    yield from _cable_models(quick, effort)
    yield from _discretisation(quick, effort)
    yield from _rest_shapes(quick, effort)


def memory_plans(quick: bool) -> list[tuple[str, str, int]]:
    """Return (method, case, n) of every memory row."""
    if quick:
        return [(method, name, 9) for name in ("straight", "ball") for method in (OWN, "ipopt")]
    small = [(method, "straight", 9) for method in (OWN, *BASELINES)]
    large = [("straight", 90), ("ball", 9)]  # the ball: in the hold of three fingers
    return small + [(method, name, n) for name, n in large for method in (OWN, "ipopt")]


def own(case: Case, settings: SolverSettings | None = None) -> Callable[[], Sweeper]:
    """Return the maker of this project's solver for a case."""
    return lambda: OwnSweeper(case.finger, settings)


def cartesian(
    case: Case, method: str = "ipopt", formulation: Formulation = COMPARED
) -> Callable[[], Sweeper]:
    """Return the maker of a baseline solver on the paper's formulation for a case."""
    return lambda: BaselineSweeper(BASELINES[method](CartesianProblem(case.finger, formulation)))


def _sweeps(quick: bool, effort: Effort) -> Iterator[Plan]:
    cases = ("straight", "contact_cylinder") if quick else TABLE_I + CONTACT
    for n in (9, 30) if quick else (9, 30, 90):
        for name in cases:
            case = load_case(name, n)

            def plan(
                method: str, make: Callable[[], Sweeper], fast: bool, case: Case = case, n: int = n
            ) -> Plan:
                repeats = effort.repeats if fast else 1
                # Where a slow solver needs seconds per step, time for a few.
                cap = 30.0 if fast else effort.cap * (2 if n == 30 else 1)
                return Plan("sweep", method, case, make, "ipopt", effort.steps, repeats, cap)

            yield plan(OWN, own(case), True)
            yield plan("ipopt", cartesian(case), True)
            if quick and n != 9:
                continue
            chords = Formulation(tangents="chord", cable_model="frictionless")
            yield plan("ipopt, chords", cartesian(case, formulation=chords), True)
            if n == 9 or name in FEW:
                for method in ("trust-constr", "slsqp"):
                    yield plan(method, cartesian(case, method), False)


def _eq4(quick: bool, effort: Effort) -> Iterator[Plan]:
    many = effort.steps if quick else 100
    first = f"relative, splines, {effort.steps} steps"
    variants = [
        (f"relative, splines, {effort.steps} steps", Formulation(), effort.steps),
        (f"relative, chords, {effort.steps} steps", Formulation(tangents="chord"), effort.steps),
        ("literal, chords, 1 step", LITERAL, 1),
        (f"literal, chords, {many} steps", LITERAL, many),
        ("literal, splines, 1 step", Formulation(angles="literal"), 1),
        (f"literal, splines, {many} steps", Formulation(angles="literal"), many),
        (f"literal, chords, {many} steps, total length", LITERAL_TOTAL, many),
    ]
    for name in ("general_1",) if quick else STRAIGHT_BACKBONE:
        case = load_case(name)
        for label, formulation, steps in variants:
            make = cartesian(case, formulation=formulation)
            yield Plan("eq4", label, case, make, first, steps)


def _cable_models(quick: bool, effort: Effort) -> Iterator[Plan]:
    names = ("general_1",) if quick else (*STRAIGHT_BACKBONE, "prebent_2_left", *CONTACT)
    for name in names:
        case = load_case(name)
        for model in ("frictionless", "proportional"):
            settings = SolverSettings(cable_model=model)
            make, first = own(case, settings), f"{OWN}, frictionless"
            yield Plan(
                "cable-model", f"{OWN}, {model}", case, make, first, effort.steps, effort.repeats
            )
        for model in ("frictionless", "proportional"):
            make = cartesian(case, formulation=Formulation(cable_model=model))
            yield Plan("cable-model", f"ipopt, {model}", case, make, first, effort.steps)


def _discretisation(quick: bool, effort: Effort) -> Iterator[Plan]:
    names = ("general_1",) if quick else (*STRAIGHT_BACKBONE, "prebent_2_left", "contact_cylinder")
    for name in names:
        case = load_case(name)
        for order, kind in ((0, "constant"), (1, "linear")):
            for arcs in (1, 2, 4, 8):
                settings = SolverSettings(curvature_order=order, arcs_per_segment=arcs)
                label = f"{kind}, {arcs} arc{'s' * (arcs > 1)}"
                yield Plan(
                    "discretisation",
                    label,
                    case,
                    own(case, settings),
                    "linear, 1 arc",
                    effort.steps,
                    2,
                )


def _rest_shapes(quick: bool, effort: Effort) -> Iterator[Plan]:
    baseline = "scipy least_squares, nested"
    for name in ("short",) if quick else tuple(CURVES):
        case, shape = rest_case(name)
        finger = case.finger
        equilibrium = partial(EquilibriumSweeper, finger, shape)
        yield Plan("rest-shape", OWN, case, equilibrium, baseline, effort.steps, effort.repeats)
        for method in ("least_squares",) if quick else ("least_squares", "slsqp"):
            nested = partial(NestedSweeper, finger, shape, method)
            label = f"scipy {method}, nested"
            yield Plan("rest-shape", label, case, nested, baseline, 1, cap=60 * effort.cap)
