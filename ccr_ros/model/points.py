# SPDX-License-Identifier: Apache-2.0
"""The points of a finger that touch things and that cables go through."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .finger import Finger


@dataclass(frozen=True)
class PointLabel:
    """What a point of the finger is: disk index, kind of point, and the cable it belongs to."""

    disk: int
    point: str
    cable: str


class Points:
    """The backbone, cable and antagonist points of a finger, each once.

    Two cables in opposite holes share their points (one's antagonist is the other's cable point);
    a point is listed once, lest the multipliers of its contact be ambiguous.

    Attributes:
        labels: One per point, ordered by disk.
        disk: (P,) disk index.
        offset: (P, 3) position in the disk's frame, in units of L.
        backbone: (n+1,) indices of the disk centres.
        cable, antagonist: Per cable, (k+1,) indices of its points.
    """

    def __init__(self, finger: Finger) -> None:
        radius = finger.disk_radius / finger.length
        self.labels: list[PointLabel] = []
        offsets: list[np.ndarray] = []
        backbone: list[int] = []
        self.cable: list[list[int]] = [[] for _ in finger.cables]
        self.antagonist: list[list[int]] = [[] for _ in finger.cables]
        for disk in range(finger.segments + 1):
            first = len(offsets)

            def index(label: PointLabel, offset: np.ndarray, first: int = first) -> int:
                for i in range(first, len(offsets)):
                    if np.abs(offsets[i] - offset).max() < 1e-9:
                        return i
                self.labels.append(label)
                offsets.append(offset)
                return len(offsets) - 1

            backbone.append(index(PointLabel(disk, "backbone", ""), np.zeros(3)))
            for kind, sign, table in (
                ("cable", 1, self.cable),
                ("antagonist", -1, self.antagonist),
            ):
                for j, cable in enumerate(finger.cables):
                    if disk <= cable.last_disk:
                        angle = cable.angles[disk]
                        hole = sign * radius * np.array([np.cos(angle), np.sin(angle), 0.0])
                        table[j].append(index(PointLabel(disk, kind, cable.name), hole))
        self.disk = np.array([label.disk for label in self.labels])
        self.offset = np.array(offsets)
        self.backbone = np.array(backbone)
