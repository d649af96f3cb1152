# SPDX-License-Identifier: Apache-2.0
"""The largest load along a direction that contacts can balance within limits of their forces.

    max t   such that   t w + sum_i (contact wrench)_i = 0,
                        each in its friction cone, normal force_i <= limit_i

A linear program over edges of the cones; its multipliers u price every wrench, and each contact's
own dearest wrench under them joins the edges until none is worth it (column generation). What the
edges can carry is a lower bound. With u scaled to u.w = -1, every t that can be balanced is at
most  sum_i limit_i max(0, reach_i(u)),  which is the upper bound; both meet at the answer of the
round cones. That the forces can be spread so is a statement about rigid contacts: which forces
the fingers do put on the object is another question.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ccr_ros.model import checks
from ccr_ros.model.errors import InvalidValue, MissingPackage

from .contact import FrictionContact
from .wrenches import ContactWrenches, contact_wrenches

_EDGES = 8
_ROUNDS = 60
_UNBOUNDED = 3  # status of scipy's linprog
_NOTHING = 1e-9  # reach of a unit wrench that counts as none


@dataclass(frozen=True, eq=False)
class LargestLoad:
    """How often a load can be balanced, between two bounds.

    Attributes:
        lower, upper: The factor lies between; both inf if there is no largest one. They agree to
            the tolerance unless the contacts are at an edge between nothing and everything.
        forces: (n, 3) [N] on the object at the contacts that balance ``lower`` times the load;
            zeros if that is inf.
    """

    lower: float
    upper: float
    forces: np.ndarray


def largest_load(
    contacts: Sequence[FrictionContact],
    centre: np.ndarray,
    force: np.ndarray,
    moment: np.ndarray | None = None,
    tolerance: float = 1e-6,
) -> LargestLoad:
    """Return how many times a load on the object can be balanced within the contacts' limits.

    Args:
        contacts: Positions, normals, friction and limits count; present forces do not.
        centre: (3,) [m] of the object.
        force: (3,) [N] on the object; of one newton, the factor is a load in newtons.
        moment: (3,) [N m] about the centre; None: none.
        tolerance: Wanted of the bounds, (upper - lower) / upper.

    Raises:
        InvalidValue: A value is out of range, or the load is zero.
        MissingPackage: scipy is not installed.
    """
    tolerance = checks.real("tolerance", tolerance, low=1e-7, high=1)
    middle = checks.vector("centre", centre, 3, unit="m", largest=1e3)
    push = checks.vector("force", force, 3, unit="N", largest=1e6)
    turn = checks.vector("moment", np.zeros(3) if moment is None else moment, 3, unit="N m",
                         largest=1e6)  # fmt: skip
    # A moment needs no length here; that of the contacts keeps the program's numbers alike.
    at_centre = all(np.allclose(c.position, middle, atol=1e-9, rtol=0) for c in contacts)
    wrenches = contact_wrenches(contacts, middle, 1.0 if at_centre else None)
    load = np.concatenate([push, turn / wrenches.length])
    size = float(np.linalg.norm(load))
    if size < 1e-12:
        raise InvalidValue("force", force, "a load that is not zero (or give a moment)")
    factor, upper, found = _largest(wrenches, load / size, tolerance)
    return LargestLoad(factor / size, upper / size, found[:, :3])


def _largest(
    wrenches: ContactWrenches, load: np.ndarray, tolerance: float
) -> tuple[float, float, np.ndarray]:
    """Return bounds of the factor of a unit load, and the contact wrenches (n, 6) of the lower."""
    try:
        from scipy.optimize import linprog
    except ImportError:
        raise MissingPackage("grasp quality", "scipy", "quality") from None
    count = len(wrenches.limits)
    bounded = np.isfinite(wrenches.limits)
    scale = float(wrenches.limits[bounded].max(initial=0.0)) or 1.0
    limits = wrenches.limits / scale
    edges = wrenches.edges(_EDGES)
    columns = edges.reshape(-1, 6)
    owner = np.repeat(np.arange(count), edges.shape[1])
    lower, upper, found = 0.0, np.inf, np.zeros((count, 6))
    for _ in range(_ROUNDS):
        caps = (owner[None] == np.flatnonzero(bounded)[:, None]).astype(float)
        program = linprog(
            np.append(np.zeros(len(columns)), -1.0),
            A_ub=np.column_stack([caps, np.zeros(len(caps))]) if len(caps) else None,
            b_ub=limits[bounded] if len(caps) else None,
            A_eq=np.column_stack([columns.T, load]),
            b_eq=np.zeros(6),
            method="highs",
        )
        if program.status == _UNBOUNDED:
            return np.inf, np.inf, np.zeros((count, 6))
        if program.status != 0:  # pragma: no cover - zero is always feasible
            break
        lower = max(0.0, float(program.x[-1]))
        found = np.zeros((count, 6))
        np.add.at(found, owner, program.x[:-1, None] * columns)
        direction = program.eqlin.marginals
        priced = -float(direction @ load)
        if priced <= 0:
            break
        reach, points = wrenches.reach(direction[None] / priced)
        worth = np.where(reach[0] > _NOTHING, reach[0], 0.0)
        needed = np.where(bounded, np.where(bounded, limits, 0.0) * worth,
                          np.where(worth > 0, np.inf, 0.0))  # fmt: skip
        upper = min(upper, float(needed.sum()))
        if upper - lower <= tolerance * upper:
            break
        new = worth > 0
        columns = np.concatenate([columns, points[0, new]])
        owner = np.concatenate([owner, np.flatnonzero(new)])
    return lower * scale, max(upper, lower) * scale, found * scale
