# SPDX-License-Identifier: Apache-2.0
"""What a finger of given stiffness, Poisson's ratio and cable stretch shows for measured pulls.

A cable of compliance k [m/N] that is pulled by p at its far end shortens by p - k T inside the
finger, T = EI tau its tension, so that with s = k EI the pull inside, q, solves

    q + s tau(q) = p                                                                       (1)

The pose depends on q and nu alone, and EI scales the tensions: shapes know s, loads know EI.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ccr_ros.model import checks
from ccr_ros.model.errors import InvalidValue, NotConverged, UnknownName
from ccr_ros.model.finger import Finger
from ccr_ros.model.sensitivity import torsion_response
from ccr_ros.model.solver import FingerSolver

_ROUNDS = 30  # of Newton's method on (1)
_EXACT = 1e-9  # of the finger's length; (1) is solved to this


@dataclass(frozen=True, eq=False)
class Measurement:
    """One measured row.

    Attributes:
        finger: The finger it was measured on; its Young's modulus does not matter.
        pulls: Pull at the cables' far ends [m], by cable; absent: 0.
        positions: (3,) measured centres [m], by disk, in the base frame.
        loads: Measured tensions [N], by cable.
        label: How messages name the row.
    """

    finger: Finger
    pulls: Mapping[str, float]
    positions: Mapping[int, np.ndarray]
    loads: Mapping[str, float]
    label: str = "row"

    def __post_init__(self) -> None:
        try:
            pulls = self.finger.pulls_array(self.pulls)
            names = self.finger.cable_names
            positions = {}
            for disk, point in self.positions.items():
                checks.integer("positions: disk", disk, low=1, high=self.finger.segments)
                positions[disk] = checks.vector(f"positions[{disk}]", point, 3, unit="m")
            for cable, load in self.loads.items():
                if cable not in names:
                    raise UnknownName("cable", cable, names)
                checks.real(f"loads.{cable}", load, above=0, high=1e6, unit="N")
            if not positions and not self.loads:
                raise InvalidValue("", None, "a row with a position or a load")
        except InvalidValue as error:
            raise error.located(self.label) from None
        object.__setattr__(self, "pulls", dict(zip(names, pulls.tolist(), strict=True)))
        object.__setattr__(self, "positions", positions)


@dataclass(frozen=True, eq=False)
class Shown:
    """What the model shows for a row, with derivatives.

    Attributes:
        points: (d, 3) centres of the measured disks [m].
        tensions: (l,) of the loaded cables, per EI [1/m^2].
        points_by_stretch, tensions_by_stretch: (d, 3, m) and (l, m), per s of each cable.
        points_by_nu, tensions_by_nu: (d, 3) and (l,).
    """

    points: np.ndarray
    tensions: np.ndarray
    points_by_stretch: np.ndarray
    tensions_by_stretch: np.ndarray
    points_by_nu: np.ndarray
    tensions_by_nu: np.ndarray


class RowModel:
    """One row's finger, solved warm for changing parameters."""

    def __init__(self, row: Measurement) -> None:
        self.row = row
        finger = row.finger
        self._pulls = np.array([row.pulls[name] for name in finger.cable_names])
        self._inside = self._pulls  # those of the last answer
        self._disks = list(row.positions)
        self._loaded = [finger.cable_names.index(name) for name in row.loads]
        self._solver = FingerSolver(replace(finger, youngs_modulus=None))

    def shown(self, stretch: np.ndarray, nu: float | None) -> Shown:
        """Return what is shown for s (m,) [m^3] of each cable, and nu (``None``: the finger's).

        Raises:
            NotConverged: The finger has no pose for the row's pulls.
        """
        solver = self._solver_for(self.row.finger.poisson_ratio if nu is None else nu)
        inside = self._inside
        for _ in range(_ROUNDS):
            solution = solver.solve(inside)
            if not solution.certificate.converged:
                message = f"{self.row.label}: {solution.certificate.message}"
                raise NotConverged(self.row.finger.name, message)
            slopes = solver.sensitivity()
            off = self._pulls - inside - stretch * solution.tensions
            system = np.eye(len(inside)) + stretch[:, None] * slopes.tensions
            if np.abs(off).max() <= _EXACT * self.row.finger.length:
                break
            inside = inside + np.linalg.solve(system, off)
        else:
            message = f"{self.row.label}: the stretched cables' pulls were not found"
            raise NotConverged(self.row.finger.name, message)
        self._inside = inside
        by_nu, tensions_by_nu = torsion_response(solver.problem, solver.point)
        # The pulls inside change with s, and with nu: (1), differentiated.
        by_stretch = -np.linalg.solve(system, np.diag(solution.tensions))
        eased = -np.linalg.solve(system, stretch * tensions_by_nu)
        disks, loaded = self._disks, self._loaded
        return Shown(
            solution.backbone[disks],
            solution.tensions[loaded],
            slopes.disks[disks] @ by_stretch,
            (slopes.tensions @ by_stretch)[loaded],
            (by_nu + slopes.disks @ eased)[disks],
            (tensions_by_nu + slopes.tensions @ eased)[loaded],
        )

    def _solver_for(self, nu: float) -> FingerSolver:
        if self._solver.finger.poisson_ratio != nu:
            self._solver = FingerSolver(replace(self._solver.finger, poisson_ratio=nu))
        return self._solver
