# SPDX-License-Identifier: Apache-2.0
"""What a solve gives: the pose, what acts on it, and the certificate of how good it is."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from .errors import NotConverged
from .finger import Finger
from .rod import centerline
from .rotation import Pose, quaternion_from_matrix

_CENTERLINE_POINTS = 8  # per segment


@dataclass(frozen=True)
class Certificate:
    """How well a pose satisfies the equilibrium conditions.

    Attributes:
        converged: The pose is an equilibrium for the wanted pulls, to the solver's tolerances.
        stable: The reduced Hessian is positive definite: the pose is a strict minimum of energy.
        kkt: Largest unbalanced generalised force, relative to the largest elastic one (or to 1).
        cable_error: Largest error of a cable's length [m]: of a taut cable either way, of a slack
            one by how much it is too long.
        penetration: Deepest penetration of an obstacle [m]; 0 if none.
        smallest_eigenvalue: Of the reduced Hessian, relative to the unloaded rod's own stiffness:
            1 for a free rod at rest, 0 at a branch point, negative for a saddle. nan in a grasp,
            where it is that of the whole which counts.
        iterations: Number of QP steps taken, all sub-steps included.
        solve_time: Wall time [s].
        branch_jump: The pose could not be reached continuously from the last one: it lies on
            another branch of equilibria (snap-through).
        substeps: Number of continuation steps from the last pose.
        message: One line for people: what happened if not converged, or what to beware of.
    """

    converged: bool
    stable: bool
    kkt: float
    cable_error: float
    penetration: float
    smallest_eigenvalue: float
    iterations: int
    solve_time: float
    branch_jump: bool = False
    substeps: int = 1
    message: str = ""


@dataclass(frozen=True, eq=False)
class Contact:
    """One point of the finger pressed against an obstacle.

    Attributes:
        disk: Index of the disk, 0 = base.
        point: ``"backbone"``, ``"cable"`` or ``"antagonist"`` (opposite the cable's hole).
        cable: Name of the cable that ``point`` refers to; ``""`` for the backbone.
        obstacle: Name of the obstacle.
        position: (3,) point of contact in the finger's base frame [m].
        normal: (3,) unit normal, outward from the obstacle, on which the force on the finger acts.
        force: Normal force, >= 0 [N, or 1/m^2 per EI].
    """

    disk: int
    point: str
    cable: str
    obstacle: str
    position: np.ndarray
    normal: np.ndarray
    force: float


@dataclass(frozen=True, eq=False)
class Solution:
    """The pose of a finger in equilibrium, in its base frame.

    Attributes:
        finger: The finger that was solved.
        pulls: (m,) cable pulls [m].
        backbone: (n+1, 3) disk centres, base to tip [m].
        frames: (n+1, 3, 3) disk frames; columns are the axes, z along the backbone.
        cables: Cable points {name: (k+1, 3)}, one per disk up to the cable's last [m].
        antagonists: Points opposite the cable holes {name: (k+1, 3)}: 2 x0 - xa [m].
        tensions: (m,) cable tensions, >= 0 [N, or 1/m^2 per EI]; what the base end feels.
        contacts: The active contacts.
        energy: Elastic energy [J, or 1/m per EI].
        curvature: (n, arcs, order + 1, 3) curvature coefficients [1/m] of each arc in its local
            frame: mean, and (order 1) the linear part in the Legendre coordinate s in [-1, 1].
        certificate: How good the pose is.
    """

    finger: Finger
    pulls: np.ndarray
    backbone: np.ndarray
    frames: np.ndarray
    cables: dict[str, np.ndarray]
    antagonists: dict[str, np.ndarray]
    tensions: np.ndarray
    contacts: tuple[Contact, ...]
    energy: float
    curvature: np.ndarray
    certificate: Certificate

    @cached_property
    def centerline(self) -> np.ndarray:
        """Dense points (p, 3) of the backbone curve, disk centres included [m]."""
        n, arcs, order = self.curvature.shape[:3]
        points = -(-_CENTERLINE_POINTS // arcs)
        return centerline(self.curvature.reshape(n * arcs, order, 3), self.finger.length, points)

    @property
    def quaternions(self) -> np.ndarray:
        """Disk orientations (n+1, 4) as (x, y, z, w)."""
        return quaternion_from_matrix(self.frames)

    @property
    def tip(self) -> Pose:
        """Pose of the tip disk in the finger's base frame."""
        return Pose(self.backbone[-1], quaternion_from_matrix(self.frames[-1]))

    @property
    def slack(self) -> np.ndarray:
        """(m,) true where a cable carries no tension."""
        return self.tensions <= 0.0

    def require_converged(self) -> Solution:
        """Return self.

        Raises:
            NotConverged: The certificate says so.
        """
        if not self.certificate.converged:
            raise NotConverged(self.finger.name, self.certificate.message)
        return self

    def to_dict(self) -> dict[str, Any]:
        """Return the solution as plain lists and numbers, ready for JSON."""
        c = self.certificate
        return {
            "finger": self.finger.name,
            "pulls": dict(zip(self.finger.cable_names, self.pulls.tolist(), strict=True)),
            "backbone": self.backbone.tolist(),
            "frames": self.quaternions.tolist(),
            "cables": {name: points.tolist() for name, points in self.cables.items()},
            "tensions": dict(zip(self.finger.cable_names, self.tensions.tolist(), strict=True)),
            "forces_are": self.finger.forces_are,
            "contacts": [
                {
                    "disk": k.disk,
                    "point": k.point,
                    "cable": k.cable,
                    "obstacle": k.obstacle,
                    "position": k.position.tolist(),
                    "normal": k.normal.tolist(),
                    "force": k.force,
                }
                for k in self.contacts
            ],
            "energy": self.energy,
            "certificate": {
                "converged": c.converged,
                "stable": c.stable,
                "kkt": c.kkt,
                "cable_error": c.cable_error,
                "penetration": c.penetration,
                "smallest_eigenvalue": c.smallest_eigenvalue,
                "branch_jump": c.branch_jump,
                "iterations": c.iterations,
                "substeps": c.substeps,
                "solve_ms": c.solve_time * 1e3,
                "message": c.message,
            },
        }
