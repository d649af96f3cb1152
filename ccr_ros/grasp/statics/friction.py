# SPDX-License-Identifier: Apache-2.0
"""Coulomb friction between disk points and the object, in one step of a quasi-static path.

A point that presses on the object is anchored where it first touched, in the object's own frame.
With t1, t2 the surface's tangents, x the point and a its anchor, both on the object as it is now,

    g = -(t1, t2) . (x - a)       the way against which friction acts (units of length)
    f                             its multipliers: (t1, t2) f is the friction force on the finger
    stick:  g = 0,  |f| <= mu N          slip:  f = mu N g / |g|

which is f = P(f + rho g), P the projection onto the disk of radius mu N, for any rho > 0
(Alart & Curnier 1991). Newton's method on this equation, which is smooth but for the change between
stick and slip, converges in a few steps. After a step (`settle`) a point that has slipped is
anchored where it is; so friction remembers the path, and each step gives off mu N |slip| as heat.
A point that comes to touch within a step has no friction in that step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ccr_ros.model.rotation import cross
from ccr_ros.model.sqp import ACTIVE, KktPoint

RHO = 100.0  # force per way, in units of EI / L^3; about thirty times a finger's own stiffness
_EYE = np.eye(3)
_EDGE = 1e-6  # relative; a friction force as near to the cone's border as that slips on


@dataclass(frozen=True, eq=False)
class Hold:
    """What friction remembers of a finger's points, in the object's frame and the finger's units.

    Attributes:
        anchors: (P, 3) where points hold on to the object; NaN: nowhere.
        pushes: (P, 3) friction forces on the finger.
        slipping: (P,) whether they slipped in the last step.
    """

    anchors: np.ndarray
    pushes: np.ndarray
    slipping: np.ndarray

    @staticmethod
    def none(points: int) -> Hold:
        """Return the memory of a finger of so many points that touches nothing."""
        return Hold(
            np.full((points, 3), np.nan), np.zeros((points, 3)), np.zeros(points, dtype=bool)
        )

    @property
    def anchored(self) -> np.ndarray:
        """(P,) whether a point holds on to the object."""
        return ~np.isnan(self.anchors[:, 0])


@dataclass(frozen=True, eq=False)
class FrictionRows:
    """The g contacts of a finger that have friction, at one point of the search.

    Attributes:
        index: (g,) their normals' rows among the finger's; where: (g,) their points.
        tangents: (g, 2, 3) in the finger's base frame.
        rows: (g, 2, N) gradient of the ways in the finger's coordinates.
        columns: (g, 2, 6) the same in the object's motion q.
        ways: (g, 2); forces: (g, 2).
        limits: (g,) mu N.
        slips: (g,) the point slips, as far as is known here.
    """

    index: np.ndarray
    where: np.ndarray
    tangents: np.ndarray
    rows: np.ndarray
    columns: np.ndarray
    ways: np.ndarray
    forces: np.ndarray
    limits: np.ndarray
    slips: np.ndarray

    def __len__(self) -> int:
        return len(self.index)

    @property
    def trial(self) -> np.ndarray:
        """(g, 2) forces of points that stuck with stiffness rho."""
        return self.forces + RHO * self.ways

    def error(self) -> float:
        """How far the forces are from f = P(f + rho g)."""
        if not len(self):
            return 0.0
        trial = self.trial
        size = np.linalg.norm(trial, axis=1)
        kept = np.minimum(1.0, self.limits / np.maximum(size, 1e-300))
        return float(np.abs(self.forces - kept[:, None] * trial).max())


def tangents_of(normals: np.ndarray) -> np.ndarray:
    """Return (g, 2, 3) unit tangents, normal to each other, for unit normals (g, 3)."""
    least = _EYE[np.argmin(np.abs(normals), axis=1)]
    first = cross(normals, least)
    first /= np.sqrt(np.einsum("gi,gi->g", first, first))[:, None]
    return np.stack([first, cross(normals, first)], axis=1)


def _turned(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return the products of matrices (g, m, 3) and vectors (g, 3), one each."""
    return (matrices @ vectors[:, :, None])[:, :, 0]


