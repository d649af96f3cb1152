# SPDX-License-Identifier: Apache-2.0
"""Wanted curves that leave the base upwards and then follow the contour of an object.

All lies in the plane of z and the direction in which the object stands. There the object's section
is a rectangle with rounded corners (`Section`; a circle has no straight sides), and so is what the
backbone follows, the section grown by the disks' radius and a clearance. The way to it, the
lead-in, has a curvature that is a cubic of the arc length: 0 at the base, the contour's own where
it joins it, so that nothing jumps there. Of all joins the one is taken whose lead-in bends least.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial

from ..model import checks
from ..model.errors import InvalidValue
from .curves import PlanarCurve
from .section import Section

_NODES, _WEIGHTS = (x / 2 for x in np.polynomial.legendre.leggauss(24))
_NODES = _NODES + 0.5
_TOLERANCE = 1e-12  # relative to the way from the base to the join
_INSIDE = 1e-6  # m; so deep a lead-in may pass through the contour at the points looked at
_LOOKS = 65
_STEEPEST = math.radians(80.0)  # heading at which a lead-in may join
_JOINS = 49  # that are tried
_REFINEMENTS = 16


@dataclass(frozen=True)
class LeadIn:
    """The way from the base to the contour.

    Attributes:
        length: [m].
        heading: Heading [rad] as a polynomial of the fraction of the length.
        join: Position on the contour at which it joins; see `Section.knots` [m].
        bending: Integral of its squared curvature [1/m].
    """

    length: float
    heading: Polynomial
    join: float
    bending: float

    def points(self, count: int) -> np.ndarray:
        """Points (count, 2), forward and up, from the base to the join."""
        f = np.linspace(0.0, 1.0, count)
        psi = self.heading(f[:, None] * _NODES)
        return (self.length * f)[:, None] * np.stack(
            [np.sin(psi) @ _WEIGHTS, np.cos(psi) @ _WEIGHTS], axis=1
        )


def contour(
    name: str,
    length: float,
    section: Section,
    clearance: float,
    join: float | None = None,
) -> PlanarCurve:
    """Return the curve that leads to an object's contour and follows it to the curve's end.

    Args:
        name: What it is.
        length: Arc length of the whole curve [m].
        section: The object's section in the plane of z and x.
        clearance: Between the section and the backbone, the disks' radius included [m].
        join: Where on the contour the lead-in ends, counted along it from the middle of the side
            that faces the base, upwards [m]; ``None``: where it bends least.

    Raises:
        InvalidValue: The base is on or in the contour, no smooth lead-in outside of the contour
            leads to it, or the curve is too short to reach it or long enough to come round.
    """
    length = checks.real("length", length, above=0, high=1e3, unit="m")
    wanted = section.grown(checks.real("clearance", clearance, above=0, high=1e3, unit="m"))
    lead = lead_in(wanted, join) if join is not None else least_lead_in(wanted)
    return follow(name, length, wanted, lead)


def follow(name: str, length: float, wanted: Section, lead: LeadIn) -> PlanarCurve:
    """Return the curve along a lead-in and then the contour that it leads to; see `contour`.

    Raises:
        InvalidValue: The curve is too short to reach the contour, or long enough to come round.
    """
    positions, headings = wanted.knots()
    longest = lead.length + float(positions[-1]) - lead.join
    if not lead.length < length <= longest:
        raise InvalidValue(
            "length",
            length,
            f"more than the {lead.length * 1e3:.4g} mm that lead to the contour and at most the"
            f" {longest * 1e3:.4g} mm that end behind the object",
        )
    bend = lead.heading.deriv()
    rates = np.diff(headings) / np.maximum(np.diff(positions), 1e-300)

    def heading(s: np.ndarray) -> np.ndarray:
        along = np.interp(s - lead.length + lead.join, positions, headings)
        return np.where(s < lead.length, lead.heading(s / lead.length), along)

    def curvature(s: np.ndarray) -> np.ndarray:
        piece = np.searchsorted(positions, s - lead.length + lead.join, side="right") - 1
        along = rates[np.clip(piece, 0, len(rates) - 1)]
        return np.where(s < lead.length, bend(s / lead.length) / lead.length, along)

    breaks = (lead.length, *(lead.length + positions - lead.join))
    return PlanarCurve(name, length, heading, curvature, breaks=breaks)


def lead_in(wanted: Section, join: float) -> LeadIn:
    """Return the lead-in to a position on a contour; see `contour`.

    Raises:
        InvalidValue: None leads there, or it passes through the contour, saying how deep.
    """
    _check_base(wanted)
    reach = wanted.core[1] + wanted.corner_radius * _STEEPEST
    join = checks.real("join", join, low=-reach, high=reach, unit="m")
    lead = _solved(wanted, join, None)
    if lead is None:
        raise InvalidValue("join", join, "a position that a smooth curve from the base leads to")
    deepest = -float(wanted.signed_distance(lead.points(_LOOKS)).min())
    if deepest > _INSIDE:
        raise InvalidValue(
            "join",
            join,
            "a position that is reached from outside of the contour"
            f" (the way to it passes {deepest * 1e3:.3g} mm through it)",
        )
    return lead


def least_lead_in(wanted: Section, accept: Callable[[LeadIn], bool] | None = None) -> LeadIn:
    """Return the lead-in that bends least (integral of squared curvature), outside of the contour.

    Args:
        wanted: The contour.
        accept: What else it must satisfy.

    Raises:
        InvalidValue: There is none.
    """

    def tried(join: float, guess: LeadIn | None) -> tuple[LeadIn | None, bool]:
        lead = _outside(wanted, join, guess)
        return lead, lead is not None and abs(join) <= reach and (not accept or accept(lead))

    _check_base(wanted)
    reach = wanted.core[1] + wanted.corner_radius * _STEEPEST
    joins = np.linspace(reach, -reach, _JOINS)
    found: list[LeadIn] = []
    last: LeadIn | None = None
    for join in joins:  # from above: there the lead-in is longest and bends gently
        last, good = tried(float(join), last)
        if last is not None and good:
            found.append(last)
    if not found:
        raise InvalidValue(
            "base",
            [0.0, 0.0],
            "where a smooth curve along z leads to the contour from outside (its middle is"
            f" {wanted.forward * 1e3:.4g} mm in front and {wanted.up * 1e3:.4g} mm up, its side"
            f" {(wanted.forward - wanted.half_width) * 1e3:.4g} mm in front)",
        )
    best = min(found, key=lambda x: x.bending)
    step = float(joins[0] - joins[1]) / 2
    for _ in range(_REFINEMENTS):  # by ever smaller steps to either side
        near = [tried(best.join + d, best) for d in (-step, step)]
        best = min([best, *(x for x, good in near if x and good)], key=lambda x: x.bending)
        step /= 2
    return best


def _check_base(wanted: Section) -> None:
    depth = -float(wanted.signed_distance(np.zeros((1, 2)))[0])
    if depth >= 0:
        raise InvalidValue(
            "base",
            [0.0, 0.0],
            "outside of the contour, the object and the way to be kept from it (it is"
            f" {depth * 1e3:.4g} mm inside)",
        )


def _outside(wanted: Section, join: float, guess: LeadIn | None) -> LeadIn | None:
    lead = _solved(wanted, join, guess) or (_solved(wanted, join, None) if guess else None)
    if lead is None or wanted.signed_distance(lead.points(_LOOKS)).min() < -_INSIDE:
        return None
    return lead


def _solved(wanted: Section, join: float, guess: LeadIn | None) -> LeadIn | None:
    """Solve for length and curvature of the lead-in by Newton's method; None if it fails.

    With f the fraction of the length m, m kappa = m c f + f (1 - f) (p + q f), which is 0 at the
    base and m c, of the contour's curvature c, at the join. The unknowns m, p and q bring position
    and heading there to the contour's.
    """
    forward, up, heading, c = wanted.at(join)
    size = math.hypot(forward, up)
    goal = np.array([forward / size, up / size, heading])
    c *= size
    if guess is None:
        x = np.array([1.0, 0.0, 0.0])
    else:
        bend = guess.heading.deriv().coef
        bend = np.concatenate([bend, np.zeros(4 - len(bend))])
        # m c f + f (1 - f) (p + q f) = (m c + p) f + (q - p) f^2 - q f^3
        x = np.array([guess.length / size, -bend[2] - bend[3], -bend[3]])
    t = _NODES
    by_p, by_q = t**2 / 2 - t**3 / 3, t**3 / 3 - t**4 / 4  # heading per p and per q
    for _ in range(40):
        m, p, q = x
        psi = m * c * t**2 / 2 + p * by_p + q * by_q
        sine, cosine = np.sin(psi), np.cos(psi)
        reached = np.array([m * (sine @ _WEIGHTS), m * (cosine @ _WEIGHTS), 0.0])
        reached[2] = m * c / 2 + p / 6 + q / 12
        error = reached - goal
        if np.abs(error).max() < _TOLERANCE:
            break
        columns = [c * t**2 / 2, by_p, by_q]
        jacobian = np.array(
            [
                [m * ((cosine * d) @ _WEIGHTS) for d in columns],
                [-m * ((sine * d) @ _WEIGHTS) for d in columns],
                [c / 2, 1 / 6, 1 / 12],
            ]
        )
        jacobian[:2, 0] += reached[:2] / m
        step = np.linalg.solve(jacobian, -error)
        x = x + step * min(1.0, 0.3 * m / max(abs(step[0]), 1e-12), 3.0 / np.abs(step[1:]).max())
        if not (np.isfinite(x).all() and 0.2 < x[0] < 10 and np.abs(x).max() < 1e3):
            return None
    else:
        return None
    m, p, q = (float(v) for v in x)
    turn = Polynomial([0, m * c + p, q - p, -q])
    bending = float((turn(t) ** 2) @ _WEIGHTS) / (m * size)
    return LeadIn(m * size, turn.integ(), join, bending)
