# SPDX-License-Identifier: Apache-2.0
"""The benchmark's cases: the reference files as fingers, and the same fingers with more disks."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator

from ccr_ros.model import Cable, Cylinder, Finger, Obstacle, Sphere

REFERENCE_DIRECTORY = Path(__file__).resolve().parents[1] / "test" / "data" / "reference"

TABLE_I = (
    "straight",
    "helical",
    "general_1",
    "general_2",
    "prebent_1_right",
    "prebent_1_left",
    "prebent_2_right",
    "prebent_2_left",
)
CONTACT = ("contact_cylinder", "contact_sphere")

_BACKBONE_DIAMETER = 0.0025  # m, of the paper's prototypes


@dataclass(frozen=True, eq=False)
class Case:
    """A finger, the pull to sweep to, and the truth at its end.

    Attributes:
        name: Name of the reference file.
        finger: The finger, obstacles included; forces per EI.
        pull_fraction: (m,) pull of each cable at the end of the sweep, of its rest length.
        truth: (n+1, 3) disk centres [m] at the end of the sweep by the reference file's rod, or
            ``None`` where the finger has other disks than the file's.
    """

    name: str
    finger: Finger
    pull_fraction: np.ndarray
    truth: np.ndarray | None

    @property
    def contact(self) -> bool:
        """Whether there is an obstacle."""
        return bool(self.finger.obstacles)


@cache
def load_case(name: str, segments: int | None = None) -> Case:
    """Read a reference file as a case; with ``segments``, the same finger with that many segments.

    The hole angles of more disks are interpolated smoothly (monotone cubic) over the backbone, and
    a segment's rest curvature is the mean of the original rest curvature over its length.

    Raises:
        FileNotFoundError: There is no such reference file.
    """
    data = json.loads((REFERENCE_DIRECTORY / f"{name}.json").read_text(encoding="utf-8"))
    n = data["segments"] if segments is None else segments
    same_disks = n == data["segments"]
    angles = [
        np.array(a) if same_disks else _more_disks(np.array(a), n) for a in data["hole_angles"]
    ]
    finger = Finger(
        name=name,
        length=data["length"],
        segments=n,
        disk_radius=data["disk_radius"],
        backbone_diameter=_BACKBONE_DIAMETER,
        poisson_ratio=data["poisson"],
        cables=tuple(Cable(f"cable_{j}", a) for j, a in enumerate(angles)),
        rest_curvature=_means(np.array(data["rest_curvature"]), n),
        obstacles=_obstacles(data.get("obstacle")),
    )
    last = data["states"][-1]
    truth = np.array(last["backbone"]) if same_disks else None
    return Case(name, finger, np.array(last["pull"]), truth)


def rms(backbone: np.ndarray, truth: np.ndarray) -> float:
    """Return the root of the mean squared distance [m] over the disk centres (n+1, 3)."""
    return float(np.sqrt(np.mean(np.sum((backbone - truth) ** 2, axis=1))))


def _more_disks(angles: np.ndarray, n: int) -> np.ndarray:
    s = np.linspace(0.0, 1.0, len(angles))
    return PchipInterpolator(s, np.unwrap(angles))(np.linspace(0.0, 1.0, n + 1))


def _means(curvature: np.ndarray, n: int) -> np.ndarray:
    """Average piecewise constant values (k, 3) over n equal pieces."""
    edges = np.linspace(0.0, 1.0, len(curvature) + 1)
    integral = np.vstack([np.zeros(3), np.cumsum(curvature, axis=0)]) / len(curvature)
    new = np.linspace(0.0, 1.0, n + 1)
    at_edges = np.column_stack([np.interp(new, edges, column) for column in integral.T])
    return np.diff(at_edges, axis=0) * n


def _obstacles(entry: dict | None) -> tuple[Obstacle, ...]:
    if entry is None:
        return ()
    if entry["type"] == "sphere":
        return (Sphere(entry["center"], entry["radius"], name="sphere"),)
    if entry["type"] == "cylinder":
        return (Cylinder(entry["axis_point"], entry["axis"], entry["radius"], name="cylinder"),)
    raise ValueError(
        f"obstacle type {entry['type']!r} in a reference file: must be sphere or cylinder"
    )
