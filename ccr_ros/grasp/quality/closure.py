# SPDX-License-Identifier: Apache-2.0
"""Force closure: can contacts with friction balance every wrench on the object?

The contacts' wrenches form a convex cone K. They balance everything if and only if K is all of R^6
(Murray, Li and Sastry 1994, section 5.2), that is, if the cones span R^6 and -s lies in K, where
s, the sum of all unit normal forces, is inside K. Whether -s lies in K is a problem of nonnegative
least squares over edges of the cones. Where it fails, what is left over is a direction against
which new edges are taken from the round cones themselves; if none leans that way, the direction
separates, and that is the proof that there is no force closure. So either answer is exact to
rounding, whatever the number of edges to begin with.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ccr_ros.model.errors import MissingPackage

from .contact import FrictionContact
from .wrenches import ContactWrenches, contact_wrenches

_EDGES = 6  # to begin with
_ROUNDS = 60
_TOLERANCE = 1e-9  # of unit wrenches


@dataclass(frozen=True, eq=False)
class Closure:
    """Whether contacts can balance every wrench.

    Attributes:
        closed: They can.
        weakest: (6,) else a unit wrench (force, moment / length) that, put on the object, they
            cannot balance at all; None if they can balance every one.
    """

    closed: bool
    weakest: np.ndarray | None


def force_closure(
    contacts: Sequence[FrictionContact], centre: np.ndarray, length: float | None = None
) -> Closure:
    """Tell whether contacts can balance every wrench, if they may press as hard as it takes.

    Round friction cones, not linearised ones. A grasp at the very edge counts as not closed.

    Raises:
        InvalidValue: See `contact_wrenches`.
        MissingPackage: scipy is not installed.
    """
    return closure_of(contact_wrenches(contacts, centre, length))


def closure_of(wrenches: ContactWrenches) -> Closure:
    """Tell the same of wrenches."""
    try:
        from scipy.optimize import nnls
    except ImportError:
        raise MissingPackage("grasp quality", "scipy", "quality") from None
    missing = wrenches.missing()
    if missing is not None:
        return Closure(False, missing)
    wanted = -wrenches.normal.sum(axis=0)
    size = float(np.linalg.norm(wanted))
    if size < _TOLERANCE:  # the normal forces balance by themselves
        return Closure(True, None)
    columns = wrenches.edges(_EDGES).reshape(-1, 6)
    for _ in range(_ROUNDS):
        shares, _ = nnls(columns.T, wanted)
        left = wanted - shares @ columns
        if np.linalg.norm(left) <= _TOLERANCE * (size + shares.sum()):
            return Closure(True, None)
        direction = left / np.linalg.norm(left)
        reach, points = wrenches.reach(direction[None])
        leaning = reach[0] > _TOLERANCE
        if not leaning.any():
            return Closure(False, -direction)
        columns = np.concatenate([columns, points[0, leaning]])
    return Closure(False, -direction)
