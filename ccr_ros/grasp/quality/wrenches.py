# SPDX-License-Identifier: Apache-2.0
"""What contacts can do to the object: wrenches of their friction cones, and how far these reach.

A wrench is (force, moment about the centre / length), six numbers in newtons: the length makes
moments comparable with forces. Contact i with unit normal force gives

    a_i + B_i s,    |s| <= 1    a_i = (-n, (p - c) x -n / length),  B_i: mu times two tangents

and its reach along u, the support function of this disk of wrenches, is  a_i.u + |B_i' u|.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ccr_ros.model import checks
from ccr_ros.model.errors import InvalidValue
from ccr_ros.model.rotation import cross

from .contact import FrictionContact

_RANK = 1e-8  # singular values below this share of the largest are none: twins within 1e-9 m
_AXES = "xyz"
_PURE = 0.95  # a wrench with this share of its length in force (or moment) is named by it alone
_ON_AXIS = 0.98  # cosine, about 11 degrees


@dataclass(frozen=True, eq=False)
class ContactWrenches:
    """The wrenches of n contacts on one object.

    Attributes:
        normal: (n, 6) [N] of a unit normal force each.
        tangent: (n, 6, 2) [N] of the largest friction along two tangents beside it.
        limits: (n,) [N] largest normal forces; inf where there is none.
        length: [m] by which moments are divided.
    """

    normal: np.ndarray
    tangent: np.ndarray
    limits: np.ndarray
    length: float

    def reach(self, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return how far each contact's unit cone reaches, and where.

        Args:
            directions: (k, 6).

        Returns:
            (k, n) the largest ``direction . wrench`` at unit normal force, and (k, n, 6) the
            wrenches that have it.
        """
        across = np.einsum("nij,ki->knj", self.tangent, directions)
        size = np.linalg.norm(across, axis=2)
        unit = np.divide(across, size[..., None], out=np.zeros_like(across),
                         where=size[..., None] > 1e-15)  # fmt: skip
        points = self.normal[None] + np.einsum("nij,knj->kni", self.tangent, unit)
        return directions @ self.normal.T + size, points

    def edges(self, count: int) -> np.ndarray:
        """Return (n, count, 6) wrenches at unit normal force on as many edges of each cone."""
        angle = np.arange(count) * (2 * np.pi / count)
        circle = np.stack([np.cos(angle), np.sin(angle)])
        return self.normal[:, None] + (self.tangent @ circle).transpose(0, 2, 1)

    def missing(self) -> np.ndarray | None:
        """Return a unit wrench (6,) across everything these contacts can do; None if all are."""
        spanned = np.concatenate([self.normal[:, None], self.tangent.transpose(0, 2, 1)], axis=1)
        _, values, rows = np.linalg.svd(spanned.reshape(-1, 6), full_matrices=True)
        rank = int((values > _RANK * max(values, default=0.0)).sum())
        if rank == 6:
            return None
        # Of several, the one nearest an axis, so that it can be said in words.
        across = rows[rank:].T @ rows[rank:]
        nearest = across[:, int(np.argmax(np.diag(across).round(9)))]
        return nearest / np.linalg.norm(nearest)


def contact_wrenches(
    contacts: Sequence[FrictionContact], centre: np.ndarray, length: float | None = None
) -> ContactWrenches:
    """Return the wrenches of contacts about a centre.

    Args:
        contacts: Of one object.
        centre: (3,) [m] of the object, in the contacts' frame.
        length: [m] by which moments are divided; None: the largest distance of a contact from the
            centre, so that a unit force has at most a unit moment.

    Raises:
        InvalidValue: A value is out of range, or all contacts are at the centre.
    """
    middle = checks.vector("centre", centre, 3, unit="m", largest=1e3)
    arms = np.array([c.position for c in contacts]).reshape(-1, 3) - middle
    if length is None:
        length = float(np.linalg.norm(arms, axis=1).max(initial=0.0)) if len(arms) else 1.0
        if length < 1e-9:
            raise InvalidValue("length", length, "given where all contacts are at the centre")
    length = checks.real("length", length, above=0, unit="m")
    normals = np.array([c.normal for c in contacts]).reshape(-1, 3)
    least = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    first = cross(normals, least)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    tangents = np.stack([first, cross(normals, first)], axis=1)

    def wrench(force: np.ndarray, arm: np.ndarray) -> np.ndarray:
        return np.concatenate([force, cross(arm, force) / length], axis=-1)

    friction = np.array([c.friction for c in contacts])
    tangent = friction[:, None, None] * wrench(tangents, arms[:, None])
    return ContactWrenches(
        normal=wrench(-normals, arms),
        tangent=tangent.transpose(0, 2, 1),
        limits=np.array([c.limit for c in contacts]),
        length=length,
    )


def wrench_in_words(wrench: np.ndarray) -> str:
    """Return a wrench (force, moment / length) in words: "a force along -z", ..."""
    unit = wrench / np.linalg.norm(wrench)
    force, moment = unit[:3], unit[3:]
    words = []
    if np.linalg.norm(moment) < _PURE:
        words.append(f"a force along {_axis(force)}")
    if np.linalg.norm(force) < _PURE:
        words.append(f"a moment about {_axis(moment)}")
    return " with ".join(words)


def _axis(vector: np.ndarray) -> str:
    unit = vector / np.linalg.norm(vector)
    main = int(np.argmax(np.abs(unit)))
    if abs(unit[main]) >= _ON_AXIS:
        return ("-" if unit[main] < 0 else "") + _AXES[main]
    return "(" + ", ".join(f"{x + 0.0:.2f}" for x in unit.round(2)) + ")"
