# SPDX-License-Identifier: Apache-2.0
"""The load at which a grasp slips and at which it is lost, by pulling on the held object.

Unlike `largest_load`, which asks what rigid contacts could balance, this follows the equilibrium of
elastic fingers and object (`ccr_ros.grasp.statics`) as the load grows: the cables stay as they are,
the fingers give way, contacts stick, slip, come and go.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ccr_ros.grasp.statics.result import GraspSolution, ObjectContact
from ccr_ros.grasp.statics.solver import GraspSolver, GraspStanding
from ccr_ros.model import checks
from ccr_ros.model.errors import InvalidValue, NotConverged

_FIRST_STEP = 0.1  # of the grip: as far as the solver goes in one of its own steps
_LARGEST_STEP = 0.5
_FARTHEST = 10.0  # by default, of the grip


@dataclass(frozen=True, eq=False)
class SlipLoads:
    """How a grasp gives way to a growing load along a direction.

    Loads are forces through the object's centre [N], what acts along the direction from the start
    (its weight, as a rule) included.

    Attributes:
        direction: (3,) unit vector of the load in the gripper's frame.
        present: The load at the start.
        slipping: Contacts that slip already at the start, as "finger_1 disk 9 cable".
        slips_at: The load at which a contact that sticks begins to slip; ``lost_at`` if none does
            before all is lost; inf if nothing happens up to the largest load.
        first: Which contacts these are, in words; "" if there are none.
        held: The largest load found at which the grasp is in a stable equilibrium.
        lost_at: The smallest found at which it is not; inf if there is none up to the largest
            load.
        last: The solution at ``held``.
    """

    direction: np.ndarray
    present: float
    slipping: tuple[str, ...]
    slips_at: float
    first: str
    held: float
    lost_at: float
    last: GraspSolution


def payload_until_slip(
    solver: GraspSolver,
    direction: np.ndarray | None = None,
    largest: float | None = None,
    tolerance: float = 0.01,
) -> SlipLoads:
    """Pull on a held object until it is lost, and leave the solver as it was.

    Args:
        solver: It holds an object without support.
        direction: (3,) of the load in the gripper's frame; None: gravity's.
        largest: [N] the largest load to ask for; None: ten times the normal forces' sum more.
        tolerance: Of the loads found, relative to them or to the grip, whichever is more.

    Raises:
        InvalidValue: A value is out of range, or the object is supported.
        NotConverged: The solver does not stand in a stable equilibrium.
    """
    if solver.supported:
        raise InvalidValue("solver", "with a supported object", "one whose object was let go")
    tolerance = checks.real("tolerance", tolerance, low=1e-4, high=0.5)
    along = checks.direction("direction", solver.gravity if direction is None else direction)
    begin = solver.standing
    try:
        walk = _Walk(solver, along, begin, tolerance)
        if largest is None:
            largest = walk.present + _FARTHEST * walk.grip
        walk.until_lost(checks.real("largest", largest, above=walk.present, unit="N"))
    finally:
        solver.resume(begin)
    return SlipLoads(
        direction=along,
        present=walk.present,
        slipping=tuple(_name(c) for c in walk.start.contacts if c.status == "slip"),
        slips_at=min(walk.slips_at, walk.lost_at),
        first=walk.first,
        held=walk.held,
        lost_at=walk.lost_at,
        last=walk.last,
    )


class _Walk:
    """A load that grows on a held object.

    Attributes:
        present: [N] the load along the direction at the start.
        grip: [N] sum of the normal forces at the start.
        held: [N] the largest load so far in a stable equilibrium; last: its solution.
        lost_at: [N] the smallest so far without one.
        slips_at, first: As in `SlipLoads`.
    """

    def __init__(
        self, solver: GraspSolver, along: np.ndarray, begin: GraspStanding, tolerance: float
    ) -> None:
        self._solver, self._along, self._outer = solver, along, begin.outer[:3]
        self._tolerance = tolerance
        self.present = float((self._outer + begin.body.mass * solver.gravity) @ along)
        self.start = self.last = solver.solve({}).require_converged()
        if not self.start.stable:
            raise NotConverged("grasp", self.start.message)
        self.grip = max(sum(contact.force for contact in self.start.contacts), 1e-6)
        self._standing = solver.standing
        self.held, self.lost_at = self.present, math.inf
        self.slips_at, self.first = math.inf, ""

    def until_lost(self, largest: float) -> None:
        """Walk until the loads that are held and lost are close, or the largest is held."""
        step, guess = _FIRST_STEP * self.grip, math.nan
        while self.held < largest and self.lost_at - self.held > 2.0 * self._width:
            known = math.isfinite(self.lost_at)
            guessed = self.held < guess < self.lost_at
            ahead = 0.5 * (self.held + self.lost_at) if known else min(self.held + step, largest)
            target = guess if guessed else ahead
            guess = math.nan
            found = self._at(target)
            if found.converged and found.stable:
                self._accept(target, found)
                step = min(2.0 * step, _LARGEST_STEP * self.grip)
                if guessed:  # is that all?
                    guess = self.held + 1.5 * self._width
                continue
            self._solver.resume(self._standing)
            self.lost_at = target
            if not found.converged:  # what it shows is the last equilibrium on its way
                near = self.held + 1.5 * self._width
                guess = max(self._carried(found) - 0.1 * self._width, near)

    @property
    def _width(self) -> float:
        return 0.5 * self._tolerance * max(abs(self.held), self.grip)

    def _at(self, load: float) -> GraspSolution:
        force = self._outer + (load - self.present) * self._along
        return self._solver.solve({}, force=force, snap=False)

    def _carried(self, solution: GraspSolution) -> float:
        """Load along the direction that contacts balance: what they do to the fingers."""
        on_fingers = [c.force * c.normal + c.friction_force for c in solution.contacts]
        return float(sum(on_fingers, np.zeros(3)) @ self._along)

    def _accept(self, load: float, found: GraspSolution) -> None:
        after = self._solver.standing
        if not self.first and _started(self.last, found):
            self._find_onset(load)
            self._solver.resume(after)
        self.held, self.last, self._standing = load, found, after

    def _find_onset(self, slips: float) -> None:
        """Halve the way from a load at which all stick to one at which something slips."""
        sticks, last, standing = self.held, self.last, self._standing
        self._solver.resume(standing)
        found = self._at(slips)
        self.slips_at, self.first = slips, ", ".join(_started(last, found))
        while self.slips_at - sticks > self._width:
            middle = 0.5 * (sticks + self.slips_at)
            self._solver.resume(standing)
            found = self._at(middle)
            started = _started(last, found)
            if found.converged and started:
                self.slips_at, self.first = middle, ", ".join(started)
            elif found.converged:
                sticks, last, standing = middle, found, self._solver.standing
            else:
                break


def _started(before: GraspSolution, after: GraspSolution) -> list[str]:
    """Names of contacts that stuck and slip now."""
    stuck = {_name(c) for c in before.contacts if c.status == "stick"}
    slip = [c for c in after.contacts if c.status == "slip" and _name(c) in stuck]
    return [_name(c) for c in slip]


def _name(contact: ObjectContact) -> str:
    words = f"{contact.finger} disk {contact.disk} {contact.point}"
    return f"{words} {contact.cable}".rstrip()