@lru_cache(maxsize=16)
def _none(size: int) -> FrictionRows:
    """No contacts with friction, of a finger of so many coordinates."""
    none, two = np.empty(0, dtype=int), np.empty((0, 2))
    return FrictionRows(
        none, none, np.empty((0, 2, 3)), np.empty((0, 2, size)), np.empty((0, 2, 6)),
        two, two, np.empty(0), np.empty(0, dtype=bool),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Touching:
    """A finger that is near the object, as `friction_rows` wants it.

    Attributes:
        point: The finger.
        touch: (k,) its rows that are contacts with the object.
        hold: What friction remembers.
        centre: (3,) the object's, in the base frame and the finger's units.
        turn: (3, 3) the object's orientation in the base frame.
        frame: (6, 6) from q to the object's motion in base frame and finger's units.
    """

    point: KktPoint
    touch: np.ndarray
    hold: Hold
    centre: np.ndarray
    turn: np.ndarray
    frame: np.ndarray

    def held(self) -> np.ndarray:
        """(g,) rows of the contacts that have friction."""
        pressed = self.touch[self.point.multipliers[self.touch] > ACTIVE]
        return pressed[self.hold.anchored[self.where(pressed)]]

    def where(self, rows: np.ndarray) -> np.ndarray:
        """(g,) points of contacts, given by their rows."""
        return self.point.pairs[rows - len(self.point.tensions), 1]


def friction_rows(fingers: Sequence[Touching], friction: float) -> list[FrictionRows]:
    """Return each finger's contacts that have friction, of coefficient mu.

    The contacts of all fingers are gone through at once.
    """
    none = [_none(f.point.rows.shape[1]) for f in fingers]
    if friction <= 0:
        return none
    chosen = [f.held() for f in fingers]
    counts = [len(rows) for rows in chosen]
    if not any(counts):
        return none
    places = [f.where(rows) for f, rows in zip(fingers, chosen, strict=True)]
    by_contact = list(zip(fingers, chosen, places, strict=True))
    normals = np.concatenate([f.point.normals[i - len(f.point.tensions)] for f, i, _ in by_contact])
    arms = np.concatenate([f.point.at.points[w] - f.centre for f, _, w in by_contact])
    turns = np.repeat([f.turn for f in fingers], counts, axis=0)
    frames = np.repeat([f.frame for f in fingers], counts, axis=0)
    anchors = _turned(turns, np.concatenate([f.hold.anchors[w] for f, _, w in by_contact]))
    pushes = _turned(turns, np.concatenate([f.hold.pushes[w] for f, _, w in by_contact]))
    pressing = np.concatenate([f.point.multipliers[i] for f, i, _ in by_contact])
    slipping = np.concatenate([f.hold.slipping[w] for f, _, w in by_contact])

    tangents = tangents_of(normals)
    ways = -_turned(tangents, arms - anchors)
    forces = _turned(tangents, pushes)
    columns = np.concatenate([tangents, cross(arms[:, None, :], tangents)], axis=2) @ frames
    limits = friction * pressing
    trial = forces + RHO * ways
    size = np.sqrt(np.einsum("gi,gi->g", trial, trial))
    slips = size > limits * (1 + np.where(slipping, -_EDGE, 1e-12))
    found, first = [], 0
    for empty, (finger, rows, where) in zip(none, by_contact, strict=True):
        own = slice(first, first + len(rows))
        first += len(rows)
        if not len(rows):
            found.append(empty)
            continue
        found.append(
            FrictionRows(
                index=rows,
                where=where,
                tangents=tangents[own],
                rows=-tangents[own] @ finger.point.first.points[where],
                columns=columns[own],
                ways=ways[own],
                forces=forces[own],
                limits=limits[own],
                slips=slips[own],
            )
        )
    return found


@dataclass(frozen=True, eq=False)
class Slip:
    """What friction did to a finger's points in a step.

    Attributes:
        ways: (P, 3) of the points on the object, in the object's frame and the finger's units.
        heat: Energy given off, in the finger's units.
    """

    ways: np.ndarray
    heat: float


def settle(
    point: KktPoint,
    touch: np.ndarray,
    rows: FrictionRows,
    hold: Hold,
    centre: np.ndarray,
    turn: np.ndarray,
) -> tuple[Hold, Slip]:
    """Return the memory after a step that has ended here, and what slipped in it."""
    count = len(hold.anchors)
    ways = np.zeros((count, 3))
    pressed = touch[point.multipliers[touch] > ACTIVE]
    where = point.pairs[pressed - len(point.tensions), 1]
    anchors = np.full((count, 3), np.nan)
    anchors[where] = (point.at.points[where] - centre) @ turn
    pushes = np.zeros((count, 3))
    slipping = np.zeros(count, dtype=bool)
    heat = 0.0
    if len(rows):
        stays = rows.where[~rows.slips]
        anchors[stays] = hold.anchors[stays]
        pushes[rows.where] = np.einsum("gi,gij->gj", rows.forces, rows.tangents) @ turn
        went = rows.where[rows.slips]
        ways[went] = anchors[went] - hold.anchors[went]
        slipping[went] = True
        after = np.linalg.norm(pushes[went], axis=1)
        before = np.where(hold.slipping[went], np.linalg.norm(hold.pushes[went], axis=1), after)
        mean = 0.5 * (before + after)
        heat = float(mean @ np.linalg.norm(ways[went], axis=1))
    return Hold(anchors, pushes, slipping), Slip(ways, heat)
