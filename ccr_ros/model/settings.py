# SPDX-License-Identifier: Apache-2.0
"""Settings of the equilibrium problem and its solver."""

from __future__ import annotations

from dataclasses import dataclass

from . import checks
from .errors import InvalidValue
from .finger import Finger

_FINE = 24  # segments; there one constant arc each is off by less than 0.04 % of the length


@dataclass(frozen=True)
class SolverSettings:
    """How the equilibrium is discretised and solved.

    Attributes:
        arcs_per_segment: Number of arcs a segment is made of; of each piece of a segment, where
            the rest curvature is linear along several pieces.
        curvature_order: 1: curvature linear along each arc, as close to the rod as four arcs of
            constant curvature; 0: constant-curvature arcs; ``None`` (default): 1 for fingers of
            fewer than 24 segments, or whose rest curvature varies along segments;
            0 where segments are so short that it makes no difference.
        cable_model: ``"frictionless"``: a cable's total length is bounded, its tension uniform;
            ``"proportional"``: each span's length is bounded, as in the paper's section 2.2.2.
        max_pull_step: Largest pull change of one continuation step, as a fraction of the finger's
            length.
        max_iterations: Of one continuation step.
        tolerance: Largest residual force relative to the elastic one, and largest constraint
            violation relative to the finger's length.
        time_limit: CPU time of one search [s], so that a busy machine does not end it; a solve is
            one search, or a second one from rest where obstacles have stopped the first.
    """

    arcs_per_segment: int = 1
    curvature_order: int | None = None
    cable_model: str = "frictionless"
    max_pull_step: float = 0.02
    max_iterations: int = 25
    tolerance: float = 1e-9
    time_limit: float = 2.0

    def __post_init__(self) -> None:
        checks.integer("arcs_per_segment", self.arcs_per_segment, low=1, high=64)
        if self.curvature_order is not None:
            checks.integer("curvature_order", self.curvature_order, low=0, high=1)
        if self.cable_model not in ("frictionless", "proportional"):
            raise InvalidValue("cable_model", self.cable_model, "'frictionless' or 'proportional'")
        checks.real("max_pull_step", self.max_pull_step, above=0, high=1)
        checks.integer("max_iterations", self.max_iterations, low=1)
        checks.real("tolerance", self.tolerance, above=0, high=1e-3)
        checks.real("time_limit", self.time_limit, above=0, unit="s")

    def order(self, finger: Finger) -> int:
        """Return the curvature order used for a finger.

        One whose rest curvature varies along its segments is not held to constant arcs.
        """
        if self.curvature_order is not None:
            return self.curvature_order
        return 1 if finger.segments < _FINE or finger.rest_varies else 0
