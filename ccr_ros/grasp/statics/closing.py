# SPDX-License-Identifier: Apache-2.0
"""Closing a gripper on a standing object until every finger presses with a wanted force."""

from __future__ import annotations

from collections.abc import Mapping

from ccr_ros.model import checks
from ccr_ros.model.errors import InvalidValue, NotConverged, UnknownName

from .result import GraspSolution
from .solver import GraspSolver

_LARGEST = 0.2  # of a finger's length; further no pull goes
_SMALLEST = 1e-9  # m; a step that is halved to this has no end
_FINEST = 1e-5  # m; a pose that is lost in such a step is not there


def close_with_forces(
    solver: GraspSolver,
    forces: float | Mapping[str, float],
    step: float = 4e-4,
    tolerance: float = 0.02,
) -> GraspSolution:
    """Pull every finger until it presses on the supported object with its force.

    All cables of a finger are pulled by the same amount more than they are. A finger that presses
    with its force waits; none is pulled back, so that friction keeps one sense: a step that presses
    too much, or loses the pose, is undone and halved.

    Args:
        solver: Its object is supported.
        forces: Sum of a finger's normal forces [N]: of every finger, or by name.
        step: Largest change of a pull at once [m].
        tolerance: Of the forces, as a share of them.

    Raises:
        InvalidValue: The object is not supported, or a value is out of range.
        UnknownName: A force of no finger, or a finger without one.
        NotConverged: A finger does not come to its force, or the pose is lost on the way.
    """
    if not solver.supported:
        raise InvalidValue("solver", "an object without support", "one that stands on its support")
    wanted = wanted_forces(solver.names, forces)
    checks.real("step", step, above=0, high=0.01, unit="m")
    checks.real("tolerance", tolerance, low=1e-6, high=0.5)
    most = {m.finger.name: _LARGEST * m.finger.length for m in solver.hand.mounted}
    steps = dict.fromkeys(wanted, step)
    solution = solver.solve({}).require_converged()
    now = pressing(solution)
    _check_not_too_much(now, wanted, tolerance)
    while True:
        short = [name for name, force in wanted.items() if now[name] < (1 - tolerance) * force]
        if not short:
            return solution
        before, pulls = solver.standing, solver.pulls
        for name in short:
            pulls[name] = pulls[name] + steps[name]
            if float(pulls[name].max()) > most[name]:
                raise NotConverged(
                    name,
                    f"it presses with {now[name]:.3g} N of the wanted {wanted[name]:.3g} N at the"
                    f" largest pull, {most[name] * 1e3:.3g} mm",
                )
        found = solver.solve(pulls)
        if not found.converged:
            if max(steps[name] for name in short) < _FINEST:
                found.require_converged()
            for name in short:
                steps[name] *= 0.5
            continue
        after = pressing(found)
        over = [name for name in short if after[name] > (1 + tolerance) * wanted[name]]
        if over:
            solver.resume(before)
            for name in over:
                part = (wanted[name] - now[name]) / (after[name] - now[name])
                steps[name] *= min(0.5, max(0.1, part))
                if steps[name] < _SMALLEST:
                    raise NotConverged(
                        name,
                        f"its force jumps from {now[name]:.3g} to {after[name]:.3g} N, beyond the"
                        f" wanted {wanted[name]:.3g} N",
                    )
            continue
        for name in short:
            gain = after[name] - now[name]
            if gain > 0:
                left = wanted[name] - after[name]
                steps[name] = min(step, max(steps[name] * left / gain, 10 * _SMALLEST))
        solution, now = found, after


def wanted_forces(names: tuple[str, ...], forces: float | Mapping[str, float]) -> dict[str, float]:
    """Return the wanted force [N] of each finger, in the order of ``names``.

    Raises:
        InvalidValue: One is not positive.
        UnknownName: A force of no finger, or a finger without one.
    """
    if not isinstance(forces, Mapping):
        forces = dict.fromkeys(names, forces)
    for name in forces:
        if name not in names:
            raise UnknownName("finger", name, names)
    for name in names:
        if name not in forces:
            allowed = f"given for each of {', '.join(names)}"
            raise InvalidValue(f"forces.{name}", None, allowed)
    return {
        name: checks.real(f"forces.{name}", forces[name], above=0, high=1e6, unit="N")
        for name in names
    }


def pressing(solution: GraspSolution) -> dict[str, float]:
    """Return the sum of each finger's normal forces on the object [N], 0 without contact."""
    total = {finger.finger.name: 0.0 for finger in solution.fingers}
    for contact in solution.contacts:
        total[contact.finger] += contact.force
    return total


def _check_not_too_much(now: dict[str, float], wanted: dict[str, float], tolerance: float) -> None:
    for name, force in wanted.items():
        if now[name] > (1 + tolerance) * force:
            allowed = f">= {now[name]:.6g} N, with which it presses already"
            raise InvalidValue(f"forces.{name}", force, allowed)
