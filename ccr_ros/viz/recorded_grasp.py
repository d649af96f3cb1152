# SPDX-License-Identifier: Apache-2.0
"""An object in the fingers as a recording has it: where it is pressed, how near to slipping."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..model import checks
from ..model.errors import InvalidValue
from ..model.rotation import Pose, quaternion_from_matrix
from .solids import array, label


@dataclass(frozen=True, eq=False)
class GripContact:
    """One place where a finger presses on the object, in the gripper's frame.

    Attributes:
        finger: Its name.
        position: (3,) [m].
        force: Normal force, in the recording's unit.
        friction: (3,) friction on the finger; same unit.
        margin: 1 - |friction| / (coefficient * force): 0 where it slips; None without friction.
    """

    finger: str
    position: np.ndarray
    force: float
    friction: np.ndarray
    margin: float | None = None

    def __post_init__(self) -> None:
        label("finger", self.finger)
        object.__setattr__(self, "position", array("position", self.position, (3,), "m"))
        object.__setattr__(self, "friction", array("friction", self.friction, (3,)))
        checks.real("force", self.force, low=0)
        if self.margin is not None:
            checks.real("margin", self.margin, low=0, high=1)


@dataclass(frozen=True, eq=False)
class GripFrame:
    """The object and its contacts at one moment.

    Attributes:
        object: Its name.
        held: Whether the fingers alone carry it.
        contacts: Where it is pressed.
    """

    object: str
    held: bool
    contacts: tuple[GripContact, ...] = ()

    def __post_init__(self) -> None:
        label("object", self.object)
        if not isinstance(self.held, bool):
            raise InvalidValue("held", self.held, "true or false")
        object.__setattr__(self, "contacts", tuple(self.contacts))

    @property
    def margin(self) -> float | None:
        """Smallest margin of the contacts; None where none has friction."""
        return min((c.margin for c in self.contacts if c.margin is not None), default=None)

    def margin_of(self, finger: str) -> float | None:
        """Return the smallest margin of a finger's contacts; None where none has friction."""
        own = (c.margin for c in self.contacts if c.finger == finger and c.margin is not None)
        return min(own, default=None)


def heading(pose: Pose, since: Pose) -> float:
    """Return by how much an object has turned about the gripper's z axis [rad], in -pi..pi.

    Of the turn that leads from one pose to the other, the part about z (its twist).
    """
    _, _, z, w = quaternion_from_matrix(pose.rotation @ since.rotation.T)
    return math.remainder(2.0 * math.atan2(z, w), math.tau)
