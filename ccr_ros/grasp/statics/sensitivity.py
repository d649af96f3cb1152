# SPDX-License-Identifier: Apache-2.0
"""How the object and the contact forces answer to small changes of the pulls."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ccr_ros.model.errors import InvalidValue, NotConverged
from ccr_ros.model.sqp import ACTIVE, Bounds

from .newton import newton_step
from .solver import GraspSolver

_STEP = 1e-6  # of the finger's length


@dataclass(frozen=True, eq=False)
class GraspSensitivity:
    """Derivatives of a grasp with respect to the M pulls of all fingers, in the fingers' order.

    They hold while what sticks sticks, what slips slips on, and no contact comes or goes. Contacts
    are those of the solution, and in its order.

    Attributes:
        cables: (M,) names, ``finger.cable``.
        motion: (6, M) of the object: translation [m/m] and rotation vector [rad/m], in the
            gripper's frame.
        normal: (k, M) of the contacts' normal forces [N/m].
        along: (k, 3, M) of the friction forces on the fingers [N/m], in the gripper's frame, but
            for their turning with the object.
        tensions: (M, M) of the cables' tensions [N/m].
    """

    cables: tuple[str, ...]
    motion: np.ndarray
    normal: np.ndarray
    along: np.ndarray
    tensions: np.ndarray


def grasp_sensitivity(solver: GraspSolver) -> GraspSensitivity:
    """Return the derivatives at the pose where a solver stands.

    Newton's step from an equilibrium under slightly other bounds is the answer to first order.

    Args:
        solver: After a solve that converged.

    Raises:
        InvalidValue: Nothing was solved before.
        NotConverged: The equilibrium is singular.
    """
    at, hand = solver.point, solver.hand
    if at is None:
        raise InvalidValue("sensitivity", None, "asked for after a solve")
    zero = list(solver.pulls.values())
    contacts = [  # as `result` lists and sorts them
        (mounted.finger.name, label.disk, label.point, label.cable, index, int(row))
        for index, (mounted, part) in enumerate(zip(hand.mounted, at.blocks, strict=True))
        for row in part.touch[part.point.multipliers[part.touch] > ACTIVE]
        for label in [
            hand.problems[index].points.labels[part.point.pairs[row - len(part.point.tensions), 1]]
        ]
    ]
    contacts.sort()
    names: list[str] = []
    tables: tuple[list[np.ndarray], ...] = ([], [], [], [])  # motion, normal, along, tensions
    base = _answer(solver, zero, contacts)
    for index, mounted in enumerate(hand.mounted):
        for cable, name in enumerate(mounted.finger.cable_names):
            size = _STEP * mounted.finger.length
            pulls = [p.copy() for p in zero]
            pulls[index][cable] += size
            moved = _answer(solver, pulls, contacts)
            names.append(f"{mounted.finger.name}.{name}")
            for table, new, old in zip(tables, moved, base, strict=True):
                table.append((new - old) / size)
    return GraspSensitivity(tuple(names), *(np.stack(table, axis=-1) for table in tables))


def _answer(
    solver: GraspSolver, pulls: list[np.ndarray], contacts: list
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Motion, normal and friction forces and tensions after a Newton step to other pulls."""
    at, hand = solver.point, solver.hand
    assert at is not None
    bounds = [
        Bounds(p.length_bounds(u), np.zeros_like(part.point.forces))
        for p, u, part in zip(hand.problems, pulls, at.blocks, strict=True)
    ]
    step = newton_step(hand, at, bounds, free=not solver.supported)
    if step is None:
        raise NotConverged("grasp", "the equilibrium is singular: its answer to pulls is not known")
    motion = step.body * np.array([hand.length] * 3 + [1.0] * 3)
    normal, along = np.zeros(len(contacts)), np.zeros((len(contacts), 3))
    for k, (*_, index, row) in enumerate(contacts):
        part, problem = at.blocks[index], hand.problems[index]
        unit = problem.finger.bending_stiffness / problem.finger.length**2
        normal[k] = step.multipliers[index][row] * unit
        of = np.flatnonzero(part.friction.index == row)
        if len(of):
            local = step.friction[index][of[0]] @ part.friction.tangents[of[0]] * unit
            along[k] = hand.mounted[index].base.vectors(local)
    pulling = []
    for index, problem in enumerate(hand.problems):
        unit = problem.finger.bending_stiffness / problem.finger.length**2
        count = len(at.blocks[index].point.tensions)
        pulling.append(step.multipliers[index][:count][problem.base_group] * unit)
    return motion, normal, along, np.concatenate(pulling)
