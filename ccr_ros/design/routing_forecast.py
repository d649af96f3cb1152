# SPDX-License-Identifier: Apache-2.0
"""Where every choice of holes at the next disk would put it, to first order in the tensions.

A segment turns out of its rest shape by the sum of what each cable does to it, and that, at rest,
follows from the cable's two holes alone: H^2 evaluations per cable instead of H^4 solved segments
for two. It only says which routings are worth laying exactly (`routing_chain`).
"""

from __future__ import annotations

import numpy as np

from ..model.rotation import cross
from .routing_chain import Chain, Target
from .segments import SegmentModel


class Forecast:
    """First-order errors of routings at their next disk.

    Args:
        model: The finger's segments.
        holes: (H,) hole angles [rad].
        target: The wanted disks.
    """

    def __init__(self, model: SegmentModel, holes: np.ndarray, target: Target) -> None:
        self._target = target
        count = len(holes)
        self._count = count
        self._kinds, kind = np.unique(model.rest, axis=0, return_inverse=True)
        self._kind = kind.reshape(-1)
        pairs = len(self._kinds) * count**2
        rest = np.repeat(self._kinds, count**2, axis=0)
        start = np.tile(np.repeat(holes, count), len(self._kinds))[:, None]
        end = np.tile(holes, pairs // count)[:, None]
        at = model.evaluate(rest, start, end)
        bend = -(model.scale**2) * at.gradient[:, 0]
        twists = (at.twists @ bend[:, :, None])[:, :, 0]
        self._twists = twists.reshape(len(self._kinds), count, count, 6)
        first = slice(None, None, count**2)
        self._rotation, self._shift = at.rotation[first], at.translation[first]

    def costs(
        self, chain: Chain, holes: np.ndarray, tensions: np.ndarray, prior: np.ndarray
    ) -> np.ndarray:
        """Least errors (b, H, ..., H) of routings laid on to any holes of the C cables.

        Args:
            chain: (b,) routings.
            holes: (b, C) indices of the holes at their last disk.
            tensions: (C,) of the chain's table.
            prior: (C, C), see `Chain.costs`.
        """
        target, disk = self._target, chain.states.shape[1]
        kind, cables = self._kind[disk - 1], holes.shape[1]
        rotation = chain.rotation @ self._rotation[kind]
        shift = chain.rotation @ self._shift[kind]
        drift = chain.drift + cross(chain.turn, shift[:, None])
        e = target.errors(disk, rotation, chain.position + shift)
        d = target.slopes(disk, rotation, chain.turn, drift)
        back = chain.rotation.transpose(0, 2, 1)
        error, slopes = self._spread(e, None, cables), []
        for c in range(cables):
            twists = self._twists[kind, holes[:, c]]  # (b, H, 6)
            bent = target.slopes(disk, rotation, twists[:, :, :3] @ back, twists[:, :, 3:] @ back)
            error = error + tensions[c] * self._spread(bent, c, cables)
            slopes.append(self._spread(d[:, c], None, cables) + self._spread(bent, c, cables))
        ee = (error * error).sum(axis=-1) + self._spread(chain.ee[:, None], None, cables)[..., 0]
        ed = [
            (s * error).sum(axis=-1) + self._spread(chain.ed[:, c, None], None, cables)[..., 0]
            for c, s in enumerate(slopes)
        ]

        def dd(i: int, j: int) -> np.ndarray:
            sums = self._spread((chain.dd[:, i, j] + prior[i, j])[:, None], None, cables)[..., 0]
            return (slopes[i] * slopes[j]).sum(axis=-1) + sums

        if cables == 1:
            return ee - ed[0] ** 2 / dd(0, 0)
        xx, xy, yy = dd(0, 0), dd(0, 1), dd(1, 1)
        gain = yy * ed[0] ** 2 - 2 * xy * ed[0] * ed[1] + xx * ed[1] ** 2
        return ee - gain / (xx * yy - xy * xy)

    def _spread(self, values: np.ndarray, cable: int | None, cables: int) -> np.ndarray:
        """Values (b, m), or (b, H, m) over a cable's holes, as (b, H or 1 per cable, m)."""
        shape = [1] * cables
        if cable is not None:
            shape[cable] = self._count
        return values.reshape(len(values), *shape, values.shape[-1])
