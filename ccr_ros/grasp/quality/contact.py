# SPDX-License-Identifier: Apache-2.0
"""A point contact with Coulomb friction, as the measures of grasp quality see it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from ccr_ros.model import checks
from ccr_ros.model.errors import InvalidValue

_LARGEST_FRICTION = 100.0
_TANGENT = 1e-6  # share of a friction force that may be normal: rounding of what others computed


@dataclass(frozen=True, eq=False)
class FrictionContact:
    """One point where something presses on the object and does not slip by itself.

    All vectors in one frame, the gripper's as a rule. Forces are on the finger, as those of
    `ccr_ros.grasp.statics.ObjectContact`: the object feels the opposite.

    Attributes:
        position: (3,) [m].
        normal: (3,) out of the object; any length but zero, kept as a unit vector.
        friction: Coulomb coefficient mu >= 0.
        force: [N] >= 0, the present normal force along ``normal``; 0 if none is known.
        friction_force: (3,) [N] the present tangential force.
        limit: [N] >= 0, the largest normal force that may come to act here; inf: any.

    Raises:
        InvalidValue: A value is out of range, or the friction force is not tangential.
    """

    position: np.ndarray
    normal: np.ndarray
    friction: float
    force: float = 0.0
    friction_force: np.ndarray = field(default_factory=lambda: np.zeros(3))
    limit: float = math.inf

    def __post_init__(self) -> None:
        def keep(name: str, value: object) -> None:
            object.__setattr__(self, name, value)

        keep("position", checks.vector("position", self.position, 3, unit="m", largest=1e3))
        keep("normal", checks.direction("normal", self.normal))
        keep("friction", checks.real("friction", self.friction, low=0, high=_LARGEST_FRICTION))
        keep("force", checks.real("force", self.force, low=0, unit="N"))
        keep("friction_force", checks.vector("friction_force", self.friction_force, 3, unit="N"))
        if not (isinstance(self.limit, float) and self.limit == math.inf):
            keep("limit", checks.real("limit", self.limit, low=0, unit="N"))
        along = abs(float(self.friction_force @ self.normal))
        if along > _TANGENT * max(self.force, float(np.linalg.norm(self.friction_force))):
            raise InvalidValue(
                "friction_force", self.friction_force, "tangential, across the contact's normal"
            )

    @property
    def margin(self) -> float:
        """1 - |friction force| / (mu normal force): 1 without, 0 where it slips, < 0 beyond.

        nan where nothing is to be said: without friction, or without a normal force.
        """
        largest = self.friction * self.force
        if largest <= 0:
            return math.nan
        return 1.0 - float(np.linalg.norm(self.friction_force)) / largest


def friction_margin(contacts: Iterable[FrictionContact]) -> float:
    """Return the smallest margin of the contacts that have one; nan if none has."""
    margins = [c.margin for c in contacts]
    return min((m for m in margins if not math.isnan(m)), default=math.nan)
