# SPDX-License-Identifier: Apache-2.0
"""Ferrari and Canny's quality: the largest ball of wrenches that contacts can balance.

Ferrari and Canny (1992) bound what the contacts may do in one of two ways: the normal forces sum
up to at most one newton ("sum"; the wrenches are the convex hull of all unit cones), or each is at
most one newton ("each"; the Minkowski sum of the cones). The quality is the distance of the
origin from this set's boundary, the smallest of its support function h over unit directions.

The set is approximated from inside by a convex hull of points. Its nearest facet, at distance d
and with normal u, gives a bracket:  d <= quality <= h(u).  Where the two differ, the set's own
points farthest along the nearest facets' normals join the hull, until they agree (the expanding
polytope of van den Bergen (2001), in wrench space as in Zheng (2013)).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ccr_ros.model import checks
from ccr_ros.model.errors import InvalidValue, MissingPackage

from .closure import closure_of
from .contact import FrictionContact
from .wrenches import ContactWrenches, contact_wrenches

NORMS = ("sum", "each")
_BATCH = 30  # facets taken at once: symmetric grasps have many nearest ones
_DRAWN_IN = 1e-5  # how far points are drawn in at most, see _drawn_in

Support = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True, eq=False)
class Ball:
    """The largest ball of wrenches about zero that contacts can balance, between two bounds.

    Attributes:
        lower, upper: [N] the ball's radius lies between; 0 and 0 without force closure. ``lower``
            is the safe value.
        weakest: (6,) a unit wrench (force, moment / length); put on the object, no more than
            ``upper`` times it is balanced.
        length: [m] by which moments are divided.
    """

    lower: float
    upper: float
    weakest: np.ndarray
    length: float


def ferrari_canny(
    contacts: Sequence[FrictionContact],
    centre: np.ndarray,
    length: float | None = None,
    norm: str = "sum",
    tolerance: float = 0.01,
    edges: int = 8,
    rounds: int = 40,
) -> Ball:
    """Return the largest ball of wrenches that normal forces of one newton can balance.

    Args:
        contacts: Positions, normals and friction count; present forces and limits do not.
        centre: (3,) [m] of the object.
        length: [m] by which moments are divided; None: as in `contact_wrenches`.
        norm: "sum" of the normal forces at most 1 N, or "each" at most 1 N (many times slower).
        tolerance: Wanted of the bounds, (upper - lower) / upper.
        edges: Of each cone to begin with; 0 rounds is the usual linearised cone.
        rounds: At most so many times points are added; the bounds hold whenever it ends.

    Raises:
        InvalidValue: A value is out of range.
        MissingPackage: scipy is not installed.
    """
    if norm not in NORMS:
        raise InvalidValue("norm", norm, f"one of {', '.join(NORMS)}")
    tolerance = checks.real("tolerance", tolerance, low=1e-4, high=1)
    edges = checks.integer("edges", edges, low=3, high=64)
    rounds = checks.integer("rounds", rounds, low=0, high=1000)
    wrenches = contact_wrenches(contacts, centre, length)
    return ball_of(wrenches, norm, tolerance, edges, rounds)


def ball_of(
    wrenches: ContactWrenches, norm: str, tolerance: float, edges: int, rounds: int
) -> Ball:
    """Return the same of wrenches; arguments are those of `ferrari_canny`."""
    closure = closure_of(wrenches)
    if closure.weakest is not None:
        return Ball(0.0, 0.0, closure.weakest, wrenches.length)
    points = np.concatenate([np.zeros((1, 6)), wrenches.edges(edges).reshape(-1, 6)])
    if norm == "sum":
        support = _hull_support(wrenches)
    else:
        support = _sum_support(wrenches)
        axes = np.concatenate([np.eye(6), -np.eye(6)])
        points = np.concatenate([points, support(axes)[1]])
    lower, upper, direction = _expanded(points, support, tolerance, rounds)
    return Ball(lower, upper, -direction, wrenches.length)


def _hull_support(wrenches: ContactWrenches) -> Support:
    """Support function and its points of the convex hull of zero and all unit cones."""

    def support(directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        reach, points = wrenches.reach(directions)
        rows, best = np.arange(len(directions)), reach.argmax(axis=1)
        most = reach[rows, best]
        return np.maximum(most, 0.0), np.where(most[:, None] > 0, points[rows, best], 0.0)

    return support


def _sum_support(wrenches: ContactWrenches) -> Support:
    """The same of the Minkowski sum of all cones up to unit normal force."""

    def support(directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        reach, points = wrenches.reach(directions)
        return (
            np.maximum(reach, 0.0).sum(axis=1),
            np.where(reach[..., None] > 0, points, 0.0).sum(axis=1),
        )

    return support


def _expanded(
    points: np.ndarray, support: Support, tolerance: float, rounds: int
) -> tuple[float, float, np.ndarray]:
    """Return bounds of the distance to the boundary, and the direction of the upper one."""
    try:
        from scipy.spatial import ConvexHull, QhullError
    except ImportError:
        raise MissingPackage("grasp quality", "scipy", "quality") from None
    upper, direction = np.inf, np.zeros(6)
    for axes in (np.eye(6), -np.eye(6)):
        far, _ = support(axes)
        if far.min() < upper:
            upper, direction = float(far.min()), axes[int(far.argmin())]
    lower, middle = 0.0, points.mean(axis=0)
    try:
        hull = ConvexHull(_drawn_in(points, middle, 0), incremental=True)
        for done in range(rounds + 1):
            normals, distances = _nearest_facets(hull)
            lower = max(0.0, float(distances[0]))
            far, corners = support(normals)
            best = int(far.argmin())
            if far[best] < upper:
                upper, direction = float(far[best]), normals[best]
            if (lower > 0 and upper - lower <= tolerance * upper) or done == rounds:
                break
            beyond = (far - distances > 0.3 * tolerance * upper) & (distances < upper)
            hull.add_points(_drawn_in(corners[beyond], middle, len(hull.points)))
    except QhullError:
        # All but flat: some wrench can hardly be balanced. What is known by then still holds.
        pass
    return min(lower, upper), upper, direction


def _drawn_in(points: np.ndarray, middle: np.ndarray, first: int) -> np.ndarray:
    """Return points drawn towards the middle, each by another small share.

    Symmetric contacts have many points on one plane, on which Qhull fails in six dimensions. Drawn
    in they stay within the convex set, so the lower bound stays one.
    """
    share = ((first + np.arange(len(points))) * 0.6180339887498949) % 1.0  # spread evenly
    return points + _DRAWN_IN * (0.2 + 0.8 * share[:, None]) * (middle - points)


def _nearest_facets(hull: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return outward normals (k, 6) and distances (k,) of a hull's facets nearest to zero."""
    distances = -hull.equations[:, -1]
    near = np.argsort(distances)[: 4 * _BATCH]
    normals = hull.equations[near, :-1]
    _, single = np.unique(normals.round(6), axis=0, return_index=True)
    keep = np.sort(single)[:_BATCH]
    return normals[keep], distances[near][keep]
