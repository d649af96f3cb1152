# SPDX-License-Identifier: Apache-2.0
"""How much a held object gives way to a small load, and to which most.

Found by loading the object a little along each axis, both ways, and looking where it goes; so
fingers, cables, contacts that stick and contacts that slip are all in it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ccr_ros.grasp.statics.solver import GraspSolver
from ccr_ros.model import checks
from ccr_ros.model.errors import InvalidValue, NotConverged
from ccr_ros.model.rotation import Pose

from .wrenches import wrench_in_words

_SMALL = 1e-3  # of the grip


@dataclass(frozen=True, eq=False)
class Compliance:
    """Motion of a held object under small loads; lengths in m, moments divided by ``length``.

    Attributes:
        matrix: (6, 6) [m/N] motion (translation, length times rotation vector) of the object's
            centre per wrench (force, moment / length) on it. Symmetric where nothing slips. If
            there is a wrench that is not resisted at all, inf where that stands, else nan.
        softest: (6,) the unit wrench along which it gives way most.
        softest_in_words: The same, as "a moment about z".
        stiffness: [N/m] against that wrench; 0 if it is not resisted at all.
        length: [m] by which moments are divided.
    """

    matrix: np.ndarray
    softest: np.ndarray
    softest_in_words: str
    stiffness: float
    length: float


def compliance_of(solver: GraspSolver, length: float | None = None) -> Compliance:
    """Return how a held object gives way, and leave the solver as it was.

    Args:
        solver: It holds an object without support.
        length: [m] by which moments are divided; None: the largest distance of a contact from the
            object's centre.

    Raises:
        InvalidValue: The length is out of range, or the object is supported or not touched.
        NotConverged: The solver does not stand in a stable equilibrium.
    """
    if solver.supported:
        raise InvalidValue("solver", "with a supported object", "one whose object was let go")
    begin = solver.standing
    try:
        start = solver.solve({}).require_converged()
        if not start.stable:
            raise NotConverged("grasp", start.message)
        if not start.contacts:
            raise InvalidValue("solver", "without contacts", "one that holds an object")
        pose = start.body.pose
        arms = [np.linalg.norm(c.position - pose.position) for c in start.contacts]
        length = checks.real("length", max(arms) if length is None else length, above=0, unit="m")
        size = _SMALL * sum(c.force for c in start.contacts)
        matrix = np.full((6, 6), np.nan)
        for axis in range(6):
            ends = []
            for sign in (1.0, -1.0):
                solver.resume(begin)
                wrench = begin.outer.copy()
                wrench[axis] += sign * size * (1.0 if axis < 3 else length)
                moved = solver.solve({}, force=wrench[:3], moment=wrench[3:], snap=False)
                if not moved.converged:  # nothing resists it
                    softest = sign * np.eye(6)[axis]
                    matrix[:] = np.nan
                    matrix[axis, axis] = np.inf
                    return Compliance(matrix, softest, wrench_in_words(softest), 0.0, length)
                ends.append(_motion(pose, moved.body.pose, length))
            matrix[:, axis] = (ends[0] - ends[1]) / (2.0 * size)
    finally:
        solver.resume(begin)
    values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    softest = vectors[:, -1] * (1.0 if vectors[np.abs(vectors[:, -1]).argmax(), -1] > 0 else -1.0)
    stiffness = float(1.0 / values[-1]) if values[-1] > 0 else 0.0
    return Compliance(matrix, softest, wrench_in_words(softest), stiffness, length)


def _motion(before: Pose, after: Pose, length: float) -> np.ndarray:
    """Small motion (6,) from one pose to another: translation, and length times rotation vector."""
    turn = after.rotation @ before.rotation.T
    about = 0.5 * np.array(
        [turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]
    )
    return np.concatenate([after.position - before.position, length * about])
