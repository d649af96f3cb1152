# SPDX-License-Identifier: Apache-2.0
"""Which tensions to try for a wanted shape, likeliest first.

Pulls p do the work that the finger stores, about 1/2 sum T p as long as it answers linearly; and
most of that is the bending that the wanted shape shows.
"""

from __future__ import annotations

from itertools import pairwise, product

import numpy as np

from ..model.rotation import cross, skew
from .routing_chain import Target
from .segments import SegmentModel

# A cable through parallel holes has T = pull / a^2 (EI = L = 1); crossing ones bend a rod less,
# those of two cables share the work or work against each other. Measured on random routings: 0.99
# to 3.1 for one cable, 0.06 to 5.5 for two.
_STEPS = {1: np.geomspace(1.03, 2.9, 6), 2: np.geomspace(0.25, 5.0, 14)}
_TRIED = {1: 6, 2: 28}
_SHOWN = 0.65  # of the energy is bending that disk centres show (measured: 0.38 to 0.87)
_SHOWN_BY_SMALL = 0.85  # where holes change by at most two from disk to disk (0.78 to 0.9)


def likely_tensions(model: SegmentModel, target: Target, small: bool) -> list[np.ndarray]:
    """Return tensions (C,), T L^2 / EI, in the order in which they should be tried.

    Args:
        small: Holes change by no more than one or two from a disk to the next.
    """
    pulls = target.fractions + target.pulls  # of a rest length of about one
    cables = len(pulls)
    energy = bending_energy(target.points, model.rest_points()) / (
        _SHOWN_BY_SMALL if small else _SHOWN
    )
    tried = [
        pulls / model.radius**2 * np.array(step) for step in product(_STEPS[cables], repeat=cables)
    ]
    tried.sort(key=lambda t: abs(np.log(0.5 * float(t @ pulls) / max(energy, 1e-12))))
    return tried[: _TRIED[cables]]


def bending_energy(points: np.ndarray, rest: np.ndarray) -> float:
    """Return the bending energy that disk centres (n+1, 3) show, in EI / L for a unit length.

    Turns from chord to chord, less those at rest, in frames that are carried along without twist;
    the base's half segment turns from +z to the first chord.
    """
    turns = _turns(points) - _turns(rest)
    turns[0] *= np.sqrt(2.0)
    return 0.5 * float((turns * turns).sum()) * (len(points) - 1)


def _turns(points: np.ndarray) -> np.ndarray:
    """Rotation vectors (n, 3) from each direction to the next, in the carried frame."""
    chords = np.diff(points, axis=0)
    along = np.vstack([[0.0, 0.0, 1.0], chords / np.linalg.norm(chords, axis=1, keepdims=True)])
    frame, turns = np.eye(3), []
    for before, after in pairwise(along):
        axis = cross(before, after)
        sine, cosine = float(np.linalg.norm(axis)), float(before @ after)
        angle = np.arctan2(sine, cosine)
        unit = axis / max(sine, 1e-300)
        turns.append(angle * unit @ frame)
        k = skew(unit)
        frame = (np.eye(3) + sine * k + (1.0 - cosine) * (k @ k)) @ frame
    return np.array(turns)
